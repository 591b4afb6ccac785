"""A flight controller made of the library, for the other end of a pseudo-terminal."""

from __future__ import annotations

from collections.abc import Callable

from ghst import Receiver, msp, msp_commands, telemetry  # type: ignore[import-not-found]
from ghst.msp_state import State  # type: ignore[import-not-found]
from ghst.protocol import FRAME_SIZE, RF_MODES  # type: ignore[import-not-found]

_EVERY = 4

Builder = Callable[[bytearray], object]

TELEMETRY: tuple[Builder, ...] = (
    lambda frame: telemetry.pack_status(frame, 16210, 12340, 560, True),
    lambda frame: telemetry.gps_primary(frame, 473002299, 85008856, 422),
    lambda frame: telemetry.gps_secondary(frame, 1234, 2705, 17, 120, 1805, True, True),
    lambda frame: telemetry.mag_baro(frame, 478, 9, -50),
)
"""What it measures."""


class FlightController:
    """Receives with `ghst.Receiver`; has a frame for every fourth slot, and for MSP's answers."""

    def __init__(self) -> None:
        self.receiver = Receiver()
        self._responder = msp.Responder()
        msp_commands.answer(self._responder, State())
        self._payload = bytearray(msp.PAYLOAD_SIZE)
        self._chunk = bytearray(telemetry.MSP_CHUNK_SIZE)
        self._slots = 0

    def hear(self, octets: bytes) -> bytes:
        """Take bytes of the receiver; returns the frame for the slot behind them, or nothing."""
        receiver = self.receiver
        is_control = receiver.feed(octets)
        while receiver.next_msp(self._payload):
            self._responder.feed(self._payload)
        mode = RF_MODES.get(receiver.rf_mode)
        if not is_control or not (receiver.telemetry_requested or (mode and mode[2])):
            return b""
        frame = bytearray(FRAME_SIZE)
        if self._responder.next_chunk(self._chunk):
            telemetry.msp_response(frame, self._chunk)
            return bytes(frame)
        self._slots += 1
        if self._slots % _EVERY:
            return b""
        TELEMETRY[self._slots // _EVERY % len(TELEMETRY)](frame)
        return bytes(frame)
