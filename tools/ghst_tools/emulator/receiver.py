"""A simulated Ghost receiver on the wire: sends control frames, listens to telemetry."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from ghst_tools.emulator.wire import BAUD, Wire
from ghst_tools.emulator.wire_port import WireReader

FRAME_BYTES = 14
DOWNLINK_ADDRESS = 0x89

NextFrame = Callable[[int, float], bytes | None]


class SentFrame(NamedTuple):
    """A frame sent to the board, with the end of its last stop bit."""

    end_ns: float
    frame: bytes


class DownlinkFrame(NamedTuple):
    """A frame received from the board.

    `t_ns` is the beginning of its first start bit, `after_ns` the same from the end of the last
    frame sent before it (None: there was none), `ok` whether all its stop bits were high.
    """

    t_ns: float
    after_ns: float | None
    frame: bytes
    ok: bool


class GhostReceiver:
    """Sends what `next_frame(index, t_ns)` returns at exactly `rate_hz`, in emulated time.

    None instead of a frame leaves its slot empty. `sent`, `downlink` and `noise` (bytes from the
    board that begin no downlink frame) grow until `trim` is called.
    """

    def __init__(
        self, wire: Wire, next_frame: NextFrame, rate_hz: float = 250.0, baud: float = BAUD
    ) -> None:
        self.wire = wire
        self.next_frame = next_frame
        self.rate_hz = rate_hz
        self.baud = baud
        self.index = 0
        self.sent: list[SentFrame] = []
        self.downlink: list[DownlinkFrame] = []
        self.noise: list[tuple[float, int]] = []
        self._clock = wire.clock
        self._alarm = self._clock.create_alarm(self._slot)
        self._stop_alarm = self._clock.create_alarm(self._cut)
        self._first_ns = 0.0
        self._slots = 0
        self._running = False
        self._last_end_ns: float | None = None
        self._partial: list[tuple[float, int, bool]] = []
        WireReader(wire, self._byte, baud, "device")

    @property
    def running(self) -> bool:
        """Whether the link is up."""
        return self._running

    def start(self, at_ns: float | None = None) -> None:
        """Begin to send, the first frame at `at_ns` (default: now)."""
        now = self._clock.nanos
        self._first_ns = now if at_ns is None else at_ns
        if self._first_ns < now:
            raise ValueError("the start has to lie in the future")
        self._slots = 0
        self._running = True
        self._alarm.schedule(self._first_ns - now)

    def stop(self) -> None:
        """Lose the link: the frame under way is finished, no other follows."""
        self._running = False
        self._alarm.cancel()

    def stop_at(self, at_ns: float) -> None:
        """Lose the link at `at_ns` exactly, in the middle of a byte or a bit if it falls there."""
        if at_ns < self._clock.nanos:
            raise ValueError("the end has to lie in the future")
        self._stop_alarm.schedule(at_ns - self._clock.nanos)

    def trim(self) -> None:
        """Forget what has been sent and received so far."""
        self.sent.clear()
        self.downlink.clear()
        self.noise.clear()

    def _slot(self) -> None:
        now = self._clock.nanos
        frame = self.next_frame(self.index, now)
        self.index += 1
        if frame is not None:
            end = self.wire.send(frame, now, self.baud)
            self.sent.append(SentFrame(end, frame))
        self._slots += 1
        self._alarm.schedule(max(0.0, self._first_ns + self._slots * 1e9 / self.rate_hz - now))

    def _cut(self) -> None:
        self.stop()
        self.wire.cut()
        while self.sent and self.sent[-1].end_ns > self._clock.nanos:
            self.sent.pop()  # never complete

    def _byte(self, t_ns: float, value: int, ok: bool) -> None:
        partial = self._partial
        if partial and t_ns - partial[-1][0] > 20e9 / self.baud:
            self.noise += [(t, v) for t, v, _ in partial]  # a frame has no gaps
            partial.clear()
        if not partial and value != DOWNLINK_ADDRESS:
            self.noise.append((t_ns, value))
            return
        partial.append((t_ns, value, ok))
        if len(partial) == FRAME_BYTES:
            start = partial[0][0]
            ends = [sent.end_ns for sent in self.sent[-2:] if sent.end_ns <= start]
            self.downlink.append(
                DownlinkFrame(
                    start,
                    start - ends[-1] if ends else None,
                    bytes(v for _, v, _ in partial),
                    all(framing for _, _, framing in partial),
                )
            )
            partial.clear()
