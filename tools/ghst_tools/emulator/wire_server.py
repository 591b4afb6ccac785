"""The Ghost wire of an emulated board on a TCP port, and what its servos do."""

from __future__ import annotations

from collections.abc import Callable

from ghst_tools.emulator.meters import PulseMeter
from ghst_tools.emulator.tcp_port import TcpPort
from ghst_tools.emulator.wire import Wire
from ghst_tools.emulator.wire_port import WirePort

_SHOW_EVERY_NS = 0.25e9


class WireServer:
    """Carries bytes between a TCP client and a wire; forgets what wire and meter have recorded.

    The client hears everything that is on the wire, its own bytes too. `tell` is called with a
    line every 250 ms of emulated time with a client: the last pulses at the pins of `meter`.
    """

    def __init__(
        self, wire: Wire, meter: PulseMeter, port: int, tell: Callable[[str], object]
    ) -> None:
        self.wire = wire
        self.meter = meter
        self._adapter = WirePort(wire)
        self._tell = tell
        self._dropped_bytes = 0
        self._shown_ns: float = wire.clock.nanos
        self.port = TcpPort(self._adapter.write, port)

    @property
    def address(self) -> str:
        """What to give `ghst simulate` as the port."""
        return self.port.address

    def step(self) -> None:
        """Hand over what was on the wire since the last call."""
        self.port.send(b"".join(data for _, data in self._adapter.take()))
        self.wire.edges.clear()
        self.wire.contention.clear()
        now_ns: float = self.wire.clock.nanos
        if now_ns - self._shown_ns < _SHOW_EVERY_NS:
            return
        self._shown_ns = now_ns
        if self.port.connected:
            self._tell(self._line(now_ns))
        for pulses in self.meter.pulses.values():
            pulses.clear()

    def _line(self, now_ns: float) -> str:
        parts = [f"{now_ns / 1e9:8.2f} s"]
        for pin in self.meter.pulses:
            pulse = self.meter.last(pin)
            parts.append(f"GP{pin} {pulse.width_ns / 1e3:.1f}" if pulse else f"GP{pin} -")
        dropped = self._adapter.dropped_bytes - self._dropped_bytes
        self._dropped_bytes += dropped
        if dropped:
            parts.append(f"{dropped} bytes too many for the wire: choose a lower --rate")
        return "  ".join(parts)
