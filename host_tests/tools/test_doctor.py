"""`ghst doctor`: each finding, and the emulated board with and without its firmware."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import CliRunner
from served_board import ServedBoard

import ghst
from ghst_tools import boards, device_files, filesystem, micropython_image, toolchain
from ghst_tools.doctor import board, host, interrupted, ports
from ghst_tools.doctor import run as doctor
from ghst_tools.doctor.finding import GOOD, HINT, WRONG, Finding
from ghst_tools.errors import GhstError
from ghst_tools.tool_docs import run as tool_docs

STATUS = json.loads((boards.checkout() / tool_docs.STATUS).read_text().splitlines()[0])
CONFIGURATION = {
    "problems": [],
    "size": 120,
    "restart": False,
}
NOTHING_WRONG = {"skipped_bytes": 0, "crc_errors": 0, "length_errors": 0}
WORDS = f"micropython-ghst {ghst.__version__} on rpi_pico, MicroPython 1.25.0"


@dataclass
class Port:
    """What pyserial tells of a port."""

    device: str
    vid: int | None
    pid: int = 5
    serial_number: str = "E66"
    manufacturer: str | None = "MicroPython"
    description: str = "Board in FS mode"


def told(findings: object) -> list[str]:
    return [str(finding) for finding in findings]  # type: ignore[attr-defined]


def of(
    configuration: dict[str, object] | None = None,
    status: dict[str, object] | None = None,
    words: str = WORDS,
) -> list[str]:
    """What is told of a running board that answers so."""
    answers = STATUS | (status or {}), CONFIGURATION | (configuration or {})
    lines = told(board.running("COM3", words, *answers))
    return [line.replace("COM3: ", "") for line in lines]


def test_a_board_that_is_well() -> None:
    assert of() == [
        f"ok     rpi_pico runs micropython-ghst {ghst.__version__}, MicroPython 1.25.0",
        "ok     /ghst.json is right, 120 bytes",
        f"ok     linked, LQ {STATUS['lq']} %, 0 failsafes so far",
    ]


@pytest.mark.parametrize(
    ("configuration", "status", "line"),
    [
        ({"size": None}, {}, "ok     no /ghst.json: everything as the board has it"),
        ({"restart": True}, {}, "hint   a new configuration waits: restart the board to use it"),
        (
            {"problems": [["outputs.6", "channel is 17"], ["", "x"]]},
            {},
            "WRONG  nothing moves, the configuration is broken: outputs.6 channel is 17 and 1 "
            "more: mend /ghst.json, ghst config check tells all",
        ),
        (
            {},
            {"link": "failsafe"},
            "WRONG  failsafe, no control frame comes any more: switch the radio on, or look at "
            "the wire",
        ),
        (
            {},
            {"link": "searching", "frames": 0, **NOTHING_WRONG},
            "hint   nothing has come from a receiver yet: bind it, and check the wire, see "
            "docs/troubleshooting.md",
        ),
        (
            {},
            {"link": "searching", "frames": 0, "skipped_bytes": 9},
            "WRONG  bytes come on the wire, but no frame: set the receiver's protocol to GHST, "
            "see docs/troubleshooting.md",
        ),
        (
            {},
            {"frames": 1000, "crc_errors": 11},
            "WRONG  11 CRC errors in 1000 frames: look at ground and wire, see "
            "docs/troubleshooting.md",
        ),
        (
            {},
            {"main_loop_stuck": 1, "main_loop_faults": 2},
            "WRONG  the main loop stood still 1 times, 2 faults: Enter on the console tells the "
            "last one",
        ),
        (
            {},
            {"magnetometer": {"faults": 3}},
            "hint   3 faults of the magnetometer: check its wires, or disable it in the "
            "configuration",
        ),
    ],
)
def test_what_a_running_board_tells(
    configuration: dict[str, object], status: dict[str, object], line: str
) -> None:
    lines = of(configuration, status)
    assert line in lines
    assert len([found for found in lines if not found.startswith("ok")]) == (
        0 if line.startswith("ok") else 1
    )


def test_versions_that_are_not_right() -> None:
    assert of(words=WORDS.replace(ghst.__version__, "0.0.1"))[0] == (
        "WRONG  rpi_pico runs micropython-ghst 0.0.1, MicroPython 1.25.0; these tools are "
        f"{ghst.__version__}: make flash"
    )
    lines = of(words=WORDS.replace("1.25.0", "1.24.1"))
    assert "WRONG  MicroPython 1.24.1: install 1.25 or newer" in lines
    assert of(words="")[0].startswith("WRONG  does not say what it is: ghst doctor --interrupt ")


def test_firmware_without_the_command_config() -> None:
    words = WORDS + "\nwire GP2, nothing moves: wire.pin is 99"
    lines = told(board.running("COM3", words, STATUS, None))
    assert lines[1] == (
        "WRONG  COM3: nothing moves: wire.pin is 99: mend /ghst.json, ghst config check tells all"
    )
    assert len(lines) == 3


def test_what_usb_tells(tmp_path: Path) -> None:
    device = tmp_path / "ttyACM0"
    device.touch()
    known = [
        Port(str(device), 0x2E8A),
        Port(str(device), 0x2E8A, 0x000C, manufacturer="Raspberry Pi"),
        Port(str(device), 0x0403, 0x6001, manufacturer="FTDI"),
        Port(str(device), 0x1234, 0x0001, manufacturer=None, description="a modem"),
    ]
    assert told(ports.look(known, tmp_path, tmp_path)) == [
        f"ok     {device}: a board, serial number E66 (2e8a:0005)",
        f"ok     {device}: a debug probe, no board (2e8a:000c)",
        f"ok     {device}: a FTDI USB-serial adapter: for the wire, or on an ESP32 board "
        "(0403:6001)",
        f"ok     {device}: a modem (1234:0001)",
    ]
    assert [ports.is_board(port) for port in known] == [True, False, False, False]
    assert ports.is_board(Port("", 0x303A, 0x4001, manufacturer=None))
    (nothing,) = told(ports.look([], tmp_path, tmp_path))
    assert nothing.startswith("hint   boards: none on USB: plug one in with a cable that carries")
    (tmp_path / "RPI-RP2").mkdir()
    (waiting,) = told(ports.look([], tmp_path, tmp_path))
    assert waiting == (
        "hint   drive RPI-RP2: an RP2040 that waits for a program: copy MicroPython's .uf2 file "
        "for your board to it"
    )


def test_the_one_board(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [Port("ttyUSB0", 0x0403, 0x6001, manufacturer="FTDI")]
    monkeypatch.setattr(ports, "known", lambda: found)
    with pytest.raises(GhstError, match=r"^no board found on USB: say which port with --port"):
        ports.only_board()
    found.append(Port("ttyACM0", 0x2E8A))
    assert ports.only_board() == "ttyACM0"
    found.append(Port("ttyACM1", 0x2E8A))
    with pytest.raises(GhstError, match=r"^2 boards found: .* --port: ttyACM0, ttyACM1$"):
        ports.only_board()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="groups own ports on Linux")
def test_a_port_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device = tmp_path / "ttyACM0"
    device.touch()
    # Root may do everything, and tests may be root's.
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    lines = told(ports.look([Port(str(device), 0x2E8A)], tmp_path, tmp_path))
    assert lines[1].startswith(f"WRONG  {device}: no permission: ")
    assert ports.permission_step(str(tmp_path / "none")) == (
        "add yourself to the group that owns the port"
    )
    if os.geteuid() == 0:
        os.chown(device, -1, 20)
        assert ports.permission_step(str(device)).startswith("sudo usermod -aG ")
        os.chown(device, -1, 0)
        assert "a udev rule" in ports.permission_step(str(device))


def test_what_is_missing_on_this_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def line(subject: str) -> Finding:
        return next(found for found in host.look() if found.subject == subject)

    monkeypatch.setenv(micropython_image.CACHE_VARIABLE, str(tmp_path))
    assert str(line("MicroPython")) == (
        "hint   MicroPython: no image in the cache yet: make micropython gets one"
    )
    (tmp_path / "RPI_PICO-1.25.0.uf2").touch()
    assert line("MicroPython") == Finding(
        GOOD, "MicroPython", f"image {tmp_path}/RPI_PICO-1.25.0.uf2"
    )
    assert line("packages") == Finding(GOOD, "packages", "all of the extra 'board'")
    monkeypatch.setattr(host, "_BOARD_MODULES", {"mpremote": "", "no_such_module": ""})
    assert str(line("packages")).startswith(
        "hint   packages: no_such_module missing, for flashing and the emulated board: pip install"
    )
    monkeypatch.setattr(toolchain, "missing_packages", lambda: ["cmake"])
    assert line("toolchain").level == HINT and "cmake missing" in line("toolchain").text
    monkeypatch.setattr(toolchain, "missing_packages", list)
    assert line("toolchain").level == GOOD
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert line("sigrok").step == "install one of them, then make sigrok"
    (programs / "sigrok-cli").touch(0o755)
    assert (
        str(line("sigrok")) == "hint   sigrok: sigrok-cli, without the GHST decoder: make sigrok"
    )
    (tmp_path / "libsigrokdecode" / "decoders" / "ghst").mkdir(parents=True)
    (tmp_path / "libsigrokdecode" / "decoders" / "ghst" / "pd.py").touch()
    assert line("sigrok").level == GOOD


def test_the_command_works_without_a_board(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports, "known", list)
    done = CliRunner().invoke(doctor.command, [])
    assert done.exit_code == 0
    assert f"ok     ghst: {ghst.__version__}, Python " in done.output
    done = CliRunner().invoke(doctor.command, ["--port", "/dev/ttyNONE"])
    assert done.exit_code == 1
    assert done.output.endswith("WRONG  /dev/ttyNONE: there is no such port\n")


def test_the_emulated_board(micropython_image: Path, tmp_path: Path) -> None:
    """First as its application runs, then by interrupting it, then at the prompt."""
    definition = boards.load("rpi_pico")
    names = ("battery", "gps", "barometer", "magnetometer")
    files = device_files.collect(definition)
    files["/ghst.json"] = json.dumps({name: {"enabled": False} for name in names}).encode()
    files["/main.py"] += b"\n"
    image = tmp_path / "filesystem.img"
    image.write_bytes(filesystem.build(files, definition.filesystem_size))
    served = ServedBoard(micropython_image, image)
    try:
        here = f"{served.address}: "
        lines = [line.replace(here, "") for line in told(board.look(served.address))]
        version = micropython_image.stem.partition("-")[2]
        size = len(files["/ghst.json"])
        assert [line for line in lines if line != f"ok     /ghst.json is right, {size} bytes"] == [
            f"ok     rpi_pico runs micropython-ghst {ghst.__version__}, MicroPython {version}",
            "hint   nothing has come from a receiver yet: bind it, and check the wire, see "
            "docs/troubleshooting.md",
        ]
        count = len(device_files.collect(definition))
        lines = [line.replace(here, "") for line in told(interrupted.look(served.address))]
        assert lines == [
            f"ok     Raspberry Pi Pico with RP2040, micropython {version}, .mpy files for armv6m",
            f"WRONG  1 of {count} files are missing or not those of this checkout: make flash "
            "BOARD=rpi_pico",
        ]
    finally:
        assert served.stop() == 0


def test_a_board_at_the_prompt(empty_board: ServedBoard) -> None:
    (finding,) = board.look(empty_board.address)
    assert finding.level == WRONG
    assert finding.text == "MicroPython's prompt, the application does not run"
