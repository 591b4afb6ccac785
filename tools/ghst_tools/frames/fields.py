"""The fields of a valid frame, with their units in their names, and of each byte of link data."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

from ghst import Receiver, downlink, encode, msp, msp_commands  # type: ignore[import-not-found]
from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_RX,
    FRAME_LENGTH,
    RF_MODES,
    TYPE_LINK_DATA,
    TYPE_MSP_RESPONSE,
)
from ghst_tools.frames import kinds

Fields = dict[str, Any]
"""Names to values that JSON knows."""

# Bits of an MSP status byte (protocol description: MSP).
_SEQUENCE, _START, _VERSION, _ERROR = 0x0F, 0x10, 0x60, 0x80
_NO_VERSION = 0x60


class Link(NamedTuple):
    """What each of the four bytes of link data says, were it the one with this value."""

    lq_percent: int
    rssi_dbm: int
    rf_mode: int
    rf_mode_name: str | None
    """None: nobody has published a mode of this number."""
    telemetry_requested: bool
    alt_scale: bool
    tx_power_dbm: int

    @property
    def of_each_byte(self) -> tuple[Fields, Fields, Fields, Fields]:
        """The fields by the byte that they come from: LQ, RSSI, RF protocol, power."""
        values = self._asdict()
        names = (
            ("lq_percent",),
            ("rssi_dbm",),
            ("rf_mode", "rf_mode_name", "telemetry_requested", "alt_scale"),
            ("tx_power_dbm",),
        )
        lq, rssi, protocol, power = ({name: values[name] for name in group} for group in names)
        return lq, rssi, protocol, power


@cache
def link_table() -> tuple[Link, ...]:
    """For each value of a byte what it means as LQ, as RSSI, as RF protocol and as power."""
    receiver = Receiver()
    table = []
    for octet in range(256):
        receiver.feed(encode.channels(TYPE_LINK_DATA, (0, 0, 0, 0), (octet,) * 4))
        mode = RF_MODES.get(receiver.rf_mode)
        table.append(
            Link(
                receiver.lq,
                receiver.rssi_dbm,
                receiver.rf_mode,
                mode and mode[0],
                receiver.telemetry_requested,
                receiver.alt_scale,
                receiver.tx_power_dbm,
            )
        )
    return tuple(table)


def read(frame: bytes) -> Fields:
    """The fields of a valid frame that carries no channels; `payload` where nobody knows them.

    Bytes whose meaning is not public are given in hexadecimal.
    """
    name = kinds.name(frame[0], frame[2])
    payload = frame[3:-1]
    if frame[1] == FRAME_LENGTH:
        if name == "vtx_setup":
            return _vtx_setup(frame)
        if name in ("msp_request", "msp_write"):
            return message(payload)
        if frame[0] == ADDRESS_RX and name != kinds.UNKNOWN:
            values = downlink.read(frame)
            if frame[2] == TYPE_MSP_RESPONSE:
                return message(values.chunk)
            return dict(values._asdict())
    return {"payload": payload.hex()}


def _vtx_setup(frame: bytes) -> Fields:
    receiver = _vtx_receiver()
    receiver.feed(frame)
    return {
        "vtx_flags": receiver.vtx_flags,
        "vtx_freq_mhz": receiver.vtx_freq_mhz,
        "vtx_power_mw": receiver.vtx_power_mw,
        "vtx_band_channel": receiver.vtx_band_channel,
    }


@cache
def _vtx_receiver() -> Any:
    return Receiver()


def message(chunk: bytes) -> Fields:
    """A piece of an MSP message: the header if it has one, and the data in hexadecimal."""
    status = chunk[0]
    fields: Fields = {
        "msp_sequence": status & _SEQUENCE,
        "msp_start": bool(status & _START),
        "msp_version": None if status & _VERSION == _NO_VERSION else (status & _VERSION) >> 5 or 2,
        "msp_error": bool(status & _ERROR),
    }
    header = 1
    if status & _START:
        request = msp.Request(0)
        if request.feed(chunk) != msp.UNFINISHED:
            fields["msp_command"] = request.command
            fields["msp_command_name"] = msp_command_names().get(request.command)
            fields["msp_size_bytes"] = request.size
            header = _header_size(chunk, request.version)
    fields["msp_data"] = chunk[header:].hex()
    return fields


def _header_size(chunk: bytes, version: int) -> int:
    # v2: status, flags, command u16, size u16; v1: status, size, command, and u16 if jumbo.
    if version == 2:
        return 6
    return 5 if chunk[1] == 0xFF else 3


@cache
def msp_command_names() -> dict[int, str]:
    """Numbers of the MSP commands that the library answers, and their names."""
    names = _Names()
    msp_commands.answer(names, None)
    return names.found


class _Names:
    """Stands where a responder is expected, and takes down what it is to answer."""

    def __init__(self) -> None:
        self.found: dict[int, str] = {}

    def command(self, number: int, handler: Any) -> None:
        self.found[number] = handler.__name__
