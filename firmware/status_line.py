"""The state of everything as a line of JSON, written anew into the same bytes each time.

Each number has its place in the line and is padded with blanks: a line always has the same length,
and to write one takes next to no memory.
"""

# ruff: noqa: F821 - ptr8, ptr16 and ptr32 are viper's own names
from array import array

import micropython
import uctypes
from micropython import const

from firmware.status_outputs import places

# Words of a field.
_END = const(0)  # where it ends in the line
_WIDTH = const(1)
_ADDRESS = const(2)
_SCALE = const(3)  # 0: a word as it is; of a halfword: to sixteenths of a hundredth;
# negative: the same, and zero is null
_WORDS = const(4)

_PULSE_SCALE = const(-400)  # a quarter of a microsecond has 25 hundredths

# Values that are no numbers, and what stands for them.
_NULL = -(1 << 31)
_TRUE = _NULL + 1
_FALSE = _NULL + 2
_TEXTS = b" null truefalse"
_TEXT_WIDTH = const(5)

_LINK_WIDTH = const(11)  # "searching"
_COUNTER = const(10)

_RECEIVER = (
    ("lq", 3),
    ("rssi_dbm", 4),
    ("rf_mode", 2),
    ("telemetry_requested", 5),
    ("tx_power_dbm", 4),
    ("frames", _COUNTER),
    ("crc_errors", _COUNTER),
    ("length_errors", _COUNTER),
    ("skipped_bytes", _COUNTER),
    ("unknown_frames", _COUNTER),
    ("foreign_frames", _COUNTER),
    ("msp_frames", _COUNTER),
    ("msp_lost", _COUNTER),
)
_CONTROL = (("failsafes", _COUNTER), ("telemetry_frames", _COUNTER), ("collisions", _COUNTER))
_OWN = (
    ("armed", 5),
    ("telemetry_expired", _COUNTER),
    ("msp_answered", _COUNTER),
    ("msp_errors", _COUNTER),
)
_FAULTS = ("faults", _COUNTER)
_SENSORS = {
    "battery": (
        ("voltage_mv", 7),
        ("current_ma", 7),
        ("consumed_mah", 7),
        ("cell_count", 5),
        ("low", 5),
        ("critical", 5),
        _FAULTS,
    ),
    "gps": (
        ("fix", 5),
        ("fix_3d", 5),
        ("satellites", 5),
        ("lat_e7", 11),
        ("lon_e7", 11),
        ("alt_m", 6),
        ("speed_cm_s", 6),
        ("course_decideg", 5),
        ("home_distance_m", 8),
        ("home_direction_decideg", 5),
        _FAULTS,
    ),
    "barometer": (
        ("altitude_cm", 8),
        ("vario_cm_s", 6),
        ("pressure_pa", 6),
        ("temperature_decicelsius", 5),
        _FAULTS,
    ),
    "magnetometer": (("heading_decideg", 5), _FAULTS),
}


class StatusLine:
    """A line about an `Application`: `text`, with its end; the state is that of the last `fill`.

    Pulses are in microseconds: those of the channels, null = not received, and of the pins, as
    their PWM has them; 0 = low, and what is longer than 2200 us is high all the time.
    """

    def __init__(self, application):
        adapter = application.adapter
        self._application = application
        self._adapter = adapter
        self.time_ms = 0
        self._sources = []  # (object, attribute): values that only Python can get
        self._fields = array("i")
        self.text = bytearray(b'{"ghst":"status","link":')
        self._link = len(self.text)
        self.text += b" " * _LINK_WIDTH
        self._add(self, (("time_ms", _COUNTER),))
        self._add(adapter.receiver, _RECEIVER)
        self._add(adapter.control, _CONTROL)
        self._add(self, _OWN)
        self._add(adapter.control, (("stuck", _COUNTER),), b"main_loop_")
        self._add(application, (_FAULTS, ("cycle_time_us", _COUNTER)), b"main_loop_")
        if adapter.outputs.shapes:
            self._add(adapter.outputs.shapes, (("weak_frames", _COUNTER),))
        self._add_pulses(adapter)
        for name in sorted(application.sensors):
            self.text += b',"' + name.encode() + b'":{'
            self._add(application.sensors[name], _SENSORS.get(name, (_FAULTS,)))
            self.text += b"}"
        self.text += b"}\r\n"
        self._values = array("i", [0] * len(self._sources))
        first = uctypes.addressof(self._values)
        for at in range(0, len(self._fields), _WORDS):
            if not self._fields[at + _SCALE]:
                self._fields[at + _ADDRESS] = first + 4 * self._fields[at + _ADDRESS]

    @property
    def armed(self):
        """Whether motors may turn."""
        return self._adapter.link == "linked" and self._adapter.outputs.armed

    # What is not loaded has done nothing.
    @property
    def telemetry_expired(self):
        """Telemetry frames that found no slot in time."""
        telemetry = self._application._telemetry
        return telemetry.expired if telemetry else 0

    @property
    def msp_answered(self):
        """MSP requests that got an answer."""
        return self._application._msp.answered if self._application._msp else 0

    @property
    def msp_errors(self):
        """MSP requests that got an error for an answer."""
        return self._application._msp.errors if self._application._msp else 0

    def _add(self, thing, names, prefix=b""):
        for name, width in names:
            if self.text[-1] != ord("{"):
                self.text += b","
            self.text += b'"' + prefix + name.encode() + b'":'
            self._field(width, len(self._sources), 0)
            self._sources.append((thing, name))

    def _add_pulses(self, adapter):
        self.text += b',"channels_us":['
        pulses = uctypes.addressof(adapter.receiver.pulses)
        for channel in range(16):
            self._field(7, pulses + 2 * channel, _PULSE_SCALE)
            self.text += b","
        self.text[-1:] = b'],"outputs_us":{'
        for pin, address, scale in places(adapter.outputs, -_PULSE_SCALE):
            self.text += b'"' + str(pin).encode() + b'":'
            self._field(8, address, scale)
            self.text += b","
        if self.text[-1] == ord(","):
            self.text[-1:] = b""
        self.text += b"}"

    def _field(self, width, address, scale):
        self.text += b" " * width
        for word in (len(self.text), width, address, scale):
            self._fields.append(word)

    def fill(self, now_ms):
        """Writes the state of now into `text`."""
        self.time_ms = now_ms
        link = f'"{self._adapter.link}"'
        self.text[self._link : self._link + _LINK_WIDTH] = f"{link:{_LINK_WIDTH}}".encode()
        values = self._values
        for index, (thing, name) in enumerate(self._sources):
            value = getattr(thing, name)
            if value is None:
                value = _NULL
            elif value is True:
                value = _TRUE
            elif value is False:
                value = _FALSE
            values[index] = value
        _write(self.text, self._fields, len(self._fields), _TEXTS)


# fmt: off
@micropython.viper
def _write(line, table, words: int, texts):
    # fmt: on
    text = ptr8(line)
    fields = ptr32(table)
    constants = ptr8(texts)
    at = 0
    while at < words:
        place = fields[at + _END]
        start = place - fields[at + _WIDTH]
        scale = fields[at + _SCALE]
        constant = -1
        point = 0
        if scale:
            value = ptr16(fields[at + _ADDRESS])[0]
            if scale < 0:
                scale = 0 - scale
                if value == 0:
                    constant = 0
            value = (value * scale + 8) >> 4
            point = place - 3
        else:
            value = ptr32(fields[at + _ADDRESS])[0]
            constant = value - int(_NULL)
        at += _WORDS
        if constant >= 0 and constant < 3:
            constant = _TEXT_WIDTH * constant + _TEXT_WIDTH
            while place > start and place > fields[at - _WORDS + _END] - _TEXT_WIDTH:
                place -= 1
                constant -= 1
                text[place] = constants[constant]
        else:
            negative = value < 0
            if negative:
                value = 0 - value
            digits = True
            while digits and place > start:
                place -= 1
                if place == point:
                    text[place] = 46
                else:
                    rest = value // 10
                    text[place] = 48 + value - 10 * rest
                    value = rest
                    # One digit at least stands before the point.
                    digits = value != 0 or (place > point - 1 and point != 0)
            if negative and place > start:
                place -= 1
                text[place] = 45
        while place > start:
            place -= 1
            text[place] = 32
