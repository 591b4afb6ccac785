"""The pilot's radio: reads what the board sends in the telemetry slots, and shows it."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import Any

from ghst import downlink  # type: ignore[import-not-found]
from ghst_tools.emulator.receiver import DownlinkFrame

PACK, POSITION, MOTION, MAG_BARO = "PackStatus", "GpsPrimary", "GpsSecondary", "MagBaro"


class Radio:
    """What the radio has heard, all of it and the last of each kind."""

    def __init__(self) -> None:
        self.heard: defaultdict[str, list[tuple[float, Any]]] = defaultdict(list)
        """Values of the frames with their times in ns, by the names in `ghst.downlink`."""
        self.broken: list[str] = []
        self._taken = 0

    @property
    def counts(self) -> Counter[str]:
        """Frames of each kind."""
        return Counter({kind: len(frames) for kind, frames in self.heard.items()})

    def listen(self, frames: list[DownlinkFrame]) -> None:
        """Read those of `frames` that are new since the last call."""
        for frame in frames[self._taken :]:
            try:
                if not frame.ok:
                    raise ValueError("a stop bit is low")
                values = downlink.decode(frame.frame)
            except ValueError as error:
                self.broken.append(f"telemetry frame at {frame.t_ns / 1e6:.3f} ms: {error}")
            else:
                self.heard[type(values).__name__].append((frame.t_ns, values))
        self._taken = len(frames)

    def last(self, kind: str) -> Any:
        """The last values of this kind, None if none came."""
        frames = self.heard.get(kind)
        return frames[-1][1] if frames else None

    def shown(self) -> tuple[tuple[str, str], ...]:
        """Label and text of each line of the radio's screen; of what never came there is none."""
        lines = []
        if pack := self.last(PACK):
            lines.append(
                (
                    "battery",
                    f"{pack.voltage_mv / 1000:.2f} V, {pack.current_ma / 1000:.1f} A, "
                    f"{pack.consumed_mah} mAh",
                )
            )
        if place := self.last(POSITION):
            lines.append(
                ("position", f"{place.lat_e7 / 1e7:.6f} {place.lon_e7 / 1e7:.6f}, {place.alt_m} m")
            )
        if motion := self.last(MOTION):
            course = motion.course_decideg / 10
            speed = f"{motion.speed_cm_s * 0.036:.0f} km/h, course {course:.0f} deg"
            lines.append(("motion", f"{speed}, {motion.satellites} satellites"))
            if motion.home_fix:
                direction = motion.home_dir_decideg / 10
                lines.append(("home", f"{motion.home_dist_m} m, at {direction:.0f} deg"))
        if air := self.last(MAG_BARO):
            parts = []
            if air.alt_m is not None:
                parts.append(f"{air.alt_m:+d} m")
            if air.vario_cm_s is not None:
                parts.append(f"{air.vario_cm_s / 100:+.1f} m/s")
            if air.heading_decideg is not None:
                parts.append(f"heading {air.heading_decideg / 10 % 360:.0f} deg")
            if parts:
                lines.append(("altitude", ", ".join(parts)))
        return tuple(lines)
