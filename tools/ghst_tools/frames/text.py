"""Frames as text, one line each."""

from __future__ import annotations

from functools import cache, lru_cache

from ghst import downlink  # type: ignore[import-not-found]
from ghst.protocol import (  # type: ignore[import-not-found]
    ADDRESS_FC,
    ADDRESS_RX,
    FRAME_LENGTH,
    TYPE_12_BIT,
    TYPE_CHANNELS_5_TO_8,
    TYPE_LINK_DATA,
    TYPE_MSP_RESPONSE,
)
from ghst_tools.frames import fields, kinds, scaling
from ghst_tools.frames.fields import Fields
from ghst_tools.frames.lines import LineWriter

_SHOWN_BYTES = 16
_TITLE_WIDTH = 22


class TextLines(LineWriter):
    """Time, direction, type, CRC verdict, and what the frame says, in plain units.

    A recording without times shows where in the stream each frame begins. Of the channels those
    are shown that the frame carries.
    """

    def __init__(self) -> None:
        self._heads: dict[bytes, str] = {}
        self._primary = [
            [f"{pulse / 4:7.2f}" for pulse in scaling.primary(wide).tolist()]
            for wide in (False, True)
        ]
        self._auxiliary = [
            [f"{pulse // 4:4d}" for pulse in scaling.auxiliary(wide).tolist()]
            for wide in (False, True)
        ]
        self._link = _link_text()

    def frame(self, time_s: float | None, offset: int, frame: bytes) -> str:
        begin = _begin(time_s, offset)
        head = self._heads.get(frame[:3]) or self._head(frame)
        kind = frame[2]
        if frame[0] == ADDRESS_FC and kind & 0xD0 == 0x10 and frame[1] == FRAME_LENGTH:
            return f"{begin}  {head}{self._control(frame)}"
        return f"{begin}  {head}{says(frame)}"

    def _control(self, frame: bytes) -> str:
        kind = frame[2]
        wide = kind & TYPE_12_BIT != 0
        table = self._primary[wide]
        raw = int.from_bytes(frame[3:9], "little")
        text = (
            f"1-4 {table[raw & 4095]} {table[raw >> 12 & 4095]} "
            f"{table[raw >> 24 & 4095]} {table[raw >> 36]} us"
        )
        group = (kind & 0xDF) - TYPE_CHANNELS_5_TO_8
        if group < 3:
            table = self._auxiliary[wide]
            first = 4 * group + 5
            return (
                f"{text}  {first}-{first + 3} {table[frame[9]]} {table[frame[10]]} "
                f"{table[frame[11]]} {table[frame[12]]} us"
            )
        if kind & 0xDF == TYPE_LINK_DATA:
            lq, rssi, protocol, power = self._link
            return (
                f"{text}  {lq[frame[9]]}, {rssi[frame[10]]}, {protocol[frame[11]]}, "
                f"{power[frame[12]]}"
            )
        return f"{text}  {frame[9:13].hex(' ')}"

    def damaged(self, time_s: float | None, offset: int, frame: bytes) -> str:
        title = kinds.title(kinds.name(frame[0], frame[2]))
        head = _columns(kinds.direction(frame[0]), frame[2], title, "CRC BAD")
        return f"{_begin(time_s, offset)}  {head}{frame.hex(' ')}"

    def garbage(self, time_s: float | None, offset: int, octets: bytes) -> str:
        return self._loose("garbage", time_s, offset, octets)

    def unfinished(self, time_s: float | None, offset: int, octets: bytes) -> str:
        return self._loose("unfinished", time_s, offset, octets)

    def _loose(self, what: str, time_s: float | None, offset: int, octets: bytes) -> str:
        size = f"{len(octets)} byte{'s' if len(octets) != 1 else ''}"
        more = " ..." if len(octets) > _SHOWN_BYTES else ""
        shown = octets[:_SHOWN_BYTES].hex(" ") + more
        return f"{_begin(time_s, offset)}  {_columns('-', None, what, size)}{shown}"

    def _head(self, frame: bytes) -> str:
        address, _, kind = frame[:3]
        title = kinds.title(kinds.name(address, kind))
        head = _columns(kinds.direction(address), kind, title, "CRC ok")
        if address not in kinds.ENDS:
            head += f"to 0x{address:02x}: "
        self._heads[frame[:3]] = head
        return head


def _begin(time_s: float | None, offset: int) -> str:
    return f"byte {offset:9d}" if time_s is None else f"{time_s:12.6f} s"


def _columns(direction: str, kind: int | None, title: str, verdict: str) -> str:
    number = "" if kind is None else f"0x{kind:02x}"
    return f"{direction:<4}  {number:<4}  {title:<{_TITLE_WIDTH}}  {verdict:<7}  "


@lru_cache(maxsize=4096)
def says(frame: bytes) -> str:
    """What a frame without channels says."""
    name = kinds.name(frame[0], frame[2])
    if frame[1] == FRAME_LENGTH:
        if frame[0] == ADDRESS_RX and name != kinds.UNKNOWN and frame[2] != TYPE_MSP_RESPONSE:
            return _DOWNLINK[name](downlink.read(frame))
        found = fields.read(frame)
        if "msp_sequence" in found:
            return _message(found)
        if "vtx_freq_mhz" in found:
            return _vtx_setup(found)
    elif name != kinds.UNKNOWN:
        return f"length {frame[1]} instead of {FRAME_LENGTH}: {frame[3:-1].hex(' ')}"
    return frame[3:-1].hex(" ")


def _vtx_setup(found: Fields) -> str:
    power = f"{found['vtx_power_mw']} mW" if found["vtx_power_mw"] else "off"
    return (
        f"{found['vtx_freq_mhz']} MHz, {power}, band and channel "
        f"0x{found['vtx_band_channel']:02x}, flags 0x{found['vtx_flags']:02x}"
    )


def _message(found: Fields) -> str:
    parts = [f"sequence {found['msp_sequence']}"]
    version = found["msp_version"]
    parts.append("no MSP version" if version is None else f"MSP v{version}")
    if found["msp_error"]:
        parts.append("error")
    if "msp_command" in found:
        command = f"command {found['msp_command']}"
        if found["msp_command_name"]:
            command += f" {found['msp_command_name']}"
        parts += [command, f"{found['msp_size_bytes']} bytes"]
    data = found["msp_data"]
    return f"{', '.join(parts)}: {bytes.fromhex(data).hex(' ')}" if data else ", ".join(parts)


def _pack_status(values: downlink.PackStatus) -> str:
    text = (
        f"{values.voltage_mv / 1000:.2f} V, {values.current_ma / 1000:.2f} A, "
        f"{values.consumed_mah} mAh, {'armed' if values.armed else 'disarmed'}"
    )
    if values.rx_voltage_mv:
        text += f", receiver {values.rx_voltage_mv / 1000:.1f} V"
    return text


def _gps_primary(values: downlink.GpsPrimary) -> str:
    return f"{values.lat_e7 / 1e7:.7f} {values.lon_e7 / 1e7:.7f} deg, {values.alt_m} m"


def _gps_secondary(values: downlink.GpsSecondary) -> str:
    text = (
        f"{values.speed_cm_s / 100:.2f} m/s, course {values.course_decideg / 10:.1f} deg, "
        f"{values.satellites} satellites, {'fix' if values.fix else 'no fix'}"
    )
    if not values.home_fix:
        return text + ", no home"
    return f"{text}, home {values.home_dist_m} m at {values.home_dir_decideg / 10:.1f} deg"


def _mag_baro(values: downlink.MagBaro) -> str:
    heading, height, vario = values
    return (
        f"heading {'-' if heading is None else f'{heading / 10:.1f} deg'}, "
        f"altitude {'-' if height is None else f'{height} m'}, "
        f"vario {'-' if vario is None else f'{vario / 100:+.2f} m/s'}"
    )


_DOWNLINK = {
    "pack_status": _pack_status,
    "gps_primary": _gps_primary,
    "gps_secondary": _gps_secondary,
    "mag_baro": _mag_baro,
}


@cache
def _link_text() -> tuple[list[str], ...]:
    """For each of the four bytes of link data and each value what it says."""
    lq, rssi, protocol, power = [], [], [], []
    for link in fields.link_table():
        lq.append(f"LQ {link.lq_percent:3d} %")
        rssi.append(f"RSSI {link.rssi_dbm:4d} dBm")
        text = link.rf_mode_name or f"RF mode {link.rf_mode}"
        text += ", telemetry requested" if link.telemetry_requested else ""
        protocol.append(text + (", new scaling" if link.alt_scale else ""))
        power.append(f"{link.tx_power_dbm:+d} dBm")
    return lq, rssi, protocol, power
