"""docs/troubleshooting.md: what it claims of our own behaviour is what the code does."""

from __future__ import annotations

import re

from ghst.rf_modes import RF_MODES
from ghst_tools import boards, cli

ROOT = boards.checkout()
DOCUMENT = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
TEXT = " ".join(DOCUMENT.split())
INTERRUPTS = (ROOT / "firmware" / "interrupts.py").read_text(encoding="utf-8")
STATES = {
    "searching": "SEARCHING",
    "linked": "LINKED",
    "failsafe": "FAILSAFE",
    "the main loop": "STUCK",
    "the configuration": "BROKEN",
}


def constant(name: str, source: str = INTERRUPTS) -> int:
    found = re.search(rf"^{name} = const\((\w+)\)", source, re.MULTILINE)
    assert found, name
    return int(found[1], 0)


def test_the_led_patterns_are_those_of_the_code() -> None:
    rows = re.findall(r"^\| [a-z ]+ \| `([#-]{16})` \| (.+?) \|$", DOCUMENT, re.MULTILINE)
    shown = {}
    for units, state in rows:
        name = next(name for begin, name in STATES.items() if state.startswith(begin))
        # The lowest bit comes first.
        shown[name] = sum(1 << bit for bit, unit in enumerate(units) if unit == "#")
    in_code = dict(re.findall(r"^_LED_(\w+) = const\((0x\w+)\)$", INTERRUPTS, re.MULTILINE))
    assert shown == {name: int(value, 16) for name, value in in_code.items()}
    # One bit is eight ticks of 10 ms.
    assert "(ticks >> 3) & 15" in INTERRUPTS
    control = (ROOT / "firmware" / "control.py").read_text(encoding="utf-8")
    assert 16 * 8 * constant("_TICK_MS", control.replace("10\n", "const(10)\n")) == 1280
    assert "takes 1.28 s; a unit is 0.08 s" in TEXT


def test_rf_modes_and_their_rates() -> None:
    without = [name for name, _, downlink in RF_MODES.values() if not downlink]
    assert f"{', '.join(without[:-1])} and {without[-1]} have no way back" in TEXT
    rates: dict[int, list[str]] = {}
    for name, rate_hz, _ in sorted(RF_MODES.values(), key=lambda mode: mode[1]):
        rates.setdefault(rate_hz, []).append(name)
    sentence = TEXT.partition("whether frames get lost: ")[2].partition(". ")[0]
    for rate_hz, names in rates.items():
        assert re.search(rf"\b{rate_hz} (a second )?in ", sentence)
        for name in names:
            assert name in sentence


def test_figures_of_the_firmware() -> None:
    adapter = (ROOT / "firmware" / "adapter.py").read_text(encoding="utf-8")
    assert "MINIMUM_FAILSAFE_MS = 110\n" in adapter and "no less than 110 ms" in TEXT
    assert "failsafe_ms=500," in adapter and "500 by default" in TEXT
    monitor = (ROOT / "tools" / "ghst_tools" / "monitor" / "panels.py").read_text("utf-8")
    for words in ("frames of a weak link", "without a slot", "armed", "none in "):
        assert words in monitor and words in TEXT.lower().replace("w without", "without")


def test_commands_and_links_are_there() -> None:
    for name in re.findall(r"`ghst ([a-z-]+)", DOCUMENT):
        assert name in cli.COMMANDS
    for target in re.findall(r"\]\(([^)#]+)", DOCUMENT):
        assert (ROOT / "docs" / target).exists(), target
