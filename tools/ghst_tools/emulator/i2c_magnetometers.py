"""Emulated magnetometers: QMC5883L and LIS3MDL."""

from __future__ import annotations

from ghst_tools.emulator.i2c_sensors import Clock, RegisterTarget, Vector


class Magnetometer(RegisterTarget):
    """A chip in a field, in nanotesla along its own axes, that measures at a fixed rate."""

    NOISE_NT = 200.0

    def __init__(self, clock: Clock, field_nt: Vector) -> None:
        self.field_nt = field_nt
        self.noise_nt = self.NOISE_NT
        self._due_ns: float | None = None
        self._period_ns = 0.0
        super().__init__(clock)

    def reset_registers(self) -> None:
        self._due_ns = None
        self._measured = False

    def run_at(self, rate_hz: float | None) -> None:
        """Measure `rate_hz` times a second from now on, or stop."""
        self._period_ns = 1e9 / rate_hz if rate_hz else 0.0
        self._due_ns = self.now_ns + self._period_ns if rate_hz else None

    def measure(self) -> None:
        """Make up for the measurements that are due."""
        while self._due_ns is not None and self.now_ns >= self._due_ns:
            if not self.frozen:
                x, y, z = self.field_nt(self._due_ns)
                self.measurements += 1
                self.latch([part + self.noise(self.noise_nt) for part in (x, y, z)])
            self._measured = True
            self._due_ns += self._period_ns
            self.ready()

    def locked(self) -> frozenset[int]:
        """The data registers that keep what they have while they are being read."""
        return frozenset()

    def latch(self, field_nt: list[float]) -> None:
        """Put a measurement into the data registers."""

    def put(self, register: int, word: bytes) -> None:
        """Put two bytes into data registers that are not locked."""
        if not self.locked() & {register, register + 1}:
            self.registers[register : register + 2] = word

    def ready(self) -> None:
        """Say that there is a measurement."""

    def need_measurement(self) -> None:
        """Raise `SensorMisuse` when there is none yet."""
        if not self._measured:
            raise self.misuse("there was no measurement yet")


class Qmc5883l(Magnetometer):
    """QST QMC5883L (data sheet 1.0): a measurement may come between two bytes of a word."""

    NAME = "QMC5883L"
    START_UP_NS = 350e3
    READABLE = frozenset((*range(0x00, 0x0C), 0x0D))
    WRITABLE = frozenset((0x09, 0x0A, 0x0B))
    RATES_HZ = (10, 50, 100, 200)
    LSB_PER_GAUSS = (12000, 3000)

    def reset_registers(self) -> None:
        super().reset_registers()
        self.registers[0x0D] = 0xFF

    def write_register(self, register: int, value: int) -> None:
        if register == 0x0A and value & 0x80:
            self.power_up()
            return
        if register == 0x09:
            if value >> 4 & 3 > 1 or value & 3 > 1:
                raise self.misuse(f"control register 1 is 0x{value:02x}")
            if value & 1 and self.registers[0x0B] != 1:
                raise self.misuse("measuring without the recommended set/reset period")
            self.run_at(self.RATES_HZ[value >> 2 & 3] if value & 1 else None)
        self.registers[register] = value

    def read_register(self, register: int) -> int:
        self.measure()
        if register < 6:
            self.need_measurement()
            self.registers[0x06] &= ~0x05
        return self.registers[register]

    def latch(self, field_nt: list[float]) -> None:
        overflow = False
        for axis, part in enumerate(field_nt):
            raw = round(part * self.LSB_PER_GAUSS[self.registers[0x09] >> 4 & 1] / 100_000)
            overflow |= not -32768 <= raw <= 32767
            raw = max(-32768, min(32767, raw)) & 0xFFFF
            self.put(2 * axis, raw.to_bytes(2, "little"))
        self.registers[0x06] = self.registers[0x06] & ~0x02 | overflow << 1

    def ready(self) -> None:
        # Data that nobody read is skipped over (DOR).
        self.registers[0x06] |= 0x05 if self.registers[0x06] & 1 else 0x01


class Lis3mdl(Magnetometer):
    """ST LIS3MDL (data sheet DocID024204): continuous mode."""

    NAME = "LIS3MDL"
    NOISE_NT = 350.0
    READABLE = frozenset((0x0F, *range(0x20, 0x25), *range(0x27, 0x34)))
    WRITABLE = frozenset((*range(0x20, 0x25), 0x30, 0x32, 0x33))
    FOREIGN = frozenset((0x0A, 0x0B, 0x0C))
    RATES_HZ = (0.625, 1.25, 2.5, 5, 10, 20, 40, 80)
    LSB_PER_GAUSS = (6842, 3421, 2281, 1711)

    def reset_registers(self) -> None:
        super().reset_registers()
        self._increment = False
        self._half_read: frozenset[int] = frozenset()
        self.registers[0x0F] = 0x3D
        self.registers[0x20:0x23] = b"\x10\x00\x03"

    def start(self, read: bool) -> bool:
        if not read:
            self._increment = False
        return super().start(read)

    def write(self, value: int) -> bool:
        if self._pointer is None and self.garbage is None:
            self._increment = bool(value & 0x80)
            value &= 0x7F
        return super().write(value)

    def next_register(self, register: int) -> int:
        return register + self._increment

    def write_register(self, register: int, value: int) -> None:
        if register == 0x21 and value & 0x04:
            self.power_up()
            return
        self.registers[register] = value
        if register in (0x20, 0x22):
            rate = self.RATES_HZ[self.registers[0x20] >> 2 & 7]
            mode = self.registers[0x22] & 3
            if mode == 1:
                raise self.misuse("single measurements are not emulated")
            self.run_at(None if mode else rate)

    def read_register(self, register: int) -> int:
        self.measure()
        if 0x28 <= register < 0x2E:
            self.need_measurement()
            # Bit BDU of CTRL_REG5: a word stays until both of its bytes have been read.
            if self.registers[0x24] & 0x40:
                self._half_read ^= {register & ~1}
            if register == 0x2D:
                self.registers[0x27] = 0
        return self.registers[register]

    def locked(self) -> frozenset[int]:
        return self._half_read

    def latch(self, field_nt: list[float]) -> None:
        sensitivity = self.LSB_PER_GAUSS[self.registers[0x21] >> 5 & 3]
        for axis, part in enumerate(field_nt):
            raw = max(-32768, min(32767, round(part * sensitivity / 100_000))) & 0xFFFF
            self.put(0x28 + 2 * axis, raw.to_bytes(2, "little"))

    def ready(self) -> None:
        self.registers[0x27] |= 0xFF if self.registers[0x27] & 0x08 else 0x0F
