"""docs/tools.md: its outputs are what its commands print."""

from __future__ import annotations

import re
import shutil

import pytest

from ghst_tools import boards, cli
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import load
from ghst_tools.tool_docs import examples, run

ROOT = boards.checkout()
DOCUMENT = (ROOT / run.DOCUMENT).read_text(encoding="utf-8")


@pytest.mark.skipif(shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed")
def test_the_examples_print_what_the_document_says() -> None:
    rendered = run.render(DOCUMENT)
    assert examples.without_measurements(rendered).splitlines() == (
        examples.without_measurements(DOCUMENT).splitlines()
    ), "run 'ghst docs-tools'"
    # What differs in the rest is measured, and these end well.
    for ending in (
        r"^log: new\.log$",
        r"^sent 99 frames to ttyUSB1, the latest \d+ us late$",
        r"^MSP 1 api_version: protocol 0, API 1\.44$",
        r"^slot: \d+ us in the median, ",
    ):
        assert re.search(ending, rendered, re.MULTILINE)


def test_each_tool_has_an_example() -> None:
    text = "\n".join(examples.commands(DOCUMENT))
    for name in (
        "doctor",
        "monitor",
        "decode",
        "sniff",
        "simulate",
        "replay",
        "plot",
        "vcd",
        "completion",
    ):
        assert name in cli.COMMANDS
        assert f"ghst {name} " in text
    assert "sigrok-cli " in text


def test_the_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", DOCUMENT):
        assert (ROOT / "docs" / target).exists(), target
    headings = {
        re.sub(r"[^a-z0-9 -]", "", line.lstrip("# ").lower()).replace(" ", "-")
        for line in DOCUMENT.splitlines()
        if line.startswith("#")
    }
    assert set(re.findall(r"\]\(#([^)]+)\)", DOCUMENT)) <= headings


def test_the_recording_is_of_the_firmware_in_its_slots() -> None:
    recording = load(Source(ROOT / run.RECORDING))
    assert len(recording.timing.slots_us) == 16
    # Whole microseconds, at the end of each read.
    assert min(recording.timing.slots_us) > 999.0 and max(recording.timing.slots_us) < 1001.5
    assert recording.timing.slots_unknown == recording.timing.intervals_unknown == 0


def test_only_what_was_measured_may_differ() -> None:
    def block(marker: str, output: str) -> str:
        return f"{marker}```console\n$ x\n{output}\n```\n"

    marker = "<!-- measured -->\n"
    same = examples.without_measurements(block(marker, "1.5 us"))
    assert same == examples.without_measurements(block(marker, "22 us\nand more"))
    assert block("", "1.5 us") == examples.without_measurements(block("", "1.5 us"))
    assert examples.render(block("", "1.5 us"), lambda command: "2 us\n") == block("", "2 us")
