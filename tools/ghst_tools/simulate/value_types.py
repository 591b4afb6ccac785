"""The values of `ghst simulate`'s options that are more than a number."""

from __future__ import annotations

from typing import Any

import click

from ghst import encode  # type: ignore[import-not-found]
from ghst.protocol import RF_MODES  # type: ignore[import-not-found]
from ghst_tools.simulate import msp_client
from ghst_tools.simulate.faults import Loss, Ramp
from ghst_tools.simulate.sticks import CHANNELS

MODES = {name.lower().replace(" ", "-"): number for number, (name, _, _) in RF_MODES.items()}
"""Names of RF modes as the command takes them."""


class _Parsed(click.ParamType):
    """A value that a method `parse` makes of a word; it raises `ValueError` if that cannot be."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value
        try:
            return self.parse(value)
        except ValueError:
            self.fail(f"{value!r} is not {self.wanted}", param, ctx)

    wanted = ""

    def parse(self, word: str) -> Any:
        raise NotImplementedError


class RampType(_Parsed):
    """`VALUE`, or `FROM:TO:SECONDS`."""

    name = "VALUE|FROM:TO:SECONDS"

    def __init__(self, low: int, high: int) -> None:
        self._low, self._high = low, high
        self.wanted = f"{low} to {high}, or FROM:TO:SECONDS with such values"

    def parse(self, word: str) -> Ramp:
        first, *rest = word.split(":")
        if rest:
            last, seconds = rest
            ramp = Ramp(int(first), int(last), float(seconds))
        else:
            ramp = Ramp(int(first), int(first), 0.0)
        if not all(self._low <= value <= self._high for value in ramp[:2]) or not (
            0 <= ramp.seconds < float("inf")
        ):
            raise ValueError
        return ramp


class LossType(_Parsed):
    """`START:SECONDS`."""

    name = "START:SECONDS"
    wanted = "START:SECONDS, such as 5:2"

    def parse(self, word: str) -> Loss:
        start, seconds = word.split(":")
        loss = Loss(float(start), float(seconds))
        if not (loss.start_s >= 0 and loss.seconds > 0):
            raise ValueError
        return loss


class HeldType(_Parsed):
    """`CHANNEL=MICROSECONDS`: a channel number, and a pulse width in quarter microseconds."""

    name = "CHANNEL=US"
    wanted = f"CHANNEL=US, a channel from 1 to {CHANNELS} and 880 to 2160 us"

    def parse(self, word: str) -> tuple[int, int]:
        channel, width_us = word.split("=")
        if not 1 <= int(channel) <= CHANNELS or not 880 <= float(width_us) <= 2160:
            raise ValueError
        return int(channel), round(4 * float(width_us))


class AxesType(_Parsed):
    """Numbers of axes from 1 on, with a minus sign where one is reversed."""

    name = "AXIS,..."
    wanted = "a list of axes such as 1,2,-3,4"

    def parse(self, word: str) -> tuple[int, ...]:
        axes = tuple(int(number) for number in word.split(","))
        if 0 in axes or len(axes) > CHANNELS:
            raise ValueError
        return axes


class MspType(_Parsed):
    """An MSP command."""

    name = "COMMAND"
    wanted = "an MSP command: a number, or a name such as api_version"

    def parse(self, word: str) -> int:
        return msp_client.number(word)


class VtxType(_Parsed):
    """`MHZ:MW`, or `MHZ:MW:BAND_CHANNEL`: frequency, power (0 = off), band and channel."""

    name = "MHZ:MW[:BAND_CHANNEL]"
    wanted = "MHZ:MW[:BAND_CHANNEL], such as 5800:25 or 5800:25:0x48"

    def parse(self, word: str) -> tuple[int, int, int]:
        freq, power, *more = word.split(":")
        (band_channel,) = (int(number, 0) for number in more or ("0",))
        values = int(freq), int(power), band_channel
        encode.vtx_setup(0, *values)
        return values
