"""What a run of the campaign is given."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ghst_tools.campaign.effort import Effort
from ghst_tools.campaign.picos import Picos


@dataclass(frozen=True)
class Setting:
    """What a run of the campaign is given."""

    image: Path
    effort: Effort
    seed: int

    @cached_property
    def picos(self) -> Picos:
        """The boards, compiled and built when the first is asked for."""
        return Picos(self.image)
