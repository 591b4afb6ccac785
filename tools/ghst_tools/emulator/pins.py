"""The pins of the board: what the chip drives, what the host drives, and the level between them.

This is the repair of rp2040py defect 6: it does not feed an output back to the input of the same
pad. Here an input reads the level on the pin, whoever makes it.

rp2040py 0.3.6 also resets its pads with the input buffer off and 12 mA; the RP2040 resets them
with the input buffer on and 4 mA (datasheet, section 2.19.6.3), and MicroPython's `StateMachine`
relies on that.

Pins that a `Jumper` ties are one net: all have the level that any of them makes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from rp2040py.gpio_pin import GPIOPinState

from ghst_tools.emulator.pio import PioBlocks

Cause = Literal["device", "host"]
PadWatcher = Callable[[float, bool | None], None]
LevelWatcher = Callable[[float, bool | None, Cause], None]

_PAD_RESET_RP2040PY = 0x36
_PAD_RESET = 0x56

_DRIVEN = {GPIOPinState.HIGH: True, GPIOPinState.LOW: False}
_PULLED = {GPIOPinState.INPUT_PULL_UP: True, GPIOPinState.INPUT_PULL_DOWN: False}


def _first(wins: bool, levels: list[bool | None]) -> bool | None:
    """The level that wins, if it is there; else the other, if it is."""
    return wins if wins in levels else (not wins) if (not wins) in levels else None


class _Surroundings:
    """What a pin of rp2040py's needs of its chip."""

    def __init__(self, mcu: Any, pio: PioBlocks) -> None:
        self.sio = mcu.sio
        self.pwm = mcu.pwm
        self.pio = pio.by_index
        self.update_io_interrupt = mcu.update_io_interrupt


class Pin:
    """One pin. Levels are True (high), False (low) or None (nobody decides)."""

    def __init__(self, mcu: Any, pio: PioBlocks, number: int) -> None:
        self.number = number
        self._gpio = mcu.gpio[number]
        self._gpio.rp2040 = _Surroundings(mcu, pio)
        self._clock = mcu.clock
        self._pio = pio
        self._state = self._gpio.value
        self._host: bool | None = None
        self._tied: bool | None = None
        self._external_pull: bool | None = None
        self._short: bool | None = None
        self._net: tuple[Pin, ...] = (self,)
        self._driven = False
        self._level: bool | None = None
        self._pad_watchers: tuple[PadWatcher, ...] = ()
        self._level_watchers: tuple[LevelWatcher, ...] = ()
        self._gpio.add_listener(self._pad_changed)
        self._repair_reset()
        self._resolve("device")

    @property
    def level(self) -> bool | None:
        """The level on the pin, pull resistors included."""
        return self._level

    @property
    def device(self) -> bool | None:
        """What the chip drives, on this pin or one in its net; None: its output is off."""
        return _first(False, [pin._pad for pin in self._net])

    @property
    def _pad(self) -> bool | None:
        level = _DRIVEN.get(self._state)
        return self._tied if level is None else level

    @property
    def host(self) -> bool | None:
        """What the host drives; None: released."""
        return self._host

    def drive(self, level: bool | None) -> None:
        """Drive the pin from outside (a push button, a receiver), or release it with None."""
        if level is not self._host:
            self._host = level
            self._resolve("host")

    def tie(self, level: bool | None) -> None:
        """Let another pad of the chip, tied to this pin, drive it, or release it with None."""
        before = self.device
        self._tied = level
        self._device_changed(before)

    def pull(self, level: bool | None) -> None:
        """Put a resistor outside the chip to high or low, or take it away with None."""
        self._external_pull = level
        self._resolve("host")

    def short(self, level: bool | None) -> None:
        """Short the pin to ground (False) or 3.3 V (True), or mend it with None."""
        self._short = level
        self._resolve("host")

    def join(self, net: tuple[Pin, ...]) -> None:
        """Be one net with these pins, this one among them; for `Jumper`."""
        before = self.device
        self._net = net
        self._resolve("device")
        if self.device is not before:
            now = self._clock.nanos
            for watcher in self._pad_watchers:
                watcher(now, self.device)

    def watch(self, watcher: PadWatcher) -> Callable[[], None]:
        """Call `watcher(t_ns, level)` whenever what the chip drives changes.

        Returns a function that ends it. Watchers are called in the order they were added.
        """
        self._pad_watchers += (watcher,)

        def unsubscribe() -> None:
            self._pad_watchers = tuple(w for w in self._pad_watchers if w is not watcher)

        return unsubscribe

    def watch_level(self, watcher: LevelWatcher) -> Callable[[], None]:
        """Call `watcher(t_ns, level, cause)` whenever the level on the pin changes."""
        self._level_watchers += (watcher,)

        def unsubscribe() -> None:
            self._level_watchers = tuple(w for w in self._level_watchers if w is not watcher)

        return unsubscribe

    def refresh(self) -> None:
        """Look at the pad again: a chip reset changes it without telling anybody."""
        self._repair_reset()
        self._pad_changed(self._gpio.value, self._state)

    def _repair_reset(self) -> None:
        if self._gpio.pad_value == _PAD_RESET_RP2040PY:
            self._gpio.pad_value = _PAD_RESET

    def _pad_changed(self, state: Any, _before: Any) -> None:
        before = self.device
        self._state = state
        self._device_changed(before)

    def _device_changed(self, before: bool | None) -> None:
        level = self.device
        self._resolve("device")
        if level is not before:
            now = self._clock.nanos
            for pin in self._net:
                for watcher in pin._pad_watchers:
                    watcher(now, level)

    def _resolve(self, cause: Cause) -> None:
        """Work out the level of the net, and give it to each of its pins."""
        net = self._net
        level = self._decided()
        driven = level is not None
        if level is None:
            level = _first(True, [_PULLED.get(pin._state) for pin in net])
            # rp2040py knows the pull of a pin, not the one at the other end of a jumper.
            driven = level is not None and len(net) > 1
        for pin in net:
            pin._take(level, driven, cause)

    def _decided(self) -> bool | None:
        """What is on the net but for the pulls in the chip."""
        net = self._net
        short = _first(False, [pin._short for pin in net])
        if short is not None:
            return short
        device, host = self.device, _first(False, [pin._host for pin in net])
        if device is None or host is False:
            device = host  # where two drive against each other the one that pulls low wins
        return device if device is not None else _first(True, [pin._external_pull for pin in net])

    def _take(self, level: bool | None, driven: bool, cause: Cause) -> None:
        if level is self._level and driven is self._driven:
            return
        changed = level is not self._level
        self._level, self._driven = level, driven
        self._pio.catch_up()
        if driven:
            self._gpio.set_input_value(level)
        else:
            self._gpio.release_input()
        self._pio.input_changed(self.number)
        if changed:
            now = self._clock.nanos
            for watcher in self._level_watchers:
                watcher(now, level, cause)
