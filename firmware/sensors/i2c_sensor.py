"""`I2cSensor`: finds a chip on the bus, starts it, reads it, and notices when it is gone.

What a sensor is told of a chip is a tuple: its addresses; the register that identifies it, and
what that may read; file and class of its driver in `firmware.sensors`. A driver is loaded when its
chip has answered, so that only what is on the bus takes memory. It is an object with

* `NAME`;
* `address`: where to talk to it, set from outside;
* `identify()`: whether the chip is there, by its identification registers;
* `start(step)`: does step 0, 1, 2... of starting it; returns the milliseconds until the next
  step, `STARTED` or `FAILED`;
* `read(now_ms)`: fetches a measurement; `NEW`, `NOTHING` when there is none yet, or `FAILED` when
  the chip does not answer, or not as it must;
* `convert()`: works out what `read` has fetched; `NEW`, `OVERFLOW` when it was beyond the range,
  or `FAILED` when it cannot be;
* `raw`: the measurement folded into one integer, which in a living chip keeps changing;
* `taken_ms`: when it was taken;
* `PERIOD_MS`: how long after `read` to ask for the next.
"""

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from ghst.schedule import ticks_diff

FAILED = const(-1)
NOTHING = const(0)
NEW = const(1)
OVERFLOW = const(2)
STARTED = const(0)

_SEARCHING = const(0)
_STARTING = const(1)
_RUNNING = const(2)

_FIRST_PAUSE_MS = const(100)
_LONGEST_PAUSE_MS = const(5000)
_ASK_AGAIN_MS = const(2)
_AFTER_FAULT_MS = const(10)
_FAULTS_IN_A_ROW = const(3)
_SILENT_MS = const(300)
_STALE_MS = const(1000)
_FROZEN_MS = const(3000)
_COUNTER_MASK = const(0x3FFFFFFF)


# Native: as bytecode it would take the heap for its frame.
@micropython.native
def read_whole(bus, address, register, data, again):
    """Reads registers that the chip may fill anew while they are read.

    `again`: a buffer as long as `data`. Returns `NEW` with what belongs together in `data`;
    `NOTHING` when a measurement came in between: the next one is far enough away then; `FAILED`
    when the chip does not answer.
    """
    if not (bus.read(address, register, data) and bus.read(address, register, again)):
        return FAILED
    return NEW if data == again else NOTHING


class I2cSensor:
    """What barometer and magnetometer have in common.

    A subclass has `_measured()`, called for each measurement, which returns whether it can be
    true; `_load()`, called when a driver has been loaded; `_started()`, called when a chip begins
    to measure; and `_forget()`, which makes the values None.
    """

    def __init__(self, bus, chips, address):
        """`chips`: tuples as above; `address`: the only one to search at, or None."""
        self.faults = 0
        self._bus = bus
        self._candidates = [
            (chip, place) for chip in chips for place in chip[0] if address in (None, place)
        ]
        if not self._candidates:
            places = sorted({place for chip in chips for place in chip[0]})
            known = ", ".join([f"0x{place:02x}" for place in places])
            raise ValueError(f"address is {address}, must be one of {known}")
        self._identity = bytearray(1)
        self._kind = None  # of `chips`, the one whose driver is `_chip`
        self._chip = None
        self._state = _SEARCHING
        self._place = 0
        self._tried = 0
        self._step = 0
        # Times are only ever subtracted: sums could leave the range of small integers.
        self._asked_ms = 0
        self._wait_ms = 0
        self._pause_ms = _FIRST_PAUSE_MS
        self._faults_in_a_row = 0
        self._fetched = False
        self._good = False
        self._good_ms = 0
        self._proven = False
        self._heard_ms = 0
        self._raw = 0
        self._changed_ms = 0
        self._frozen = False

    @property
    def chip(self):
        """Name of the chip that is being read; None while there is none."""
        return self._chip.NAME if self._state == _RUNNING else None

    def update(self, now_ms):
        """See `firmware.sensors`. What was fetched in one call is worked out in the next."""
        if self._good and ticks_diff(now_ms, self._good_ms) > _STALE_MS:
            self._good = False
            self._forget()
        if self._fetched:
            self._fetched = False
            return self._take(self._convert(now_ms), now_ms)
        if self._wait_ms and ticks_diff(now_ms, self._asked_ms) < self._wait_ms:
            return False
        if not self._bus.ready(now_ms):
            return False
        self._asked_ms = now_ms
        if self._state == _RUNNING:
            return self._fetch(now_ms)
        if self._state == _STARTING:
            self._start(now_ms)
        else:
            self._search()
        return False

    def _fault(self):
        self.faults = (self.faults + 1) & _COUNTER_MASK

    def _pause(self):
        self._wait_ms = self._pause_ms
        self._pause_ms = min(2 * self._pause_ms, _LONGEST_PAUSE_MS)

    def _find(self, kind, address):
        """Whether a chip of this kind is there; if so, its driver is in `_chip`."""
        _, register, values, file, name = kind
        if not self._bus.read(address, register, self._identity):
            return False
        if self._identity[0] not in values:
            return False
        if self._kind is not kind:
            try:
                module = __import__("firmware.sensors." + file, None, None, (name,))
            except ImportError:
                return False  # this board ships without it
            self._chip = getattr(module, name)(self._bus)
            self._kind = kind
            self._load()
        self._chip.address = address
        return self._chip.identify()

    def _search(self):
        self._wait_ms = 0
        if self._find(*self._candidates[self._place]):
            self._state = _STARTING
            self._step = 0
            self._tried = 0
            return
        self._place = (self._place + 1) % len(self._candidates)
        self._tried += 1
        if self._tried == len(self._candidates):
            self._tried = 0
            self._fault()
            self._pause()

    def _start(self, now_ms):
        self._wait_ms = self._chip.start(self._step)
        self._step += 1
        if self._wait_ms == FAILED:
            self._lose()
        elif self._wait_ms == STARTED:
            self._state = _RUNNING
            self._proven = False
            self._faults_in_a_row = 0
            self._heard_ms = now_ms
            self._changed_ms = now_ms
            self._started()

    def _lose(self):
        """Counts a fault and starts from the beginning: at once if the chip has worked."""
        self._fault()
        self._state = _SEARCHING
        if self._proven:
            self._proven = False
            self._wait_ms = 0
        else:
            self._pause()

    def _fetch(self, now_ms):
        found = self._chip.read(now_ms)
        if found == NEW:
            self._wait_ms = self._chip.PERIOD_MS
            self._fetched = True
            return False
        self._wait_ms = _ASK_AGAIN_MS
        return self._take(found, now_ms)

    def _convert(self, now_ms):
        found = self._chip.convert()
        if found == NEW:
            if not self._changes(now_ms):
                return NOTHING
            if not self._measured():
                return FAILED
        return found

    def _take(self, found, now_ms):
        """Notes what came of asking the chip; returns whether there are new values."""
        if found == NEW:
            self._faults_in_a_row = 0
            self._pause_ms = _FIRST_PAUSE_MS
            self._proven = True
            self._good = True
            self._good_ms = now_ms
            self._heard_ms = now_ms
            return True
        if found == FAILED:
            self._faults_in_a_row += 1
            if self._faults_in_a_row == _FAULTS_IN_A_ROW:
                self._lose()
            else:
                self._fault()
                self._wait_ms = _AFTER_FAULT_MS
        elif found == OVERFLOW:
            self._heard_ms = now_ms
            self._fault()
        elif ticks_diff(now_ms, self._heard_ms) > _SILENT_MS:
            self._lose()
        return False

    def _changes(self, now_ms):
        """Whether the measurement is another one; a chip that hangs repeats itself bit by bit.

        Once it has for long, it counts as silent until it gives something else.
        """
        if self._chip.raw != self._raw:
            self._raw = self._chip.raw
            self._changed_ms = now_ms
            self._frozen = False
        elif ticks_diff(now_ms, self._changed_ms) > _FROZEN_MS:
            self._frozen = True
        return not self._frozen
