"""Sticks of a joystick, or of a radio that is one over USB."""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ghst_tools.control_frames import CENTRE
from ghst_tools.errors import GhstError
from ghst_tools.simulate.sticks import CHANNELS, HIGHEST_US, LOWEST_US, Pulses, at_rest

EXTRA = "pip install 'micropython-ghst[joystick]'"

_HALF = 2 * (HIGHEST_US - LOWEST_US)
_FULL = 32767
# Linux's joystick interface: time in ms u32, value s16, type u8, number u8; the type of what is
# told at the beginning has bit 7 set.
_EVENT = struct.Struct("<IhBB")
_BUTTON, _AXIS, _INITIAL = 0x01, 0x02, 0x80

State = tuple[dict[int, float], dict[int, bool]]
"""Axes and buttons by their numbers from 0 on: -1.0 to 1.0, and whether one is pressed."""


class Joystick:
    """Axes and buttons as channels: axes first, in the order of `axes`, buttons behind them.

    `axes`: numbers of axes from 1 on, negative where the direction is reversed; empty: as they are
    numbered. An axis that has not told anything yet is a channel at rest. `read` gives the axes,
    -1.0 to 1.0, and the buttons.
    """

    end_s: float | None = None

    def __init__(self, read: Callable[[], State], axes: Sequence[int] = ()) -> None:
        self._read = read
        self._axes = axes
        self._pulses = at_rest()
        self.poll()

    def pulses(self, t_s: float) -> Pulses:
        """As `Sticks.pulses`."""
        return list(self._pulses)

    def poll(self) -> None:
        """Look at it, in the main thread: macOS tells no other. `GhstError`: it was unplugged."""
        values, buttons = self._read()
        pulses = at_rest()
        order = self._axes or [number + 1 for number in range(max(values, default=-1) + 1)]
        for index, axis in enumerate(order[:CHANNELS]):
            value = values.get(abs(axis) - 1)
            if value is not None:
                pulses[index] = CENTRE + round(_HALF * (value if axis > 0 else -value))
        for number, down in buttons.items():
            if len(order) + number < CHANNELS:
                pulses[len(order) + number] = CENTRE + (_HALF if down else -_HALF)
        self._pulses = pulses


class LinuxJoystick:
    """Reads /dev/input/js0 or another, without any package."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except PermissionError as error:
            raise GhstError(f"{path}: no permission: add yourself to the group input") from error
        except OSError as error:
            raise GhstError(f"{path}: {error.strerror}: is the joystick plugged in?") from error
        self._axes: dict[int, float] = {}
        self._buttons: dict[int, bool] = {}
        self._rest = b""

    def read(self) -> State:
        """The axes and buttons as they are now. `GhstError` if it was unplugged."""
        while True:
            try:
                data = os.read(self._descriptor, 64 * _EVENT.size)
            except BlockingIOError:
                return self._axes, self._buttons
            except OSError as error:
                raise GhstError(f"{self.path}: gone (unplugged?)") from error
            if not data:
                raise GhstError(f"{self.path}: gone (unplugged?)")
            data = self._rest + data
            whole = len(data) - len(data) % _EVENT.size
            self._rest = data[whole:]
            for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
                if kind & ~_INITIAL == _AXIS:
                    self._axes[number] = max(-1.0, value / _FULL)
                elif kind & ~_INITIAL == _BUTTON:
                    self._buttons[number] = bool(value)


class SdlJoystick:
    """Reads a joystick through pygame, which is needed on macOS and Windows."""

    def __init__(self, number: int) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame  # type: ignore[import-not-found]
        except ImportError as error:
            raise GhstError(f"a joystick needs pygame here: {EXTRA}") from error
        # Its events need no window, and no window can have the focus.
        os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
        os.environ.setdefault("SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS", "1")
        pygame.display.init()
        pygame.joystick.init()
        count = pygame.joystick.get_count()
        if number >= count:
            known = f"there are {count}, from 0 on" if count else "there is none"
            raise GhstError(f"joystick {number}: {known}: is it plugged in?")
        self._pygame: Any = pygame
        self._number = number
        self._stick: Any = pygame.joystick.Joystick(number)

    def read(self) -> State:
        """The axes and buttons as they are now. `GhstError` if it was unplugged."""
        for event in self._pygame.event.get():
            if event.type == self._pygame.JOYDEVICEREMOVED:
                raise GhstError(f"joystick {self._number}: gone (unplugged?)")
        stick = self._stick
        axes = {index: stick.get_axis(index) for index in range(stick.get_numaxes())}
        buttons = {index: bool(stick.get_button(index)) for index in range(stick.get_numbuttons())}
        return axes, buttons


def open_joystick(name: str, axes: Sequence[int] = ()) -> Joystick:
    """A joystick by its number, or on Linux by its path. `GhstError` if it cannot be had."""
    if not name.isdecimal():
        return Joystick(LinuxJoystick(Path(name)).read, axes)
    if sys.platform == "linux":
        return Joystick(LinuxJoystick(Path(f"/dev/input/js{name}")).read, axes)
    return Joystick(SdlJoystick(int(name)).read, axes)
