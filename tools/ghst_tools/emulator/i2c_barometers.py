"""Emulated barometers: DPS310, LPS22HB and LPS22HH."""

from __future__ import annotations

from ghst_tools.emulator.i2c_sensors import Barometer, solve


class Dps310(Barometer):
    """Infineon DPS310 (data sheet V1.2): continuous mode of pressure and temperature.

    A measurement may come between two bytes of a value.
    """

    NAME = "DPS310"
    NOISE_PA = 0.35
    # c0, c1, c00, c10, c01, c11, c20, c21, c30 of a chip that somebody published.
    COEFFICIENTS = (223, -291, 80074, -56035, -3145, 1432, -9919, 152, -1321)
    WIDTHS = (12, 12, 20, 20, 16, 16, 16, 16, 16)
    SCALES = (524288, 1572864, 3670016, 7864320, 253952, 516096, 1040384, 2088960)
    SAMPLE_MS = (3.6, 5.2, 8.4, 14.8, 27.6, 53.2, 104.4, 206.8)
    READABLE = frozenset((*range(0x0E), *range(0x10, 0x22), 0x28))
    # The last three only for the repair of the temperature, as in the manufacturer's driver.
    WRITABLE = frozenset((0x06, 0x07, 0x08, 0x09, 0x0C, 0x0E, 0x0F, 0x62))
    FOREIGN = frozenset((0xD0,))

    def reset_registers(self) -> None:
        self._reset_ns = self.now_ns
        self.registers[0x0D] = 0x10
        packed = 0
        for value, width in zip(self.COEFFICIENTS, self.WIDTHS, strict=True):
            packed = packed << width | value & (1 << width) - 1
        self.registers[0x10:0x22] = packed.to_bytes(18, "big")
        self.registers[0x28] = 0x80
        self._due_ns: dict[str, float] = {}
        self._ready = {"pressure": False, "temperature": False}
        self._measured = {"pressure": False, "temperature": False}

    def write_register(self, register: int, value: int) -> None:
        if register == 0x0C:
            if value & 0x0F == 0x09:
                self.power_up()
            return
        if register in (0x06, 0x07) and self._due_ns:
            raise self.misuse(f"register 0x{register:02x} written while measuring")
        self.registers[register] = value
        if register == 0x08 and value & 7:
            self._begin(value & 7)

    def _begin(self, mode: int) -> None:
        pressure, temperature = self.registers[0x06], self.registers[0x07]
        if mode != 7:
            raise self.misuse(f"mode {mode} is not emulated")
        if self.now_ns < self._reset_ns + 12e6:
            raise self.misuse("a measurement before the sensor is ready")
        if temperature & 0x80 != self.registers[0x28] & 0x80:
            raise self.misuse("the temperature of the element the coefficients are not for")
        if (pressure & 15 > 3) != bool(self.registers[0x09] & 4):
            raise self.misuse("the shift of the pressure does not fit the oversampling")
        busy_ms = sum((1 << (c >> 4 & 7)) * self.SAMPLE_MS[c & 7] for c in (pressure, temperature))
        if busy_ms > 1000:
            raise self.misuse(f"measurements of {busy_ms:.0f} ms in a second")
        self._due_ns = {
            "pressure": self.now_ns + self._period_ns(pressure),
            "temperature": self.now_ns + self._period_ns(temperature) / 8,
        }

    @staticmethod
    def _period_ns(configuration: int) -> float:
        return float(1e9 / (1 << (configuration >> 4 & 7)))

    def read_register(self, register: int) -> int:
        self._measure()
        if register == 0x08:
            since_ns = self.now_ns - self._reset_ns
            return (
                self.registers[0x08] & 7
                | (since_ns >= 40e6) << 7
                | (since_ns >= 12e6) << 6
                | self._ready["temperature"] << 5
                | self._ready["pressure"] << 4
            )
        if 0x10 <= register < 0x29 and self.now_ns < self._reset_ns + 40e6:
            raise self.misuse("the coefficients were not ready")
        if register < 6:
            quantity = "pressure" if register < 3 else "temperature"
            if not self._measured[quantity]:
                raise self.misuse(f"there was no {quantity} yet")
            self._ready[quantity] = False
        return self.registers[register]

    def _measure(self) -> None:
        for quantity, place in (("temperature", 0x07), ("pressure", 0x06)):
            period_ns = self._period_ns(self.registers[place])
            while self._due_ns and self.now_ns >= self._due_ns[quantity]:
                if not self.frozen:
                    self._latch(quantity, self._due_ns[quantity])
                self._ready[quantity] = self._measured[quantity] = True
                self._due_ns[quantity] += period_ns

    def _latch(self, quantity: str, t_ns: float) -> None:
        pressure, temperature = self.air(t_ns)
        c0, c1 = self.COEFFICIENTS[:2]
        scaled = (temperature - c0 / 2) / c1
        at, raw = 3, round(scaled * self.SCALES[self.registers[0x07] & 7])
        if quantity == "pressure":
            scale = self.SCALES[self.registers[0x06] & 7]
            at = 0
            raw = solve(
                lambda raw: self.compensated(raw / scale, scaled), pressure, -1 << 23, 1 << 23
            )
        self.registers[at : at + 3] = (raw & 0xFFFFFF).to_bytes(3, "big")

    def compensated(self, pressure: float, temperature: float) -> float:
        """Return the pressure in Pa for scaled raw values (section 4.9.1)."""
        _, _, c00, c10, c01, c11, c20, c21, c30 = self.COEFFICIENTS
        return (
            c00
            + pressure * (c10 + pressure * (c20 + pressure * c30))
            + temperature * (c01 + pressure * (c11 + pressure * c21))
        )


class Lps22hb(Barometer):
    """ST LPS22HB (data sheet DocID027083): continuous mode without FIFO."""

    NAME = "LPS22HB"
    ID = 0xB1
    NOISE_PA = 0.75
    RATES_HZ: tuple[int, ...] = (0, 1, 10, 25, 50, 75)
    CTRL_REG2 = 0x10
    ALLOWED_2 = 0xFD  # bits of CTRL_REG2 that are no zeros
    READABLE = frozenset((*range(0x0B, 0x10), *range(0x10, 0x1B), *range(0x25, 0x2D), 0x33))
    WRITABLE = frozenset((0x0B, 0x0C, 0x0D, *range(0x10, 0x1B)))

    def reset_registers(self) -> None:
        self.registers[0x0F] = self.ID
        self.registers[0x11] = self.CTRL_REG2
        self._due_ns: float | None = None
        self._status = 0
        self._measured = False
        self._held = False

    def next_register(self, register: int) -> int:
        return register + bool(self.registers[0x11] & 0x10) & 0xFF

    def write_register(self, register: int, value: int) -> None:
        if register == 0x11:
            if value & ~self.ALLOWED_2:
                raise self.misuse(f"CTRL_REG2 is 0x{value:02x}")
            if value & 0x04:
                self.power_up()
                return
            if self._due_ns is not None and (value ^ self.registers[0x11]) & 0x02:
                raise self.misuse("low noise chosen while measuring")
        self.registers[register] = value
        if register == 0x10:
            rate = value >> 4 & 7
            if value & 0x80 or rate >= len(self.RATES_HZ):
                raise self.misuse(f"CTRL_REG1 is 0x{value:02x}")
            self._due_ns = self.now_ns + 1e9 / self.RATES_HZ[rate] if rate else None

    def read_register(self, register: int) -> int:
        self._measure()
        if register == 0x27:
            return self._status
        if 0x28 <= register < 0x2D:
            if not self._measured:
                raise self.misuse("there was no measurement yet")
            # Bit BDU of CTRL_REG1: all stay until the highest byte of the pressure has been read.
            self._held = bool(self.registers[0x10] & 0x02) and register != 0x2A
            if register == 0x2A:
                self._status &= ~0x11
            if register == 0x2C:
                self._status &= ~0x22
        return self.registers[register]

    def _measure(self) -> None:
        while self._due_ns is not None and self.now_ns >= self._due_ns:
            if not self.frozen and not self._held:
                pressure, temperature = self.air(self._due_ns)
                raw = round(pressure * 40.96) & 0xFFFFFF
                self.registers[0x28:0x2B] = raw.to_bytes(3, "little")
                warmth = round(temperature * 100) & 0xFFFF
                self.registers[0x2B:0x2D] = warmth.to_bytes(2, "little")
            self._status |= 0x03 | (self._status & 0x03) << 4
            self._measured = True
            self._due_ns += 1e9 / self.RATES_HZ[self.registers[0x10] >> 4 & 7]


class Lps22hh(Lps22hb):
    """ST LPS22HH (data sheet DocID030890)."""

    NAME = "LPS22HH"
    ID = 0xB3
    NOISE_PA = 0.65
    RATES_HZ = (0, 1, 10, 25, 50, 75, 100, 200)
    ALLOWED_2 = 0xF7
