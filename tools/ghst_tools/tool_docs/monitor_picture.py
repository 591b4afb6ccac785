"""The picture of `ghst monitor`: its own view of a recorded board, as SVG."""

from __future__ import annotations

import asyncio
import contextlib
import re
import tempfile
from pathlib import Path

from ghst_tools.monitor.feed import Feed
from ghst_tools.monitor.screen import Monitor

_SIZE = (112, 38)
_LINES = 8
_TITLE = "ghst monitor"
# A picture loads nothing from anywhere, and names no page.
_ELSEWHERE = re.compile(r"@font-face\s*{.*?}\s*|<!--.*?-->\s*", re.DOTALL)


def draw(folder: Path, port: str) -> str:
    """Watch `port` in `folder` until some lines have come; the screen of then as an SVG."""
    with contextlib.chdir(folder):
        return asyncio.run(_draw(port))


async def _draw(port: str) -> str:
    with tempfile.TemporaryDirectory() as folder, Feed(port, 200) as feed:
        screen = Monitor(feed, folder=Path(folder))
        async with screen.run_test(size=_SIZE) as pilot:
            await pilot.press("enter")
            while screen.state.lines < _LINES:
                await pilot.pause(0.1)
            svg = screen.export_screenshot(title=_TITLE)
    return _ELSEWHERE.sub("", svg)
