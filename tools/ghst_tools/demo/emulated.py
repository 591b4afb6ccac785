"""The demo on the emulated Pico: flies, cuts the link, brings it back, judges every pulse."""

from __future__ import annotations

import json
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from ghst_tools import boards
from ghst_tools.demo.aircraft import Aircraft, Devices
from ghst_tools.demo.flight import RATE_HZ, Flight, pulses_in
from ghst_tools.demo.judge import FAILSAFE_SLACK_MS, PERIOD_NS, Demand, Judge
from ghst_tools.demo.probes import CompareWrites, ConsoleLog, decoder_state
from ghst_tools.demo.radio import Radio
from ghst_tools.demo.report import Row, Snapshot, Span, View
from ghst_tools.emulator import Board, GhostReceiver, PulseMeter, VcdRecorder, Wire
from ghst_tools.errors import GhstError

_SLICE_NS = 20e6
_SLOT_NS = 1e9 / RATE_HZ
_QUIET_NS = 3.0 * PERIOD_NS  # from the firmware's start to the first frame
_BOOT_LIMIT_NS = 3e9
_LEAD_NS = 1e6
_AFTER_FAILSAFE_MS = 300
_CUT_BITS = 67.5  # the link dies inside the seventh byte
_LAST_LOOK_NS = PERIOD_NS + 5e6  # for the pulses that show the last frame
_DEFAULT_FAILSAFE_MS = 500
# From the firmware's start: the barometer takes the first second for its zero.
_ON_THE_GROUND_NS = 1.2e9


@dataclass
class Times:
    """Milestones of a flight, nanoseconds since power-on."""

    searching: float = 0.0
    """The firmware runs."""
    lost: float = 0.0
    """The last stop bit before the link was cut."""
    again: float = 0.0
    """The link is back."""


class EmulatedFlight:
    """One flight on an emulated board, from power-on to the last pulse.

    The firmware is what `filesystem` holds; which pins are looked at is what `definition` says.
    """

    def __init__(
        self, flight: Flight, image: Path, filesystem: Path, definition: boards.Board, view: View
    ) -> None:
        self.values = values = json.loads(definition.definition)
        defaults = values["defaults"]
        self.servos = {int(pin): point["channel"] for pin, point in defaults["outputs"].items()}
        self.failsafe_ms: int = defaults.get("failsafe", {}).get("time_ms", _DEFAULT_FAILSAFE_MS)
        failsafe = {
            int(pin): point["failsafe"]
            for pin, point in defaults["outputs"].items()
            if "failsafe" in point
        }
        self.board = Board(image, filesystem)
        self.aircraft = Aircraft()
        self.devices = Devices(self.board, self.aircraft, defaults)
        self.radio = Radio()
        wire = Wire(self.board, defaults["wire"]["pin"])
        self.meter = PulseMeter(self.board, self.servos)
        self.recorder = VcdRecorder(
            self.board, {f"GP{pin}_ch{channel}": pin for pin, channel in self.servos.items()}, wire
        )
        self.compare = CompareWrites(self.board, self.servos)
        self.console = ConsoleLog(self.board)
        self.demand = Demand(self.servos, failsafe)
        self.judge = Judge(self.demand)
        self.times = Times()
        # The legs; between the last two the link is lost.
        self.spans: list[Span] = []
        self._flight = flight
        self._view = view
        self._frames = [frame for leg in flight.before for frame in leg.frames]
        self._cut_index = len(self._frames)
        self._frames += [flight.cut, *flight.after.frames]
        self.receiver = GhostReceiver(wire, self._next_frame, RATE_HZ)
        self._demanded = 0
        self._phase = ""
        self._silence_ns = (self.failsafe_ms + _AFTER_FAILSAFE_MS) * 1e6
        self._planned_ns = _QUIET_NS + len(self._frames) * _SLOT_NS + self._silence_ns

    @property
    def frames_sent(self) -> int:
        """Frames whose last stop bit has been on the wire."""
        return self._demanded

    def run(self) -> None:
        """Fly. Raises GhstError if the firmware does not start."""
        self._enter("booting MicroPython and the firmware")
        self._boot()
        self.times.searching = self.board.now_ns
        self.aircraft.takeoff_ns = self.board.now_ns + _ON_THE_GROUND_NS
        self._enter("no frame yet: the pins have to be quiet")
        self._run_to(self.board.now_ns + _QUIET_NS)
        self._fly()
        self._lose_the_link()
        self._fly_again()
        self._enter("landed")

    def _boot(self) -> None:
        # What `Board.boot` does, in slices, so that the view is kept up to date.
        while self.console.link != "searching":
            if self.board.now_ns > _BOOT_LIMIT_NS:
                last = self.console.lines[-1][1] if self.console.lines else "nothing"
                raise GhstError(f"the firmware did not start on the board, it said: {last}")
            self._run_to(self.board.now_ns + _SLICE_NS)

    def _fly(self) -> None:
        first_ns = self.board.now_ns + _LEAD_NS
        self.receiver.start(first_ns)
        ends = [first_ns]
        for leg in self._flight.before:
            self._enter(leg.name)
            ends.append(ends[-1] + len(leg.frames) * _SLOT_NS)
            self._run_to(ends[-1])
        for leg, (start, end) in zip(self._flight.before, pairwise(ends), strict=True):
            self._add_span(leg.name, start, end)

    def _lose_the_link(self) -> None:
        self._enter("link lost in the middle of a frame")
        self._run_to(self.board.now_ns + _SLOT_NS)
        self.times.lost = lost_ns = self.receiver.sent[-1].end_ns
        failsafe_ns = lost_ns + self.failsafe_ms * 1e6
        self.demand.failsafe(failsafe_ns, failsafe_ns + FAILSAFE_SLACK_MS * 1e6)
        self._run_to(lost_ns + self._silence_ns)

    def _fly_again(self) -> None:
        self.times.again = again_ns = self.board.now_ns + _LEAD_NS
        leg = self._flight.after
        self._enter(leg.name)
        self.receiver.start(again_ns)
        self._run_to(again_ns + len(leg.frames) * _SLOT_NS + _LAST_LOOK_NS)
        self._add_span(leg.name, again_ns, self.board.now_ns)

    def _next_frame(self, index: int, t_ns: float) -> bytes | None:
        if index >= len(self._frames):
            return None
        if index == self._cut_index:
            self.receiver.stop_at(t_ns + _CUT_BITS * 1e9 / self.receiver.baud)
            self.aircraft.channels(t_ns, {})
        else:
            self.aircraft.channels(t_ns, pulses_in(self._frames[index]))
        return self._frames[index]

    def _run_to(self, end_ns: float) -> None:
        while self.board.now_ns < end_ns:
            self.board.run_for(min(_SLICE_NS, end_ns - self.board.now_ns))
            self._look()
            self._show()

    def _look(self) -> None:
        """Take note of what was sent, then judge the pulses that are complete."""
        sent = self.receiver.sent
        while self._demanded < len(sent) and sent[self._demanded].end_ns <= self.board.now_ns:
            self.demand.frame(*sent[self._demanded])
            self._demanded += 1
        self.radio.listen(self.receiver.downlink)
        for pin, pulses in self.meter.pulses.items():
            for pulse in pulses[len(self.judge.verdicts[pin].errors) :]:
                self.judge.pulse(pin, pulse)

    def _add_span(self, name: str, start_ns: float, end_ns: float) -> None:
        self.spans.append(Span(name, start_ns / 1e9, end_ns / 1e9))

    def _enter(self, phase: str) -> None:
        self._phase = phase
        self._show()

    def _show(self) -> None:
        now_ns = self.board.now_ns
        state = decoder_state(self.board)
        flown_ns = now_ns - self.times.searching if self.times.searching else 0.0
        self._view.show(
            Snapshot(
                phase=self._phase,
                progress=min(1.0, flown_ns / self._planned_ns),
                emulated_s=now_ns / 1e9,
                link=self.console.link,
                lq=state.lq,
                rssi_dbm=state.rssi_dbm,
                frames_sent=self.frames_sent,
                frames_decoded=state.frames,
                crc_errors=state.crc_errors,
                right=self.judge.right,
                wrong=len(self.judge.wrong),
                rows=tuple(self._row(pin, now_ns) for pin in self.servos),
                console=tuple(line for _, line in self.console.lines),
                radio=self.radio.shown(),
            )
        )

    def _row(self, pin: int, now_ns: float) -> Row:
        pulse = self.meter.last(pin)
        fresh = pulse is not None and now_ns - pulse.rise_ns <= 2 * PERIOD_NS
        errors = self.judge.verdicts[pin].errors
        return Row(
            output=f"GP{pin}",
            channel=self.servos[pin],
            sent_us=self.demand.latest(pin) / 4,
            measured_us=pulse.width_ns / 1000 if pulse is not None and fresh else None,
            error_us=errors[-1][1] / 1000 if errors else 0.0,
        )
