"""Fixtures that more than one folder of tests needs."""

from pathlib import Path

import pytest

import ghst_tools.micropython_image
from ghst_tools.errors import GhstError


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell the figures that tests have measured (`record_property("figure", ...)`)."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.stats.get(outcome, []):
            for name, value in report.user_properties:
                if name == "figure" and report.when == "call":
                    terminalreporter.write_line(str(value))


@pytest.fixture(scope="session")
def micropython_image() -> Path:
    """The MicroPython image for the emulated Pico that `ghst micropython` would name."""
    try:
        return ghst_tools.micropython_image.find()
    except GhstError as error:
        pytest.fail(f"no MicroPython image to test with: {error}", pytrace=False)
