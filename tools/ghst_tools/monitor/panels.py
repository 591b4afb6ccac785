"""The parts of the monitor's view, drawn from a `State`."""

from __future__ import annotations

from typing import Any

from rich.table import Table
from rich.text import Text

from ghst_tools.monitor.state import ERRORS, HIGH_US, SENSORS, State

_LOW_US, _HIGH_US = 988.0, 2012.0  # the ends of a stick
_BAR = 24
_LINKS = {"searching": "bold yellow", "linked": "bold green", "failsafe": "bold white on red"}


def link(state: State) -> Text:
    """The link, in two lines."""
    status = state.status
    known = bool(status["rf_mode"])
    rate = state.frame_rate_hz
    name = status["link"]
    text = Text.assemble((f" {name.upper()} ", _LINKS.get(name, "bold")), "  ")
    text.append(f"LQ {status['lq']:3d} %  RSSI {status['rssi_dbm']:4d} dBm  " if known else "")
    text.append(state.rf_mode)
    text.append(f"  {status['tx_power_dbm']:+d} dBm" if known else "")
    text.append("  " + ("armed" if status["armed"] else "disarmed"))
    text.append(f"\n {status['frames']} frames, ")
    text.append("" if rate is None else f"{rate:.0f} per second, ")
    text.append(f"{status['failsafes']} failsafes", "bold red" if status["failsafes"] else "")
    return text


def channels(state: State) -> Table:
    """A bar for each channel."""
    table = Table.grid(padding=(0, 1))
    for style in ("dim", "", "cyan"):
        table.add_column(justify="right" if style != "cyan" else "left", style=style)
    for number, pulse in enumerate(state.status["channels_us"], 1):
        value = "-" if pulse is None else f"{pulse:.2f}"
        table.add_row(f"CH{number}", value, _bar(pulse))
    return table


def _bar(pulse: float | None) -> str:
    if pulse is None:
        return "·" * _BAR
    part = (min(max(pulse, _LOW_US), _HIGH_US) - _LOW_US) / (_HIGH_US - _LOW_US)
    halves = round(part * 2 * _BAR)
    return ("█" * (halves // 2) + "▌" * (halves % 2)).ljust(_BAR, "·")


def outputs(state: State) -> Table:
    """What each pin gives."""
    table = Table.grid(padding=(0, 1))
    table.add_column(style="dim")
    table.add_column(justify="right")
    for pin, pulse in state.status["outputs_us"].items():
        shown = "high" if pulse > HIGH_US else f"{pulse:.2f}" if pulse else "low"
        table.add_row(f"GP{pin}", shown)
    if not state.status["outputs_us"]:
        table.add_row("none", "")
    return table


def counters(state: State) -> Table:
    """Errors, telemetry, MSP and the main loop."""
    status = state.status
    table = Table.grid(padding=(0, 1))
    table.add_column(style="dim")
    table.add_column(justify="right")

    def row(title: str, value: Any, bad: bool = False) -> None:
        table.add_row(title, Text(str(value), "yellow" if bad else ""))

    for key in ERRORS:
        row(key.replace("_", " ").replace("crc", "CRC"), status[key], status[key] > 0)
    if "weak_frames" in status:
        row("frames of a weak link", status["weak_frames"], status["weak_frames"] > 0)
    row("telemetry sent", status["telemetry_frames"])
    row("  without a slot", status["telemetry_expired"])
    row("  collisions", status["collisions"], status["collisions"] > 0)
    if state.downlink is False:
        row("  downlink", f"none in {state.rf_mode}")
    row("MSP frames, lost", f"{status['msp_frames']}, {status['msp_lost']}")
    row("MSP answers, errors", f"{status['msp_answered']}, {status['msp_errors']}")
    stuck, faults = status["main_loop_stuck"], status["main_loop_faults"]
    row("main loop stuck, faults", f"{stuck}, {faults}", bool(stuck or faults))
    row("main loop round", f"{status['main_loop_cycle_time_us'] / 1000:.1f} ms")
    return table


def sensors(state: State) -> Table:
    """A line for each sensor."""
    table = Table.grid(padding=(0, 1))
    table.add_column(style="dim")
    table.add_column()
    for name in SENSORS:
        if name in state.status:
            values = state.status[name]
            table.add_row(name, _DESCRIBE[name](values) or "no values")
            if values["faults"]:
                table.add_row("", Text(f"{values['faults']} faults", "yellow"))
    if not table.rows:
        table.add_row("none", "")
    return table


def _battery(values: dict[str, Any]) -> str:
    parts = [
        _value(values["voltage_mv"], 1000, "V", 2),
        _value(values["current_ma"], 1000, "A", 1),
        _value(values["consumed_mah"], 1, "mAh"),
        "" if values["cell_count"] is None else f"{values['cell_count']}S",
        "critical" if values["critical"] else "low" if values["low"] else "",
    ]
    return _joined(parts)


def _gps(values: dict[str, Any]) -> str:
    fix = "3D fix" if values["fix_3d"] else "2D fix" if values["fix"] else "no fix"
    satellites = values["satellites"]
    parts = [
        fix,
        "" if satellites is None else f"{satellites} satellites",
        _value(values["lat_e7"], 1e7, "°", 6),
        _value(values["lon_e7"], 1e7, "°", 6),
        _value(values["alt_m"], 1, "m"),
        _value(values["speed_cm_s"], 100, "m/s", 1),
        "" if values["home_distance_m"] is None else f"home {values['home_distance_m']} m",
    ]
    return _joined(parts)


def _barometer(values: dict[str, Any]) -> str:
    parts = [
        _value(values["altitude_cm"], 100, "m", 1),
        _value(values["vario_cm_s"], 100, "m/s", 1),
        _value(values["pressure_pa"], 1, "Pa"),
        _value(values["temperature_decicelsius"], 10, "°C", 1),
    ]
    return _joined(parts)


def _magnetometer(values: dict[str, Any]) -> str:
    return _value(values["heading_decideg"], 10, "°", 1)


_DESCRIBE = {
    "battery": _battery,
    "gps": _gps,
    "barometer": _barometer,
    "magnetometer": _magnetometer,
}


def _value(value: int | None, divisor: float, unit: str, decimals: int = 0) -> str:
    if value is None:
        return ""
    space = "" if unit == "°" else " "
    return f"{value / divisor:.{decimals}f}{space}{unit}"


def _joined(parts: list[str]) -> str:
    return ", ".join(part for part in parts if part)
