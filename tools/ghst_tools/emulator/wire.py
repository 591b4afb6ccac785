"""One half-duplex wire between a pin of the board and a bit-banging host, with a pull-up.

Or inverted, with a pull-down: then levels are those in front of the inverter, high while idle.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import NamedTuple

from ghst_tools.emulator.board import Board
from ghst_tools.emulator.pins import Cause
from ghst_tools.uart_bits import DecodedByte, decode, encode

BAUD = 420_000  # GHST, protocol.md "Line"


class Edge(NamedTuple):
    """A change of level on the wire: when, to which level, and who caused it."""

    t_ns: float
    level: bool
    who: Cause


class Wire:
    """The wire on GPIO `pin`.

    `edges` is every change of level so far, `contention` every time at which the device and the
    host began to drive against each other.
    """

    def __init__(self, board: Board, pin: int, inverted: bool = False) -> None:
        self.pin = board.pin(pin)
        self._inverted = inverted
        self.edges: list[Edge] = []
        self.contention: list[float] = []
        self.clock = board.clock
        self._watchers: tuple[Callable[[Edge], None], ...] = ()
        self._queue: deque[tuple[float, bool | None]] = deque()
        self._alarm = self.clock.create_alarm(self._play)
        self._overrides: list[tuple[float, float, bool | None]] = []
        self._override_alarm = self.clock.create_alarm(self._apply_override)
        self._override: bool | None = None
        self._wanted: bool | None = None
        self._fighting = False
        self.pin.pull(not inverted)
        self.pin.watch_level(self._level_changed)
        self.pin.watch(lambda t_ns, level: self._check_contention())

    @property
    def level(self) -> bool:
        """The level on the wire now."""
        return bool(self.pin.level) is not self._inverted

    @property
    def busy_until_ns(self) -> float:
        """When everything that is queued will have been sent."""
        return self._queue[-1][0] if self._queue else float(self.clock.nanos)

    def watch(self, watcher: Callable[[Edge], None]) -> None:
        """Call `watcher` with every edge from now on."""
        self._watchers += (watcher,)

    def send(
        self,
        data: bytes,
        at_ns: float | None = None,
        baud: float = BAUD,
        gap_ns: float = 0.0,
    ) -> float:
        """Send `data`, 8N1, and release the wire. Returns the end of the last stop bit, in ns.

        `at_ns` is when the first start bit begins (default: now, or after what is queued),
        `gap_ns` the idle time between two bytes. Sends have to be queued in the order of time.
        """
        now = self.clock.nanos
        busy_until = self.busy_until_ns
        start = max(now, busy_until) if at_ns is None else at_ns
        if start < now or start < busy_until:
            raise ValueError(f"send at {start:.0f} ns: the wire is taken to {busy_until:.0f} ns")
        levels, end = encode(data, start, baud, gap_ns)
        self.play(levels, end)
        return end

    def play(self, levels: Iterable[tuple[float, bool]], end: float) -> None:
        """Drive these changes of level, in the order of time, and release the wire at `end`."""
        idle = not self._queue
        self._queue.extend(levels)
        self._queue.append((end, None))
        if idle:
            self._alarm.schedule(max(0.0, self._queue[0][0] - self.clock.nanos))

    def hold(self, level: bool, t0_ns: float, t1_ns: float) -> None:
        """Hold the wire at `level` from `t0_ns` to `t1_ns`, whatever is being sent (a break)."""
        self._add_override(t0_ns, t1_ns, level)

    def glitch(self, t_ns: float, width_ns: float) -> None:
        """Invert the wire for `width_ns`, beginning at `t_ns`."""
        self._add_override(t_ns, t_ns + width_ns, None)

    def cut(self) -> None:
        """Stop sending at once, in the middle of a bit if need be, and release the wire."""
        self._queue.clear()
        self._alarm.cancel()
        self._want(None)

    def decode(
        self, baud: float = BAUD, who: Cause | None = "device", since: float = 0.0
    ) -> list[DecodedByte]:
        """Read the edges caused by `who` (None: all) from `since` on as 8N1."""
        edges = (edge for edge in self.edges if edge.t_ns >= since and who in (None, edge.who))
        return decode(((edge.t_ns, edge.level) for edge in edges), baud, self.clock.nanos)

    def _play(self) -> None:
        queue, now = self._queue, self.clock.nanos
        level = self._wanted
        while queue and queue[0][0] <= now + 1e-6:
            level = queue.popleft()[1]
        if queue:
            self._alarm.schedule(queue[0][0] - now)
        self._want(level)

    def _want(self, level: bool | None) -> None:
        self._wanted = level
        if self._override is None:
            self._drive(level)

    def _drive(self, level: bool | None) -> None:
        self.pin.drive(None if level is None else level is not self._inverted)
        self._check_contention()

    def _add_override(self, t0_ns: float, t1_ns: float, level: bool | None) -> None:
        if t1_ns <= t0_ns or t0_ns < self.clock.nanos:
            raise ValueError("the interval has to lie in the future and be longer than nothing")
        self._overrides.append((t0_ns, t1_ns, level))
        self._overrides.sort(key=lambda override: override[0])
        self._apply_override()

    def _apply_override(self) -> None:
        now = self.clock.nanos + 1e-6
        overrides = self._overrides
        if overrides and overrides[0][1] <= now:
            del overrides[0]
            self._override = None
            self._drive(self._wanted)
        if not overrides:
            return
        t0_ns, t1_ns, level = overrides[0]
        if t0_ns <= now:
            if self._override is None:
                self._override = (not self.level) if level is None else level
                self._drive(self._override)
            self._override_alarm.schedule(t1_ns - self.clock.nanos)
        else:
            self._override_alarm.schedule(t0_ns - self.clock.nanos)

    def _level_changed(self, t_ns: float, level: bool | None, cause: Cause) -> None:
        edge = Edge(t_ns, bool(level) is not self._inverted, cause)
        self.edges.append(edge)
        for watcher in self._watchers:
            watcher(edge)

    def _check_contention(self) -> None:
        device, host = self.pin.device, self.pin.host
        fighting = device is not None and host is not None and device is not host
        if fighting and not self._fighting:
            self.contention.append(self.clock.nanos)
        self._fighting = fighting
