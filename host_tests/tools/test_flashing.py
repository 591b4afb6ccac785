"""`ghst flash`: against the emulated board, and what it says when something is wrong."""

import errno
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
import serial
import small_checkout
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo
from served_board import ServedBoard

from ghst_tools import board_link, boards, device_files, filesystem, flash, hello, serial_port
from ghst_tools.board_link import Identity
from ghst_tools.errors import GhstError

# The emulated board is as slow as the machine is busy; nothing waits this long for nothing.
PATIENCE_S = 120
HELLO = f"{small_checkout.HELLO} 42"
RPI_PICO = boards.load("rpi_pico")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return small_checkout.make(tmp_path / "checkout")


@pytest.fixture
def flashed_board(root: Path, micropython_image: Path) -> Iterator[ServedBoard]:
    """A board that runs the firmware of `root`."""
    board = ServedBoard(micropython_image, filesystem.write("rpi_pico", root))
    yield board
    assert board.stop() == 0


def run(board: ServedBoard, root: Path) -> list[str]:
    """Flash, check the hello, return what was said but for the first line."""
    said: list[str] = []
    assert flash.flash("rpi_pico", board.address, root, said.append, PATIENCE_S) == HELLO
    assert said[0].startswith(f"{board.address}: Raspberry Pi Pico with RP2040, MicroPython 1.")
    return said[1:]


def files_on(board: ServedBoard, *folders: str) -> list[str]:
    with board_link.connect(board.address) as transport:
        return sorted(
            f"{folder.rstrip('/')}/{entry.name}"
            for folder in folders
            for entry in transport.fs_listdir(folder)
        )


def test_a_new_board_gets_everything_and_starts(empty_board: ServedBoard, root: Path) -> None:
    files = device_files.collect(boards.load("rpi_pico", root), root)
    said = run(empty_board, root)
    assert said == [f"copied {path} ({len(content)} bytes)" for path, content in files.items()] + [
        "7 of 7 files copied"
    ]
    # A second time there is nothing to do.
    assert run(empty_board, root) == ["0 of 7 files copied"]


def test_only_what_differs_is_copied(flashed_board: ServedBoard, root: Path) -> None:
    (root / "lib/ghst/answer.py").write_text("ANSWER = 42  # as ever\nQUESTION = None\n")
    size = len(device_files.collect(boards.load("rpi_pico", root), root)["/lib/ghst/answer.mpy"])
    assert run(flashed_board, root) == [
        f"copied /lib/ghst/answer.mpy ({size} bytes)",
        "1 of 7 files copied",
    ]


def test_what_would_shadow_the_firmware_goes(flashed_board: ServedBoard, root: Path) -> None:
    with board_link.connect(flashed_board.address) as transport:
        for path in ("/ghst", "/lib/ghst/old"):
            transport.fs_mkdir(path)
        for path in (
            "/ghst/answer.py",
            "/firmware.py",
            "/lib/ghst/answer.py",
            "/lib/ghst/old/gone.mpy",
            "/lib/ghst/answer.mpy.new",
            "/mine.py",
            "/lib/theirs.py",
        ):
            transport.fs_writefile(path, b"ANSWER = 13\n")
    assert run(flashed_board, root) == [
        "removed /firmware.py",
        "removed /ghst/answer.py",
        "removed /lib/ghst/answer.mpy.new",
        "removed /lib/ghst/answer.py",
        "removed /lib/ghst/old/gone.mpy",
        "0 of 7 files copied",
    ]
    assert files_on(flashed_board, "/", "/lib", "/lib/ghst") == [
        "/board.json",
        "/lib",
        "/lib/firmware",
        "/lib/ghst",
        "/lib/ghst/__init__.mpy",
        "/lib/ghst/answer.mpy",
        "/lib/theirs.py",
        "/main.py",
        "/mine.py",
    ]


def test_a_board_with_an_esp32_is_flashed_the_same_way(
    empty_board: ServedBoard, root: Path
) -> None:
    # The emulated board takes its place, and gets what that one would.
    (root / "firmware/pio.py").write_text("# only on rp2\n")
    (root / "firmware/ledc.py").write_text("# only on esp32\n")
    path = root / "boards/esp32_devkit/board.json"
    text = path.read_text().replace("xtensawin", RPI_PICO.mpy_arch)
    path.write_text(text.replace("Generic ESP32 module with ESP32", RPI_PICO.machine))
    said: list[str] = []
    port = empty_board.address
    assert flash.flash("esp32_devkit", port, root, said.append, PATIENCE_S) == HELLO
    assert said[-1] == "8 of 8 files copied"
    assert files_on(empty_board, "/lib/firmware") == [
        "/lib/firmware/__init__.mpy",
        "/lib/firmware/ledc.mpy",
        "/lib/firmware/sub",
    ]


def test_a_hello_that_went_by_is_asked_for_again(flashed_board: ServedBoard) -> None:
    assert hello.wait_for_hello(flashed_board.address, PATIENCE_S) == HELLO
    # The firmware is in its loop now and says no more by itself.
    assert hello.wait_for_hello(flashed_board.address, PATIENCE_S) == HELLO


def test_a_firmware_that_fails_is_quoted(root: Path, micropython_image: Path) -> None:
    (root / "firmware/main.py").write_text("import no_such_module\n")
    board = ServedBoard(micropython_image, filesystem.write("rpi_pico", root))
    try:
        with pytest.raises(GhstError) as caught:
            hello.wait_for_hello(board.address, PATIENCE_S)
    finally:
        board.stop()
    assert str(caught.value) == (
        f"{board.address}: no hello from the firmware (it has ended): the last error "
        "it showed is ImportError: no module named 'no_such_module'"
    )


def test_a_board_that_stays_away() -> None:
    with pytest.raises(GhstError, match=r"^/dev/ttyNONE: the board did not come back within 0 s$"):
        hello.wait_for_hello("/dev/ttyNONE", timeout_s=0.2)


def test_nothing_is_copied_to_another_board(empty_board: ServedBoard, root: Path) -> None:
    path = root / "boards/rpi_pico/board.json"
    path.write_text(path.read_text().replace("armv6m", "armv7emsp"))
    said: list[str] = []
    with pytest.raises(GhstError) as caught:
        flash.flash("rpi_pico", empty_board.address, root, said.append)
    assert str(caught.value) == (
        "the board (Raspberry Pi Pico with RP2040) has architecture armv6m, rpi_pico has "
        "armv7emsp: check --board (make: BOARD=...)"
    )
    assert said == []
    assert files_on(empty_board, "/") == []


PICO = "Raspberry Pi Pico with RP2040"


@pytest.mark.parametrize(
    ("identity", "message"),
    [
        (
            Identity("micropython", (1, 24, 1), PICO, 4870),
            "the board runs MicroPython 1.24.1: install 1.25 or later on it",
        ),
        (
            Identity("circuitpython", (9, 2, 1), PICO, 517),
            "the board runs circuitpython 9.2.1: install MicroPython on it",
        ),
        (
            Identity("micropython", (1, 28, 0), "Raspberry Pi Pico2 with RP2350", 7942),
            "the board (Raspberry Pi Pico2 with RP2350) has architecture armv7emsp, rpi_pico has "
            "armv6m: check --board (make: BOARD=...)",
        ),
        (
            Identity("micropython", (1, 28, 0), "Waveshare RP2040-Plus with RP2040", 4870),
            "the board says it is a 'Waveshare RP2040-Plus with RP2040', rpi_pico is a "
            "'Raspberry Pi Pico with RP2040': check --board (make: BOARD=...) and its MicroPython "
            "image",
        ),
        (
            Identity("micropython", (1, 28, 0), "Raspberry Pi Pico W with RP2040", 4870),
            "the board says it is a 'Raspberry Pi Pico W with RP2040': there is no board "
            "definition for it yet: use a board of docs/boards.md",
        ),
        (
            Identity("micropython", (1, 28, 0), "Raspberry Pi Pico 2 W with RP2350", 7942),
            "the board says it is a 'Raspberry Pi Pico 2 W with RP2350': there is no board "
            "definition for it yet: use a board of docs/boards.md",
        ),
    ],
)
def test_a_board_that_does_not_fit_is_named(identity: Identity, message: str) -> None:
    with pytest.raises(GhstError) as caught:
        identity.check(boards.load("rpi_pico"))
    assert str(caught.value) == message


@pytest.mark.parametrize("version", [(1, 25, 0), (1, 26, 1), (1, 28, 0), (2, 0, 0)])
def test_a_board_that_fits_passes(version: tuple[int, ...]) -> None:
    Identity("micropython", version, PICO, 4870).check(boards.load("rpi_pico"))
    # 1.28 may set a flag above the architecture's bits.
    Identity("micropython", version, PICO, 4870 | 1 << 14).check(boards.load("rpi_pico"))


def port(device: str, vid: int | None, pid: int = 5, number: str = "E66") -> ListPortInfo:
    info = ListPortInfo(device)
    info.vid, info.pid, info.serial_number = vid, pid, number
    return info


OTHERS = [port("/dev/ttyS0", None), port("/dev/ttyACM8", 0x2E8A, 0x000C), port("/dev/x", 0x0403)]


def test_the_one_board_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(list_ports, "comports", lambda: [*OTHERS, port("/dev/ttyACM0", 0x2E8A)])
    assert board_link.find_port(RPI_PICO) == "/dev/ttyACM0"


def test_a_board_with_an_esp32_is_found_behind_its_bridge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for vid in (0x10C4, 0x1A86, 0x303A):
        ports = [*OTHERS, port("/dev/ttyACM0", 0x2E8A), port("/dev/ttyUSB0", vid)]
        monkeypatch.setattr(list_ports, "comports", lambda ports=ports: ports)
        assert board_link.find_port(boards.load("esp32_devkit")) == "/dev/ttyUSB0"
        assert board_link.find_port(RPI_PICO) == "/dev/ttyACM0"


def test_no_board_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(list_ports, "comports", lambda: OTHERS)
    with pytest.raises(GhstError) as caught:
        board_link.find_port(RPI_PICO)
    assert str(caught.value) == (
        "no board found on USB: plug one in that runs MicroPython, or say which port with --port "
        "(make: PORT=...)"
    )


def test_two_boards_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [port("/dev/ttyACM0", 0x2E8A), port("/dev/ttyACM1", 0x2E8A, number="E67")]
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    with pytest.raises(GhstError) as caught:
        board_link.find_port(RPI_PICO)
    assert str(caught.value) == (
        "2 boards found: /dev/ttyACM0 (serial number E66), /dev/ttyACM1 (serial number E67): "
        "say which with --port (make: PORT=...)"
    )


def test_a_port_that_another_program_holds_is_busy() -> None:
    terminal, line = os.openpty()
    name = os.ttyname(line)
    fcntl.flock(line, fcntl.LOCK_EX)
    try:
        with pytest.raises(GhstError) as caught:
            serial_port.open_port(name)
    finally:
        os.close(line)
        os.close(terminal)
    assert str(caught.value) == (
        f"{name}: busy: close the program that has it open (mpremote, Thonny)"
    )


def test_a_port_that_is_not_there() -> None:
    with pytest.raises(GhstError, match=r"^/dev/ttyNONE: there is no such port$"):
        serial_port.open_port("/dev/ttyNONE")


def test_a_port_without_permission() -> None:
    error = serial.SerialException(errno.EACCES, "could not open port")
    assert str(serial_port.explain("/dev/ttyACM0", error)) == (
        "/dev/ttyACM0: no permission: add yourself to the group that owns the port"
    )


def test_an_address_where_nothing_listens() -> None:
    with pytest.raises(GhstError, match=r"^socket://127\.0\.0\.1:1: cannot be opened: .*refused"):
        serial_port.open_port("socket://127.0.0.1:1")


@pytest.mark.parametrize("address", ["127.0.0.1:99999", "127.0.0.1:x", "127.0.0.1", ":1234", ""])
def test_an_address_that_is_none(address: str) -> None:
    with pytest.raises(GhstError) as caught:
        serial_port.open_port(f"socket://{address}")
    assert str(caught.value) == (
        f"socket://{address}: must be socket://HOST:PORT with a PORT of 1..65535"
    )


def test_a_second_client_is_told_so(empty_board: ServedBoard) -> None:
    first = serial_port.open_port(empty_board.address)
    try:
        with (
            pytest.raises(GhstError, match="no MicroPython prompt there: another program has it"),
            board_link.connect(empty_board.address),
        ):
            pass
    finally:
        first.close()
