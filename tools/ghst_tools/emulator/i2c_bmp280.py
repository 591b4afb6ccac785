"""Emulated barometers: BMP280 and BME280."""

from __future__ import annotations

from ghst_tools.emulator.i2c_sensors import Barometer, solve


class Bmp280(Barometer):
    """Bosch BMP280 (data sheet BST-BMP280-DS001): forced mode only."""

    NAME = "BMP280"
    ID = 0x58
    START_UP_NS = 2e6
    # T1, T2, T3 and P1 to P9 of the worked example in section 3.12.
    CALIBRATION = (27504, 26435, -1000, 36477, -10685, 3024, 2855, 140, -7, 15500, -14600, 6000)
    READABLE = frozenset((*range(0x88, 0xA0), 0xD0, *range(0xF3, 0xF6), *range(0xF7, 0xFD)))
    WRITABLE = frozenset((0xE0, 0xF4, 0xF5))
    FOREIGN = frozenset((0x0D,))

    def reset_registers(self) -> None:
        self.registers[0xD0] = self.ID
        for place, value in enumerate(self.CALIBRATION):
            at = 0x88 + 2 * place
            self.registers[at : at + 2] = (value & 0xFFFF).to_bytes(2, "little")
        self.registers[0xF7:0xFD] = b"\x80\x00\x00\x80\x00\x00"
        self._started_ns = self._ends_ns = 0.0
        self._measuring = self._measured = False

    def write(self, value: int) -> bool:
        # Several registers are written as pairs of a number and a value (section 5.2.1).
        pair_complete = self._pointer is not None
        acknowledged = super().write(value)
        if pair_complete:
            self._pointer = None
        return acknowledged

    def write_register(self, register: int, value: int) -> None:
        if register == 0xE0:
            if value == 0xB6:
                self.power_up()
            return
        self._finish()
        if self._measuring:
            raise self.misuse(f"register 0x{register:02x} written during a measurement")
        self.registers[register] = value
        if register == 0xF4 and value & 3:
            if value & 3 == 3:
                raise self.misuse("normal mode is not emulated")
            if not value >> 5 or not value >> 2 & 7:
                raise self.misuse("a measurement without pressure or temperature")
            self._started_ns = self.now_ns
            # Typical time of section 3.8.1.
            samples = (1 << (value >> 5) - 1) + (1 << (value >> 2 & 7) - 1)
            self._ends_ns = self.now_ns + (1 + 2 * samples + 0.5) * 1e6
            self._measuring = True

    def read_register(self, register: int) -> int:
        self._finish()
        if register == 0xF3:
            return 8 if self._measuring else 0
        if register >= 0xF7 and not self._measured:
            raise self.misuse("there was no measurement yet")
        return self.registers[register]

    def _finish(self) -> None:
        if not self._measuring or self.now_ns < self._ends_ns:
            return
        self._measuring, self._measured = False, True
        control = self.registers[0xF4]
        self.registers[0xF4] = control & ~3
        if self.frozen:
            return
        pressure, temperature = self.air((self._started_ns + self._ends_ns) / 2)
        raw_temperature = solve(
            lambda raw: self.fine_temperature(raw) / 5120, temperature, 0, 0xFFFFF
        )
        fine = self.fine_temperature(raw_temperature)
        raw_pressure = solve(lambda raw: self.compensated(raw, fine), pressure, 0, 0xFFFFF)
        # 16 bits with one sample, one more with each doubling (section 3.3.1).
        for at, raw, oversampling in (
            (0xF7, raw_pressure, control >> 2 & 7),
            (0xFA, raw_temperature, control >> 5),
        ):
            unused = max(0, 5 - oversampling)
            word = (raw >> unused << unused) << 4
            self.registers[at : at + 3] = word.to_bytes(3, "big")

    def fine_temperature(self, raw: int) -> float:
        """Return t_fine, as the floating point formula of section 8.1 has it."""
        t1, t2, t3 = self.CALIBRATION[:3]
        return (raw / 16384 - t1 / 1024) * t2 + (raw / 131072 - t1 / 8192) ** 2 * t3

    def compensated(self, raw: int, fine: float) -> float:
        """Return the pressure in Pa, as the floating point formula of section 8.1 has it."""
        p1, p2, p3, p4, p5, p6, p7, p8, p9 = self.CALIBRATION[3:]
        var1 = fine / 2 - 64000
        var2 = (var1 * var1 * p6 / 32768 + var1 * p5 * 2) / 4 + p4 * 65536
        var1 = (1 + (p3 * var1 * var1 / 524288 + p2 * var1) / 524288 / 32768) * p1
        pressure = (1048576 - raw - var2 / 4096) * 6250 / var1
        return pressure + (p9 * pressure**2 / 2147483648 + pressure * p8 / 32768 + p7) / 16


class Bme280(Bmp280):
    """Bosch BME280: a BMP280 with humidity, which is not emulated."""

    NAME = "BME280"
    ID = 0x60
    READABLE = Bmp280.READABLE | {0xA1, 0xF2, *range(0xE1, 0xE8)}
    WRITABLE = Bmp280.WRITABLE | {0xF2}
