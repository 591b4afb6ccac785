"""The rig of the firmware's tests; the campaign has it too."""

from ghst_tools.campaign.pico import (
    FAILSAFE_NS,
    NO_SENSORS,
    PERIOD_NS,
    SERVOS,
    CompareWrite,
    Pico,
    steps,
)

__all__ = ("FAILSAFE_NS", "NO_SENSORS", "PERIOD_NS", "SERVOS", "CompareWrite", "Pico", "steps")
