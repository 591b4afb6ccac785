"""What runs on a board, asked on its console; the application goes on."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from ghst import __version__  # type: ignore[import-not-found]
from ghst_tools.board_console import ANSWER_S, BoardConsole, NoApplicationError
from ghst_tools.board_link import OLDEST_MICROPYTHON
from ghst_tools.doctor.finding import GOOD, HINT, WRONG, Finding
from ghst_tools.errors import GhstError
from ghst_tools.serial_port import is_network

_HELLO = re.compile(r"^micropython-ghst (\S+) on (\S+), MicroPython (\d+(?:\.\d+)+)", re.MULTILINE)
_BROKEN = re.compile(r"nothing moves: (.*)")
_EMULATED_S = 600.0
_HELLO_S = 2.0
_LOOK_INSIDE = "ghst doctor --interrupt looks into it, and stops what runs there meanwhile"
_MEND = "mend /ghst.json, ghst config check tells all"
_DOCUMENT = "docs/troubleshooting.md"
# More than one in a hundred frames is no accident any more.
_CRC_SHARE = 0.01


def look(port: str) -> Iterator[Finding]:
    """Findings about the board at `port`; what cannot be asked is a finding, too."""
    patience_s = _EMULATED_S if is_network(port) else ANSWER_S
    lines: list[str] = []
    try:
        with BoardConsole(port, lines.append) as console:
            status = console.ask("status", "status", patience_s)
            configuration = _asked_for_configuration(console, patience_s)
            console.send("")
            # Its answer in words ends with this line.
            while not any(line.startswith("main loop: stood still ") for line in lines):
                line = console.read_line(patience_s if is_network(port) else _HELLO_S)
                if line is None:
                    break
                lines.append(line)
    except NoApplicationError:
        yield Finding(
            WRONG,
            port,
            "MicroPython's prompt, the application does not run",
            "Ctrl-D there starts it (mpremote); if that does not help: make flash",
        )
    except GhstError as error:
        text = str(error).removeprefix(f"{port}: ")
        what, _, step = text.rpartition(": ")
        if "no answer" in text:
            what, step = "does not answer as micropython-ghst does", _LOOK_INSIDE
        yield Finding(WRONG, port, what or text, step if what else "")
    else:
        yield from running(port, "\n".join(lines), status, configuration)


def _asked_for_configuration(console: BoardConsole, patience_s: float) -> dict[str, Any] | None:
    """The board's answer to `config`; None from a board that has no such command."""
    try:
        return console.ask("config", "config", patience_s)
    except GhstError as error:
        if "does not know" in str(error):
            return None
        raise


def running(
    port: str, words: str, status: dict[str, Any], configuration: dict[str, Any] | None
) -> Iterator[Finding]:
    """Findings from the answers of an application: to Enter, to `status`, and to `config`."""
    hello = _HELLO.search(words)
    if hello:
        version, board, micropython = hello.groups()
        text = f"{board} runs micropython-ghst {version}, MicroPython {micropython}"
        if version != __version__:
            yield Finding(WRONG, port, f"{text}; these tools are {__version__}", "make flash")
        else:
            yield Finding(GOOD, port, text)
        if tuple(map(int, micropython.split("."))) < OLDEST_MICROPYTHON:
            oldest = ".".join(map(str, OLDEST_MICROPYTHON))
            yield Finding(WRONG, port, f"MicroPython {micropython}", f"install {oldest} or newer")
    else:
        yield Finding(WRONG, port, "does not say what it is", _LOOK_INSIDE)
    if configuration is not None:
        yield from _configuration(port, configuration)
    elif broken := _BROKEN.search(words):
        yield Finding(WRONG, port, f"nothing moves: {broken[1]}", _MEND)
    yield from _link(port, status)
    if status["main_loop_stuck"] or status["main_loop_faults"]:
        text = f"the main loop stood still {status['main_loop_stuck']} times, "
        text += f"{status['main_loop_faults']} faults"
        yield Finding(WRONG, port, text, "Enter on the console tells the last one")
    for name, values in status.items():
        if isinstance(values, dict) and name != "outputs_us" and values["faults"]:
            text = f"{values['faults']} faults of the {name}"
            yield Finding(HINT, port, text, "check its wires, or disable it in the configuration")


def _configuration(port: str, configuration: dict[str, Any]) -> Iterator[Finding]:
    problems = configuration["problems"]
    if problems:
        first = problems[0]
        told = first if isinstance(first, str) else " ".join(filter(None, first))
        more = f" and {len(problems) - 1} more" if len(problems) > 1 else ""
        text = f"nothing moves, the configuration is broken: {told}{more}"
        yield Finding(WRONG, port, text, _MEND)
    elif configuration["size"] is None:
        yield Finding(GOOD, port, "no /ghst.json: everything as the board has it")
    else:
        yield Finding(GOOD, port, f"/ghst.json is right, {configuration['size']} bytes")
    if configuration["restart"]:
        yield Finding(HINT, port, "a new configuration waits", "restart the board to use it")


def _link(port: str, status: dict[str, Any]) -> Iterator[Finding]:
    link, frames = status["link"], status["frames"]
    heard = any(status[key] for key in ("skipped_bytes", "crc_errors", "length_errors"))
    if link == "linked":
        quality = f", LQ {status['lq']} %" if status["rf_mode"] else ""
        yield Finding(GOOD, port, f"linked{quality}, {status['failsafes']} failsafes so far")
    elif link == "failsafe":
        text = "failsafe, no control frame comes any more"
        yield Finding(WRONG, port, text, "switch the radio on, or look at the wire")
    elif heard:
        text = "bytes come on the wire, but no frame"
        step = f"set the receiver's protocol to GHST, see {_DOCUMENT}"
        yield Finding(WRONG, port, text, step)
    else:
        text = "nothing has come from a receiver yet"
        yield Finding(HINT, port, text, f"bind it, and check the wire, see {_DOCUMENT}")
    if status["crc_errors"] > _CRC_SHARE * max(1, frames) and frames:
        text = f"{status['crc_errors']} CRC errors in {frames} frames"
        yield Finding(WRONG, port, text, f"look at ground and wire, see {_DOCUMENT}")
