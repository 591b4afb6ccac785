"""`ghst selftest`: over a port, and what it says when something stands in its way."""

import io
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console
from served_board import ServedBoard

from ghst import encode
from ghst_tools import board_link, boards, filesystem, uart_bits
from ghst_tools.cli import ghst
from ghst_tools.errors import GhstError
from ghst_tools.selftest import load, report, session, transmissions
from ghst_tools.selftest.result import Result, Verdict
from ghst_tools.selftest.session import BoardSession

VERSION = "micropython-ghst 0.1.0 on rpi_pico, MicroPython 1."
INTO_RESET = """
import machine
machine.WDT(timeout=50)
while True:
    pass
"""


@pytest.fixture(scope="module")
def board(
    micropython_image: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ServedBoard]:
    """A board with the firmware of this tree, and nothing tied."""
    image = filesystem.write("rpi_pico", output=tmp_path_factory.mktemp("board") / "fs.img")
    served = ServedBoard(micropython_image, image)
    yield served
    assert served.stop() == 0


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """The emulated board is as slow as the machine is busy."""
    monkeypatch.setattr(session, "HELLO_TIMEOUT_S", 600.0)


def invoke(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(ghst, ["selftest", *arguments])
    return result.exit_code, result.stdout, result.stderr


def test_a_board_on_a_port_is_tested_and_runs_its_firmware_again(board: ServedBoard) -> None:
    status, output, errors = invoke("--port", board.address, "--yes", "--json")
    assert errors.startswith(VERSION) and errors.count("\n") == 1
    found = json.loads(output)
    assert (status, found["board"], found["passed"]) == (1, "rpi_pico", False)
    verdicts = {row["check"]: row["verdict"] for row in found["checks"]}
    assert verdicts["jumper"] == "wiring"
    assert [verdicts[name] for name in ("ADC: GP26", "I2C: lines", "I2C: scan")] == ["ok"] * 3
    assert verdicts["servos"] == verdicts["watchdog"] == "skipped"
    assert found["checks"][0]["hint"] == (
        "GP2 and GP3 are not tied: see docs/img/selftest_rpi_pico.svg"
    )


def test_a_session_goes_on_behind_a_reset_by_the_watchdog(board: ServedBoard) -> None:
    with BoardSession(board.address) as board_session:
        board_session.forget()
        said = board_session.run_into_reset(INTO_RESET)
        assert said is not None and said.startswith(VERSION)
        assert said.splitlines()[-1] == "restarted by the watchdog"
        assert board_session.run("print(6 * 7)").strip() == "42"
        assert board_session.run_into_reset("print('still here')") is None
        with pytest.raises(GhstError, match=r"the self-test failed on the board: ValueError: x$"):
            board_session.run("raise ValueError('x')")


def test_another_firmware_is_not_tested(board: ServedBoard) -> None:
    with board_link.connect(board.address) as transport:
        transport.fs_writefile("/lib/firmware/adapter.mpy", b"M\x06")
    status, output, errors = invoke("--port", board.address, "--yes")
    assert (status, output) == (1, "")
    assert errors == (
        f"ghst: {board.address}: the firmware on the board is not that of this checkout (1 files "
        "differ, such as /lib/firmware/adapter.mpy): make flash BOARD=rpi_pico "
        f"PORT={board.address}\n"
    )


def test_a_board_without_pio_is_refused() -> None:
    assert invoke("--board", "esp32_devkit", "--yes") == (
        1,
        "",
        "ghst: esp32_devkit: the self-test plays the receiver by PIO, which the ESP32 has not: "
        "only boards with an RP2040 or RP2350 can test themselves\n",
    )


def test_nothing_moves_before_the_user_has_said_so() -> None:
    status, output, errors = invoke("--port", "/dev/null")
    assert (status, output) == (1, "")
    assert errors == (
        "ghst: the servo pins will give pulses: say --yes when nothing is connected to them\n"
    )


def test_the_table_sums_up() -> None:
    rows = [
        Result("one", "1", "1", Verdict.OK),
        Result("two", "2", "3", Verdict.FAILED, "look at it"),
        Result("three", "-", "-", Verdict.SKIPPED),
    ]
    console = Console(width=60, record=True, file=io.StringIO())
    console.print(report.table(boards.load("rpi_pico"), rows))
    lines = console.export_text().splitlines()
    assert lines[0].strip() == "Self-test of the Raspberry Pi Pico"
    assert next(line.split() for line in lines if "two" in line) == [
        "│", "two", "│", "2", "│", "3", "│", "failed", "│",
    ]  # fmt: skip
    assert lines[-2:] == ["two: look at it", "1 ok, 1 failed, 1 skipped"]
    assert not report.passed(rows) and report.passed(rows[:1])


def test_a_transmission_is_the_number_of_bits_and_the_bits() -> None:
    # 12 bits of idle, then start bit, the lowest bit first, stop bit.
    bits = "111111111111" + "0101010101" + "0111111111"
    words = (31).to_bytes(4, "little") + int(bits[::-1], 2).to_bytes(4, "little")
    assert transmissions.of_frame(b"\x55\xff") == words.hex()
    broken = bits[:21] + "0" + bits[22:]
    words = (31).to_bytes(4, "little") + int(broken[::-1], 2).to_bytes(4, "little")
    assert transmissions.of_frame(b"\x55\xff", broken_stop_bit=0) == words.hex()
    noise = bytes.fromhex(transmissions.of_noise(1))
    assert noise[:4] == (639).to_bytes(4, "little") and len(noise) == 4 + 640 // 8
    assert noise[-1] == 0xFF


@pytest.mark.parametrize("name", [b.name for b in boards.load_all() if b.selftest_pin is not None])
def test_its_modules_are_made_for_every_board_with_pio(name: str) -> None:
    arch = boards.load(name).mpy_arch
    for module in (*load.MODULES, *load.BENCH_MODULES):
        content = load.compiled(module, arch)
        # Bytecode alone, version 6: the same for both chips.
        assert content[:3] == b"M\x06\x00"


@pytest.mark.parametrize("late_us", [0.0, 100.0])
def test_a_recording_tells_what_was_sent_when(late_us: float) -> None:
    control, telemetry = encode.channels(0x10, [1984] * 4, [124] * 4), bytes(range(14))
    edges, end_ns = uart_bits.encode(control, 50_000.0, 420_000)
    edges += uart_bits.encode(telemetry, end_ns + 1e6 + 1e3 * late_us, 420_000)[0]
    period_ns = 256.0
    samples = bytearray()
    level = True
    for at in range(0, 8064, 8):
        byte = 0
        for index in range(8):
            while edges and edges[0][0] <= (at + index) * period_ns:
                level = edges.pop(0)[1]
            byte |= level << index
        samples.append(byte)
    heard = transmissions.read(samples.hex(), 125_000_000)
    assert (heard.control, heard.telemetry, heard.framing_ok) == (control, telemetry, True)
    assert heard.start_us == pytest.approx(1000 + late_us, abs=0.256)
    silent = transmissions.read((samples[:300] + b"\xff" * 700).hex(), 125_000_000)
    assert (silent.control, silent.telemetry, silent.start_us) == (control, b"", None)
