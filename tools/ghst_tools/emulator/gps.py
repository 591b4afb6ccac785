"""Simulated GPS receivers on a UART: one that sends NMEA, and a u-blox that can be set up.

They fly a path, a function of the emulated time, and send what they see of it once a period. What
is simulated of a u-blox is what its interface descriptions say of UBX-NAV-PVT, UBX-ACK, and the
messages that set the port, the messages and the rate; of generation 9 and 10, configuration items.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from ghst_tools.emulator.gps_messages import Place, nav_pvt, nmea_epoch, ubx
from ghst_tools.emulator.uart_peer import UartPeer

Path = Callable[[float], Place]

_NS_PER_MS = 1_000_000.0
_BAUD_TOLERANCE = 0.03

_CFG, _ACK, _NAV = 0x06, 0x05, 0x01
_CFG_PRT, _CFG_MSG, _CFG_RATE, _CFG_VALSET = 0x00, 0x01, 0x08, 0x8A
_NAV_PVT = 0x07
_UBX, _NMEA = 1, 2
_KEY_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8}


class NmeaGps:
    """A receiver that sends RMC, VTG, GGA and GSA, and understands nothing.

    `baud`, `period_ms`, `talker` and `gsa`, whether it sends GSA, may be changed at any time. What
    does not fit into a period is left out of the next one.
    """

    def __init__(
        self,
        peer: UartPeer,
        clock: Any,
        path: Path,
        *,
        baud: int = 9600,
        period_ms: int = 1000,
        talker: str = "GP",
        gsa: bool = True,
    ) -> None:
        """`peer`: `board.uart(n)`; `clock`: `board.clock`; `talker`: see `nmea_epoch`."""
        self.peer = peer
        self.path = path
        self.baud = baud
        self.period_ms = period_ms
        self.talker = talker
        self.gsa = gsa
        self.sent: list[tuple[float, Place]] = []
        self.running = False
        self._clock = clock
        self._alarm = clock.create_alarm(self._solve)

    def start(self) -> None:
        """Plug it in: the first solution comes at once."""
        self.running = True
        self._alarm.schedule(0.0)

    def stop(self) -> None:
        """Unplug it, or let it hang: what is on the line is finished, nothing follows."""
        self.running = False
        self._alarm.cancel()

    def _solve(self) -> None:
        now_ns = float(self._clock.nanos)
        self._alarm.schedule(self.period_ms * _NS_PER_MS)
        if self.peer.busy_until_ns > now_ns + self.period_ms * _NS_PER_MS:
            return
        place = self.path(now_ns)
        self.sent.append((now_ns, place))
        for message in self._messages(place, round(now_ns / _NS_PER_MS)):
            self.peer.send(message, self.baud)

    def _messages(self, place: Place, time_ms: int) -> list[bytes]:
        return nmea_epoch(place, time_ms, self.talker, gsa=self.gsa)


class UbloxGps(NmeaGps):
    """A u-blox as it comes: 9600 baud (38400 from generation 9 on), NMEA once a second.

    `generation` 8 understands CFG-PRT, CFG-MSG and CFG-RATE; 10 only CFG-VALSET; 9 both. `deaf`:
    it does not hear what the board sends. `accepted` are the messages that it obeyed, as
    (class, ID, payload).
    """

    def __init__(
        self,
        peer: UartPeer,
        clock: Any,
        path: Path,
        *,
        generation: int = 8,
        baud: int | None = None,
        period_ms: int = 1000,
        outputs: int = _UBX | _NMEA,
        pvt: bool = False,
        deaf: bool = False,
        fixed_baud: bool = False,
    ) -> None:
        """`outputs`: protocols, 1 UBX, 2 NMEA; `pvt`: whether it sends NAV-PVT.

        `fixed_baud`: acknowledges a new baud rate and does not take it.
        """
        self._default_baud = baud or (9600 if generation < 9 else 38_400)
        # From series 8 on it hears several satellite systems.
        super().__init__(
            peer, clock, path, baud=self._default_baud, period_ms=period_ms, talker="GN"
        )
        self.generation = generation
        self.outputs = outputs
        self.pvt = pvt
        self.deaf = deaf
        self.fixed_baud = fixed_baud
        self.accepted: list[tuple[int, int, bytes]] = []
        self._input = bytearray()
        peer.on_byte = self._hear

    def forget(self) -> None:
        """What an interruption of its supply does: everything is as it comes again."""
        self.baud = self._default_baud
        self.period_ms = 1000
        self.outputs = _UBX | _NMEA
        self.pvt = False
        self._input.clear()

    def _messages(self, place: Place, time_ms: int) -> list[bytes]:
        messages = super()._messages(place, time_ms) if self.outputs & _NMEA else []
        if self.pvt and self.outputs & _UBX:
            messages.append(nav_pvt(place, time_ms))
        return messages

    def _hear(self, value: int) -> None:
        if (
            self.deaf
            or not self.running
            or abs(self.peer.board_baud / self.baud - 1) > _BAUD_TOLERANCE
        ):
            self._input.clear()
            return
        self._input.append(value)
        data = self._input
        while len(data) >= 8:
            length = data[4] | data[5] << 8
            if data[:2] != b"\xb5\x62" or length > 200:
                del data[0]
                continue
            if len(data) < length + 8:
                return
            frame = bytes(data[: length + 8])
            del data[: length + 8]
            if frame == ubx(frame[2], frame[3], frame[6:-2]):
                self._take(frame[2], frame[3], frame[6:-2])

    def _take(self, group: int, number: int, payload: bytes) -> None:
        baud = self.baud
        known = group == _CFG and self._obey(number, payload)
        if known:
            self.accepted.append((group, number, payload))
        if self.outputs & _UBX:
            # At the new baud rate, if this message has changed it.
            self.peer.send(ubx(_ACK, int(known), bytes((group, number))), self.baud)
        if baud != self.baud:
            self._input.clear()

    def _obey(self, number: int, payload: bytes) -> bool:
        if number == _CFG_VALSET:
            return self.generation >= 9 and self._set_values(payload[4:])
        if self.generation >= 10:
            return False
        if number == _CFG_PRT and len(payload) == 20 and payload[0] == 1:
            baud, _, outputs = struct.unpack_from("<IHH", payload, 8)
            self._set_baud(baud)
            self.outputs = outputs
        elif number == _CFG_MSG and payload[:2] == bytes((_NAV, _NAV_PVT)):
            self.pvt = payload[2] > 0
        elif number == _CFG_RATE and len(payload) == 6:
            self.period_ms = struct.unpack("<HHH", payload)[0]
        else:
            return False
        return True

    def _set_values(self, data: bytes) -> bool:
        values = {}
        while data:
            key = int.from_bytes(data[:4], "little")
            size = _KEY_SIZES.get(key >> 28, 0)
            values[key] = int.from_bytes(data[4 : 4 + size], "little")
            data = data[4 + size :]
        known = {0x40520001, 0x10740001, 0x10740002, 0x20910007, 0x30210001, 0x30210002}
        if not known.issuperset(values):
            return False
        for protocol, key in ((_UBX, 0x10740001), (_NMEA, 0x10740002)):
            if key in values:
                self.outputs = self.outputs & ~protocol | (protocol if values[key] else 0)
        self.pvt = bool(values.get(0x20910007, self.pvt))
        self.period_ms = values.get(0x30210001, self.period_ms)
        self._set_baud(values.get(0x40520001, self.baud))
        return True

    def _set_baud(self, baud: int) -> None:
        if not self.fixed_baud:
            self.baud = baud
