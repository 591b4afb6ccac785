"""A serial adapter on an emulated wire: its TX and RX are both on it, so it hears its echo."""

from __future__ import annotations

from collections.abc import Callable

from ghst_tools.emulator.pins import Cause
from ghst_tools.emulator.wire import BAUD, Edge, Wire
from ghst_tools.uart_bits import SerialDecoder

OnByte = Callable[[float, int, bool], None]


class WireReader:
    """Calls `on_byte` with the bytes on a wire: start of the start bit in ns, value, framing.

    `who`: caused by whom; None: whatever is on it. A byte is told in the middle of its stop bit or
    later, at the latest a bit behind it.
    """

    def __init__(
        self, wire: Wire, on_byte: OnByte, baud: float = BAUD, who: Cause | None = None
    ) -> None:
        self._clock = wire.clock
        self._on_byte = on_byte
        self._who = who
        self._longest_ns = 11e9 / baud
        self._decoder = SerialDecoder(baud)
        self._alarm = self._clock.create_alarm(self._flush)
        wire.watch(self._edge)

    def _edge(self, edge: Edge) -> None:
        if self._who not in (None, edge.who):
            return
        for byte in self._decoder.feed(edge.t_ns, edge.level):
            self._on_byte(*byte)
        if self._decoder.pending:
            self._alarm.schedule(self._longest_ns)

    def _flush(self) -> None:
        for byte in self._decoder.flush(self._clock.nanos):
            self._on_byte(*byte)


class WirePort:
    """Writes to a wire and reads what is on it, without any delay of its own.

    What would wait for longer than `most_ns` until the wire is free is thrown away, and counted in
    `dropped_bytes`: a wire is not endlessly fast.
    """

    def __init__(self, wire: Wire, baud: float = BAUD, most_ns: float = 20e6) -> None:
        self.wire = wire
        self.dropped_bytes = 0
        self._baud = baud
        self._most_ns = most_ns
        self._read: list[tuple[float, bytes]] = []
        WireReader(wire, self._byte, baud)

    def write(self, data: bytes) -> None:
        """Send `data` now, or when the wire is free."""
        if self.wire.busy_until_ns - self.wire.clock.nanos > self._most_ns:
            self.dropped_bytes += len(data)
        else:
            self.wire.send(data, baud=self._baud)

    def take(self) -> list[tuple[float, bytes]]:
        """The bytes since the last call, each with the end of its stop bit in ns."""
        read, self._read = self._read, []
        return read

    def _byte(self, t_ns: float, value: int, ok: bool) -> None:
        self._read.append((t_ns + 10e9 / self._baud, bytes((value,))))
