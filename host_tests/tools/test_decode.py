"""`ghst decode`: what it prints, from files, pipes and growing files."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from recordings import log_text, uplink

from ghst_tools.cli import ghst

COMMAND = [sys.executable, "-m", "ghst_tools.cli", "decode"]
CHANNELS = "820c10d8277e5c87747c7c1b1bea"
PACK = "890c239006900b7b000000000069"

TEXT = """\
byte         0  up    0x10  channels 5-8            CRC ok   \
1-4 1507.50 1510.50 1468.75 1462.50 us  5-8 1500 1500 1015 1015 us
byte        14  -           garbage                 2 bytes  00 01
byte        16  down  0x23  pack status             CRC ok   16.80 V, 29.60 A, 1230 mAh, armed
byte        30  up    0x10  channels 5-8            CRC BAD  \
82 0c 10 d8 27 7e 5c 87 74 7c 7c 1b 1b eb
byte        44  -           unfinished              2 bytes  82 0c
"""
SUMMARY = """\
2 valid frames in 46 bytes
        1  up    0x10  channels 5-8
        1  down  0x23  pack status
1 damaged frame, 2 bytes of garbage in 1 piece, 2 bytes of an unfinished frame
a receiver's counters: frames 1, crc_errors 1, length_errors 1, foreign_frames 1, skipped_bytes 16
"""
HEX = f"{CHANNELS} 00 01 {PACK} # comment\n{CHANNELS[:-2]}eb 820c\n"


def decode(*args: str, stdin: bytes = b"") -> tuple[int, str, str]:
    result = CliRunner().invoke(ghst, ["decode", *args], input=stdin)
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize("content", [HEX.encode(), bytes.fromhex(HEX.replace("# comment", ""))])
def test_a_line_for_each_piece_and_a_summary(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "recording"
    path.write_bytes(content)
    assert decode(str(path)) == (0, f"{TEXT}\n{SUMMARY}", "")
    assert decode("-", stdin=content) == (0, f"{TEXT}\n{SUMMARY}", "")
    assert decode(stdin=content) == (0, f"{TEXT}\n{SUMMARY}", "")


def test_json_has_the_summary_on_stderr() -> None:
    status, out, err = decode("--json", stdin=HEX.encode())
    assert (status, err) == (0, SUMMARY)
    objects = [json.loads(line) for line in out.splitlines()]
    assert objects[0] == {
        "t": None,
        "offset_bytes": 0,
        "addr": 0x82,
        "type": 0x10,
        "name": "channels_5_to_8",
        "crc_ok": True,
        "carries": [1, 2, 3, 4, 5, 6, 7, 8],
        "channels_us": [1507.5, 1510.5, 1468.75, 1462.5, 1500, 1500, 1015, 1015] + [None] * 8,
    }
    assert objects[1:] == [
        {
            "t": None,
            "offset_bytes": 14,
            "addr": None,
            "type": None,
            "name": "garbage",
            "crc_ok": None,
            "length_bytes": 2,
            "bytes": "0001",
        },
        {
            "t": None,
            "offset_bytes": 16,
            "addr": 0x89,
            "type": 0x23,
            "name": "pack_status",
            "crc_ok": True,
            "voltage_mv": 16800,
            "current_ma": 29600,
            "consumed_mah": 1230,
            "armed": True,
            "rx_voltage_mv": 0,
        },
        {
            "t": None,
            "offset_bytes": 30,
            "addr": 0x82,
            "type": 0x10,
            "name": "channels_5_to_8",
            "crc_ok": False,
            "length_bytes": 14,
            "bytes": f"{CHANNELS[:-2]}eb",
        },
        {
            "t": None,
            "offset_bytes": 44,
            "addr": None,
            "type": None,
            "name": "unfinished",
            "crc_ok": None,
            "length_bytes": 2,
            "bytes": "820c",
        },
    ]


def test_a_log_has_times_and_timing() -> None:
    status, out, err = decode(stdin=log_text(8).encode())
    assert (status, err) == (0, "")
    lines = out.splitlines()
    begins = [line[:16] for line in lines[:10]]
    assert begins[:5] == [
        "    0.010000 s  ",
        "    0.014000 s  ",
        "    0.018000 s  ",
        "    0.022000 s  ",
        "    0.023334 s  ",
    ]
    assert lines[-2:] == [
        "control frame to control frame: 4000 us in the median, 4000 to 4000 us, 7 measured",
        "control frame to telemetry: 1001 us in the median, 1001 to 1001 us, 2 measured",
    ]


def test_a_mistake_is_one_line() -> None:
    assert decode(stdin=b"82 0c zz") == (
        1,
        "",
        "ghst: standard input:1: 'zz' is not bytes in hexadecimal: name another format with "
        "--format, or make it a comment with #\n",
    )
    assert decode("no/such/file") == (1, "", "ghst: no/such/file: No such file or directory\n")


def test_a_reader_that_has_seen_enough_ends_it_quietly(tmp_path: Path) -> None:
    path = tmp_path / "long"
    path.write_bytes(b"".join(uplink(300)) * 100)
    running = subprocess.Popen(
        [*COMMAND, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert running.stdout and running.stderr
    assert running.stdout.readline().startswith(b"byte         0  up")
    running.stdout.close()
    assert running.stderr.read() == b""
    assert running.wait() == 0


def test_a_growing_log_is_followed_until_ctrl_c(tmp_path: Path) -> None:
    path = tmp_path / "growing.log"
    lines = log_text(3).splitlines(keepends=True)
    path.write_text("".join(lines[:4]))
    running = subprocess.Popen(
        [*COMMAND, "--follow", str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert running.stdout
    first = running.stdout.readline()
    assert first.startswith(b"    0.010000 s  up    0x11")
    with path.open("a") as file:
        file.write("".join(lines[4:])[:-10])
    assert running.stdout.readline().startswith(b"    0.014000 s  up    0x13")
    assert not select.select([running.stdout], [], [], 0)[0]
    running.send_signal(signal.SIGINT)
    rest, err = running.communicate()
    assert (running.returncode, err) == (0, b"")
    assert rest.startswith(b"\n2 valid frames in 28 bytes\n")


def test_what_comes_through_a_pipe_is_shown_at_once() -> None:
    running = subprocess.Popen(
        [*COMMAND, "--json"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert running.stdin and running.stdout
    for frame in uplink(3):
        os.write(running.stdin.fileno(), frame)
        assert json.loads(running.stdout.readline())["type"] == frame[2]
    running.stdin.close()
    assert running.wait() == 0
