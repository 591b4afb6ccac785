"""What the campaign is made of: areas, and the trials of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from ghst_tools.campaign import (
    application_bytes,
    configuration_files,
    cpu,
    flight,
    library_bytes,
    line,
    mutation,
    power,
    serial_bytes,
    starts,
    timing,
    wire_bytes,
)
from ghst_tools.campaign.setting import Setting
from ghst_tools.campaign.verdict import Trial


def _bytes(setting: Setting) -> Iterator[tuple[str, Trial]]:
    effort, seed = setting.effort, setting.seed
    for name, paused in (("library", True), ("library, no pause", False)):
        yield name, partial(library_bytes.fuzz, seed, effort.library_bytes, paused)
    yield "wire", lambda: wire_bytes.fuzz(setting.picos, seed, effort.wire_bytes)
    yield (
        "firmware",
        lambda: application_bytes.fuzz(setting.picos, seed, effort.application_bytes),
    )


@dataclass(frozen=True)
class Area:
    """A part of the campaign: its heading, and its trials by name."""

    title: str
    trials: Callable[[Setting], Iterator[tuple[str, Trial]]]
    unix_port: bool = False
    """Whether MicroPython's unix port takes part."""


AREAS = {
    "bytes": Area("Bytes", _bytes, unix_port=True),
    "line": Area("Line", line.trials),
    "time": Area("Time", timing.trials),
    "cpu": Area("CPU", cpu.trials),
    "power": Area("Power", power.trials),
    "files": Area("Files", configuration_files.trials, unix_port=True),
    "starts": Area("Starts", starts.trials, unix_port=True),
    "serial": Area("Serial", serial_bytes.trials, unix_port=True),
    "flight": Area("Flight", flight.trials),
    "mutation": Area("Mutations", mutation.trials),
}
