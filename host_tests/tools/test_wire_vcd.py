"""`ghst vcd`: the bits of a log."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from recordings import FRAME_S, log_text, pack, reads, uplink

from ghst_tools import uart_bits, wire_vcd
from ghst_tools.cli import ghst
from ghst_tools.errors import GhstError
from ghst_tools.frames.formats import Source
from ghst_tools.frames.recording import Recording, load


def recording(tmp_path: Path, text: str) -> Recording:
    path = tmp_path / "flight.log"
    path.write_text(text)
    return load(Source(path))


def test_the_bits_are_those_of_the_bytes(tmp_path: Path) -> None:
    found, start_ns, end_ns = wire_vcd.changes(recording(tmp_path, log_text(8)))
    wire = [(t_ns, bool(level)) for t_ns, signal, level in found if signal == 0]
    octets = uart_bits.decode(wire[1:], 420000, end_ns)
    assert bytes(octet.value for octet in octets) == b"".join(data for _, data in reads(8))
    assert all(octet.framing_ok for octet in octets)
    ends_s = [(octet.t_ns + 1e10 / 420000) / 1e9 for octet in octets]
    # The times of a log are whole microseconds.
    assert ends_s[13::14] == pytest.approx([time_s for time_s, _ in reads(8)], abs=0.6e-6)
    assert wire[0] == (start_ns, True)
    assert start_ns == pytest.approx(0.01e9 - 100e3, abs=600)
    down = [(t_ns / 1e9, level) for t_ns, signal, level in found if signal == 1]
    begins_s = [time_s - FRAME_S for time_s, data in reads(8) if data[0] == 0x89]
    assert [level for _, level in down] == [0, 1, 0, 1, 0]
    assert [t_s for t_s, _ in down[1::2]] == pytest.approx(begins_s, abs=0.6e-6)
    assert [t_s for t_s, _ in down[2::2]] == pytest.approx(
        [begin_s + FRAME_S for begin_s in begins_s], abs=0.6e-6
    )
    times = [t_ns for t_ns, _, _ in found]
    assert times == sorted(times)


def test_a_part_of_a_log(tmp_path: Path) -> None:
    whole = recording(tmp_path, log_text(8))
    found, _, end_ns = wire_vcd.changes(whole, 0.013, 0.004)
    wire = [(t_ns, bool(level)) for t_ns, signal, level in found if signal == 0]
    octets = uart_bits.decode(wire[1:], 420000, end_ns)
    assert bytes(octet.value for octet in octets) == uplink(2)[1]
    with pytest.raises(GhstError, match=r"flight\.log: nothing was on the wire in that time$"):
        wire_vcd.changes(whole, 1.0)


def test_bytes_of_one_read_come_back_to_back_and_never_at_once(tmp_path: Path) -> None:
    # 28 bytes that were there 100 us after one, which is impossible: they come after it.
    both = (uplink(1)[0] + pack(1)).hex()
    text = f"# ghst log 1\n0.001 55\n0.0011 {both}\n"
    found, _, end_ns = wire_vcd.changes(recording(tmp_path, text))
    wire = [(t_ns, bool(level)) for t_ns, signal, level in found if signal == 0]
    octets = uart_bits.decode(wire[1:], 420000, end_ns)
    assert bytes(octet.value for octet in octets) == b"\x55" + uplink(1)[0] + pack(1)
    assert octets[1].t_ns == pytest.approx(1e6, abs=1)


def test_the_command(tmp_path: Path) -> None:
    path, out = tmp_path / "flight.log", tmp_path / "flight.vcd"
    path.write_text(log_text(2))
    result = CliRunner().invoke(ghst, ["vcd", str(path), "-o", str(out)])
    assert (result.exit_code, result.stdout) == (
        0,
        f"{out}: 0.004533 s, from 0.009900 s of the log on\n",
    )
    lines = out.read_text().splitlines()
    assert lines[:6] == [
        "$timescale 100 ns $end",
        "$version micropython-ghst $end",
        "$scope module log $end",
        "$var wire 1 ! wire $end",
        '$var wire 1 " downlink $end',
        "$upscope $end",
    ]
    # 100 us idle, the start bit of 0x82, whose bit 1 is high.
    assert " ".join(lines[7:19]) == '#0 $dumpvars 1! 0" $end #1000 0! #1048 1! #1071 0! #1190'


def test_a_recording_without_times_has_no_bits(tmp_path: Path) -> None:
    path, out = tmp_path / "raw", tmp_path / "out.vcd"
    path.write_bytes(uplink(1)[0])
    out.write_text("mine")
    result = CliRunner().invoke(ghst, ["vcd", str(path), "-o", str(out)])
    assert (result.exit_code, result.stderr) == (
        1,
        f"ghst: {path}: has no times: only a log of `ghst sniff` has them\n",
    )
    assert out.read_text() == "mine"
