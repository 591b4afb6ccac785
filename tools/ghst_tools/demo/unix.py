"""The demo without a board: `ghst.Receiver` on MicroPython's unix port, fed with the same frames.

It shows that the library decodes; there are no pins, no interrupts and no failsafe clock here.
"""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

from ghst_tools import boards
from ghst_tools.demo.flight import CHANNELS, RATE_HZ, Flight, pulses_in
from ghst_tools.demo.report import Report, Row, Snapshot, Span, Trace, View
from ghst_tools.errors import GhstError

_SHOW_EVERY = 5  # frames: as often as on the emulated board
_CUT_BYTES = 7

_PROGRAM = """
import sys
from binascii import unhexlify
from ghst import Receiver
receiver = Receiver()
print(*sys.implementation.version[:3], sep=".")
for line in sys.stdin:
    receiver.feed(unhexlify(line.strip()))
    print(receiver.frames, receiver.crc_errors, receiver.lq, receiver.rssi_dbm, *receiver.pulses)
"""


@dataclass(frozen=True)
class _Answer:
    """What `Receiver` knows after some bytes."""

    frames: int
    crc_errors: int
    lq: int
    rssi_dbm: int
    pulses: tuple[int, ...]


class _UnixReceiver:
    """A `ghst.Receiver` in a process of MicroPython's unix port."""

    def __init__(self, program: Path) -> None:
        self._process = subprocess.Popen(
            [program, "-c", _PROGRAM],
            env={"MICROPYPATH": f"{boards.checkout() / 'lib'}:.frozen"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.version = self._read()

    def feed(self, data: bytes) -> _Answer:
        """Let it take `data`, then ask."""
        assert self._process.stdin is not None
        self._process.stdin.write(data.hex() + "\n")
        self._process.stdin.flush()
        frames, crc_errors, lq, rssi_dbm, *pulses = map(int, self._read().split())
        return _Answer(frames, crc_errors, lq, rssi_dbm, tuple(pulses))

    def close(self) -> None:
        """End the process."""
        self._process.communicate()

    def _read(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            _, errors = self._process.communicate()
            raise GhstError(
                f"MicroPython's unix port ended: {errors.strip().splitlines()[-1:] or 'silent'}"
            )
        return line.strip()


class UnixFlight:
    """The flight's frames, one by one, through the unix port; all 16 channels looked at each time.

    The cut frame comes in half, right before the first frame of the leg after it.
    """

    def __init__(self, flight: Flight, program: Path, view: View) -> None:
        self._flight = flight
        self._program = program
        self._view = view
        self._total = sum(len(leg.frames) for leg in flight.legs)
        self._fed = 0
        self._answer = _Answer(0, 0, 0, 0, (0,) * CHANNELS)
        self._expected = [0] * CHANNELS
        self._sent: list[list[tuple[float, float]]] = [[] for _ in range(CHANNELS)]
        self._decoded: list[list[tuple[float, float]]] = [[] for _ in range(CHANNELS)]
        self._spans: list[Span] = []
        self._right = 0
        self._wrong: list[str] = []

    def run(self) -> Report:
        """Feed everything, compare after each frame, and tell how it went."""
        receiver = _UnixReceiver(self._program)
        try:
            for leg in self._flight.legs:
                start = self._fed
                for frame in leg.frames:
                    first_after_cut = leg is self._flight.after and self._fed == start
                    rest = self._flight.cut[:_CUT_BYTES] if first_after_cut else b""
                    self._answer = receiver.feed(rest + frame)
                    self._compare(frame)
                    if self._fed % _SHOW_EVERY == 0:
                        self._show(leg.name)
                self._show(leg.name)
                self._spans.append(Span(leg.name, start / RATE_HZ, self._fed / RATE_HZ))
        finally:
            receiver.close()
        return self._report(receiver.version)

    def _compare(self, frame: bytes) -> None:
        self._fed += 1
        for channel, pulse in pulses_in(frame).items():
            self._expected[channel - 1] = pulse
        for index, (sent, decoded) in enumerate(
            zip(self._expected, self._answer.pulses, strict=True)
        ):
            self._sent[index].append((self._fed / RATE_HZ, sent / 4))
            self._decoded[index].append((self._fed / RATE_HZ, decoded / 4))
            if sent == decoded:
                self._right += 1
            else:
                self._wrong.append(
                    f"frame {self._fed}: channel {index + 1} is {decoded / 4} us, "
                    f"sent was {sent / 4} us"
                )

    def _show(self, phase: str) -> None:
        answer = self._answer
        self._view.show(
            Snapshot(
                phase=phase,
                progress=self._fed / self._total,
                emulated_s=None,
                link="no clock",
                lq=answer.lq,
                rssi_dbm=answer.rssi_dbm,
                frames_sent=self._fed,
                frames_decoded=answer.frames,
                crc_errors=answer.crc_errors,
                right=self._right,
                wrong=len(self._wrong),
                rows=tuple(
                    Row("", index + 1, sent / 4, decoded / 4 or None, (decoded - sent) / 4)
                    for index, (sent, decoded) in enumerate(
                        zip(self._expected, answer.pulses, strict=True)
                    )
                ),
                console=(),
            )
        )

    def _report(self, micropython: str) -> Report:
        report = Report("MicroPython's unix port, no board", "decoded by ghst.Receiver")
        report.lines = [
            ("frames sent", f"{self._fed}, and one cut off in its middle"),
            (
                "frames decoded",
                f"{self._answer.frames}, CRC errors {self._answer.crc_errors}",
            ),
            ("channel values compared", f"{self._right + len(self._wrong)}"),
            ("channel values wrong", f"{len(self._wrong)}"),
            (
                "with",
                f"MicroPython {micropython} (unix), micropython-ghst "
                f"{version('micropython-ghst')}; {date.today()}",
            ),
            ("NOT measured", "no pins, no latency, no failsafe: they need a MicroPython image"),
        ]
        report.failures = list(self._wrong)
        if self._answer.frames != self._fed:
            report.failures.insert(
                0, f"{self._fed} frames were sent, {self._answer.frames} were decoded"
            )
        report.spans = self._spans
        report.traces = [
            Trace(
                "",
                index + 1,
                self._sent[index],
                self._decoded[index],
                [
                    (t_s, decoded - sent)
                    for (t_s, sent), (_, decoded) in zip(
                        self._sent[index], self._decoded[index], strict=True
                    )
                ],
            )
            for index in range(CHANNELS)
        ]
        return report
