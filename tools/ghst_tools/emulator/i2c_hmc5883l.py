"""Emulated magnetometer: HMC5883L."""

from __future__ import annotations

import math

from ghst_tools.emulator.i2c_magnetometers import Magnetometer


class Hmc5883l(Magnetometer):
    """Honeywell HMC5883L (data sheet 900405).

    A measurement is written word by word while RDY is low. What would be written while the
    registers are locked (section "Status Register") is lost: then they have words of two.
    """

    NAME = "HMC5883L"
    READABLE = frozenset(range(0x0D))
    WRITABLE = frozenset((0x00, 0x01, 0x02))
    FOREIGN = frozenset((0x0F,))
    RATES_HZ = (0.75, 1.5, 3, 7.5, 15, 30, 75)
    LSB_PER_GAUSS = (1370, 1090, 820, 660, 440, 390, 330, 230)
    # 6 ms of an average over one; eight fit into a period of the highest rate.
    SINGLE_NS = 1e9 / 75
    WRITING_NS = 250e3

    _DATA = frozenset(range(0x03, 0x09))

    def reset_registers(self) -> None:
        super().reset_registers()
        self.registers[0x00:0x03] = b"\x10\x20\x01"
        self.registers[0x0A:0x0D] = b"H43"
        self._gain = 1
        self._writing: list[tuple[float, int, bytes]] = []
        self._written_ns = 0.0
        self._unlock()

    def _unlock(self) -> None:
        self._lock = False
        self._unread = self._DATA

    def measure(self) -> None:
        super().measure()
        self._write_until(self.now_ns)

    def _write_until(self, t_ns: float) -> None:
        while self._writing and self._writing[0][0] <= t_ns:
            _, register, word = self._writing.pop(0)
            if not self._lock:
                self.registers[register : register + 2] = word

    def write_register(self, register: int, value: int) -> None:
        self.measure()
        self.registers[register] = value
        rate = self.registers[0x00] >> 2 & 7
        if value & 0x80 or rate == 7 or (register == 0x01 and value & 0x1F):
            raise self.misuse(f"register {register} is 0x{value:02x}")
        mode = self.registers[0x02] & 3
        if register != 0x01:
            self._unlock()
        if register == 0x02 and mode == 1:
            self._due_ns, self._period_ns = self.now_ns + self.SINGLE_NS, math.inf
        elif mode == 0:
            self.run_at(self.RATES_HZ[rate])
        elif mode > 1:
            self.run_at(None)

    def next_register(self, register: int) -> int:
        # Behind the last data register comes the first one (section "I2C communication").
        return 0x03 if register == 0x08 else register + 1

    def read_register(self, register: int) -> int:
        self.measure()
        if register == 0x09:
            return self._lock << 1 | (self._measured and self.now_ns >= self._written_ns)
        if register == 0x02:
            self._lock = True
        elif register in self._DATA:
            self.need_measurement()
            self._lock = True
            self._unread = self._unread - {register}
            if not self._unread:
                self._unlock()
        return self.registers[register]

    def latch(self, field_nt: list[float]) -> None:
        begun_ns = self._due_ns or 0.0
        self._write_until(begun_ns)
        self._written_ns = begun_ns + self.WRITING_NS
        x, y, z = field_nt
        for place, part in enumerate((x, z, y)):
            raw = round(part * self.LSB_PER_GAUSS[self._gain] / 100_000)
            raw = raw if -2048 <= raw <= 2047 else -4096
            word = (raw & 0xFFFF).to_bytes(2, "big")
            t_ns = begun_ns + self.WRITING_NS * (place + 1) / 3
            self._writing.append((t_ns, 0x03 + 2 * place, word))

    def ready(self) -> None:
        # A new gain is that of the second measurement (section "Configuration Register B").
        self._gain = self.registers[0x01] >> 5
        if self.registers[0x02] & 3 == 1:
            self.registers[0x02] |= 2
