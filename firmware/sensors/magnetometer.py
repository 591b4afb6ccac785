"""`Magnetometer`: heading from the chip that is on the bus, and its hard-iron calibration.

Any of QMC5883L, HMC5883L, LIS3MDL. The heading is right while the model is level: there is no
tilt compensation. A chip that is missing or vanishes is searched for after 100 ms, 200 ms and so
on up to 5 s.
"""

from array import array

try:
    import micropython
    from micropython import const
except ImportError:
    from ghst._host import const, micropython

from firmware.sensors.i2c_sensor import I2cSensor

LARGEST_OFFSET_NT = const(1_000_000)

_CHIPS = (
    ((0x0D,), 0x0D, (0xFF,), "qmc5883l", "Qmc5883l"),
    ((0x1E,), 0x0A, (0x48,), "hmc5883l", "Hmc5883l"),
    ((0x1C, 0x1E), 0x0F, (0x3D,), "lis3mdl", "Lis3mdl"),
)


class Magnetometer(I2cSensor):
    """A magnetometer on an `I2cBus`; about 25 values a second.

    `heading_decideg`: 0..3599 clockwise from true north, where the model's nose points to; None
    before it is known and a second after the last measurement. `field_nt`: x, y, z of the chip in
    nanotesla, without the offset (the earth has 25000 to 65000 in all). `offset_nt`: the field of
    the model itself, for the three axes of the chip. A measurement beyond the chip's range is a
    fault and is left out.
    """

    def __init__(
        self,
        bus,
        *,
        address=None,
        offset_nt=(0, 0, 0),
        declination_decideg=0,
        rotation_deg=0,
        upside_down=False,
    ):
        """`address`: 0x0D, 0x1C or 0x1E, or None to search at all of them.

        `offset_nt`: what `finish_calibration` returned. `declination_decideg`: -1800..1800, by
        how much a compass needle points east of true north. `rotation_deg`: 0..359, by how much
        the arrow of the chip's x axis is turned clockwise from the nose, seen from above.
        `upside_down`: whether the chip's top faces down. Raises `ValueError` for what cannot be.
        """
        super().__init__(bus, _CHIPS, address)
        if len(offset_nt) != 3 or max([abs(part) for part in offset_nt]) > LARGEST_OFFSET_NT:
            raise ValueError(
                f"offset_nt is {offset_nt}, must be three of -{LARGEST_OFFSET_NT}.."
                f"{LARGEST_OFFSET_NT}: calibrate again"
            )
        if not -1800 <= declination_decideg <= 1800:
            raise ValueError(f"declination_decideg is {declination_decideg}, must be -1800..1800")
        if not 0 <= rotation_deg < 360:
            raise ValueError(f"rotation_deg is {rotation_deg}, must be 0..359")
        self.offset_nt = tuple(offset_nt)
        self.field_nt = array("i", (0, 0, 0))
        self._measured_nt = array("i", (0, 0, 0))
        self._correction_decideg = declination_decideg - 10 * rotation_deg
        self._upside_down = upside_down
        self._calibration = None
        self._forget()

    def _forget(self):
        self.heading_decideg = None

    def _load(self):
        from firmware.sensors.arithmetic import atan2_decideg

        self._angle_decideg = atan2_decideg

    def _started(self):
        pass

    # Native: as bytecode it would take the heap for its frame.
    @micropython.native
    def _measured(self):
        chip = self._chip
        words = chip.words
        if not (words[0] or words[1] or words[2]):
            return False  # what a dead chip says; the earth's field is always there
        measured_nt = self._measured_nt
        for axis in range(3):
            measured_nt[axis] = chip.nanotesla(words[axis])
            self.field_nt[axis] = measured_nt[axis] - self.offset_nt[axis]
        if self._calibration is not None:
            self._calibration.update(measured_nt)
        # Seen from above, y is left of x, and right of it when the chip is upside down.
        left_nt = -self.field_nt[1] if self._upside_down else self.field_nt[1]
        angle_decideg = self._angle_decideg(left_nt, self.field_nt[0])
        self.heading_decideg = (angle_decideg + self._correction_decideg) % 3600
        return True

    @property
    def calibrating(self):
        """Whether a calibration is under way."""
        return self._calibration is not None

    def start_calibration(self):
        """Begins to watch the field; the model then has to be turned level, a full circle.

        Turning it over all other axes too calibrates z as well, which `heading_decideg` does not
        use. Starts afresh when a calibration is under way.
        """
        from firmware.sensors.hard_iron import HardIron

        self._calibration = HardIron()

    def finish_calibration(self):
        """Sets `offset_nt` to what was found and returns it.

        Raises `ValueError`, with what is missing, when the circle was not complete; then the
        calibration goes on, and so does the old offset.
        """
        if self._calibration is None:
            raise ValueError("no calibration is under way: start one")
        self.offset_nt = self._calibration.offset_nt(self.offset_nt[2])
        self._calibration = None
        return self.offset_nt

    def cancel_calibration(self):
        """Ends a calibration and leaves the offset as it is."""
        self._calibration = None

    def describe(self):
        """Returns a line such as "QMC5883L: 123.4 degrees"."""
        name = self.chip
        if name is None:
            return "no magnetometer answers"
        if self.heading_decideg is None:
            return f"{name}: no values"
        text = f"{name}: {self.heading_decideg / 10:.1f} degrees"
        return text + (", calibrating" if self._calibration is not None else "")
