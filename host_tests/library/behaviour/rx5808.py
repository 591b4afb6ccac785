"""What the video receiver is told for each frequency, bit by bit."""

from firmware.rx5808 import HIGHEST_MHZ, LOWEST_MHZ, Rx5808, synthesizer_b

from behaviour.support import equal, sample

# The channels that the chip chooses by its pins, as the data sheet lists them, and the values that
# are published for them: 5865 MHz is also what the register holds after power-on.
_KNOWN = {
    5865: 0x2A05,
    5845: 0x299B,
    5825: 0x2991,
    5805: 0x2987,
    5785: 0x291D,
    5765: 0x2913,
    5745: 0x2909,
    5725: 0x289F,
    5733: 0x2903,
    5752: 0x290C,
    5771: 0x2916,
    5790: 0x291F,
    5809: 0x2989,
    5828: 0x2992,
    5847: 0x299C,
    5866: 0x2A05,
    5705: 0x2895,
    5685: 0x288B,
    5665: 0x2881,
    5645: 0x2817,
    5885: 0x2A0F,
    5905: 0x2A19,
    5925: 0x2A83,
    5945: 0x2A8D,
}


class _Pin:
    """A pin that notes its levels in a list of (name, level), once it is an output."""

    OUT = 7

    def __init__(self, name, notes):
        self.name = name
        self.notes = notes
        self.mode = None

    def init(self, mode, value):
        equal(mode, self.OUT)
        self.mode = mode
        self.value(value)

    def value(self, level):
        assert level in (0, 1) and self.mode == self.OUT
        self.notes.append((self.name, level))


def _receiver():
    notes = []
    receiver = Rx5808(*(_Pin(name, notes) for name in ("clock", "data", "select")))
    # Idle: not selected, and the clock low.
    equal(sorted(notes), [("clock", 0), ("data", 0), ("select", 1)])
    notes.clear()
    return receiver, notes


def _words(notes):
    """The words in a list of levels, as (address, whether written, value)."""
    words = []
    levels = {"clock": 0, "data": 0, "select": 1}
    bits = None
    for name, level in notes:
        if name == "data":
            equal(levels["clock"], 0, "clock while data changes")
        elif name == "clock" and level:
            assert levels["select"] == 0 and not levels["clock"]
            bits.append(levels["data"])
        elif name == "select" and level:
            equal((levels["clock"], len(bits)), (0, 25))
            word = sum(bit << place for place, bit in enumerate(bits))
            words.append((word & 15, word >> 4 & 1, word >> 5))
        elif name == "select":
            equal(levels["select"], 1)
            bits = []
        levels[name] = level
    equal((levels["clock"], levels["select"]), (0, 1))
    return words


def known_frequencies():
    equal({mhz: synthesizer_b(mhz) for mhz in _KNOWN}, _KNOWN)


def every_frequency_is_tuned_to_1_mhz():
    for mhz in range(5300, 6001):
        value = synthesizer_b(mhz)
        n, a = value >> 7, value & 127
        assert a < 32, mhz
        tuned_mhz = 2 * (32 * n + a) * 8 // 8 + 479
        equal(tuned_mhz, mhz - 1 if mhz % 2 == 0 else mhz)


def every_frequency_goes_over_the_wires():
    receiver, notes = _receiver()
    equal(receiver.frequency_mhz, None)
    for mhz in sample(range(5300, 6001), 5):
        notes.clear()
        equal(receiver.set_frequency(mhz), True)
        equal(receiver.frequency_mhz, mhz)
        wanted = [(0x0, 1, 0x8), (0xA, 1, 0x10DF3), (0x1, 1, synthesizer_b(mhz))]
        equal(_words(notes), wanted, f"{mhz} MHz")
    equal(receiver.faults, 0)


def the_same_frequency_is_sent_again():
    receiver, notes = _receiver()
    for _ in range(2):
        notes.clear()
        equal(receiver.set_frequency(5800), True)
        equal(len(_words(notes)), 3)


def what_is_no_frequency_is_counted_and_not_sent():
    receiver, notes = _receiver()
    equal((LOWEST_MHZ, HIGHEST_MHZ), (5300, 6000))
    receiver.set_frequency(5800)
    notes.clear()
    bad = (5299, 6001, 0, -5800, 1 << 40, None, 5800.0, "5800", b"5800", True, [], float("nan"))
    for count, mhz in enumerate(bad):
        equal(receiver.set_frequency(mhz), False, repr(mhz))
        equal(receiver.faults, count + 1)
    equal((notes, receiver.frequency_mhz), ([], 5800))
