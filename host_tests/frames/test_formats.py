"""Files: which format they have, and what is said when they are not what they should be."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest

from ghst_tools import captures
from ghst_tools.errors import GhstError
from ghst_tools.frames import formats
from ghst_tools.frames.blocks import Block, Parser
from ghst_tools.frames.formats import Source, detect
from ghst_tools.frames.hex_text import HexParser
from ghst_tools.frames.log import LogParser, header, line

FRAME = bytes.fromhex("820c10d8277e5c87747c7c1b1bea")
LOG = b"# ghst log 1\n# 115200 baud, /dev/ttyUSB0, 2026-01-01T00:00:00+00:00\n"


@pytest.mark.parametrize(
    ("content", "format"),
    [
        (FRAME, "raw"),
        (b"", "hex"),
        (b"82 0c", "hex"),
        (b"# \xc2\xb5s and \xc3\xbcml\xc3\xa4uts\n82 0c\n", "hex"),
        (b"\xef\xbb\xbf82 0c\n", "hex"),
        (b"# caf\xe9 in Latin-1\n82 0c\n", "raw"),
        (b"82 0c\x00", "raw"),
        (b"8" * 4095 + b"\xc3\xa4", "hex"),
        (b"8" * 4096 + b"\x00", "hex"),
        (LOG, "log"),
        (b"# ghst log 7\n", "log"),
        (b"\n# ghst log 1\n", "hex"),
        (b"About\n-----\nINPUT 0x82, \n", "px4"),
        (b"About INPUT \n-----\n", "hex"),
    ],
)
def test_formats_are_told_apart(content: bytes, format: str) -> None:
    assert detect(content) == format


def test_an_address_is_never_valid_text() -> None:
    for address in range(0x80, 0x8A):
        for length in range(2, 13):
            assert detect(bytes((address, length))) == "raw"


def fed(parser: Parser, content: bytes, size: int) -> list[Block]:
    chunks = [content[at : at + size] for at in range(0, len(content), size)]
    return [parser.feed(chunk) for chunk in chunks] + [parser.finish()]


@pytest.mark.parametrize(
    "text",
    [
        "82 0c 10 d8",
        "820C10D8",
        "0x82, 0x0c, 0x10, 0xd8",
        "0x820c10d8;",
        "0x82 0xc 0X10 0xD8",
        "82:0c:10:d8\r\n",
        "# a comment\n82 c # another 99\n10\n\nd8",
    ],
)
@pytest.mark.parametrize("size", [1, 5, 1000])
def test_hexadecimal(text: str, size: int) -> None:
    blocks = fed(HexParser("x"), text.encode(), size)
    assert b"".join(block.data for block in blocks) == bytes.fromhex("820c10d8")
    assert all(block.reads is None for block in blocks)


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("82 0g", "x:1: '0g' is"),
        ("82\n82 123", "x:2: '123' is"),
        ("82\n\n# no\nµ", "x:4: 'µ' is"),
        ("82\n0x", "x:2: '0x' is"),
    ],
)
@pytest.mark.parametrize("size", [1, 1000])
def test_what_is_not_hexadecimal_is_named(text: str, where: str, size: int) -> None:
    with pytest.raises(GhstError) as caught:
        fed(HexParser("x"), text.encode(), size)
    assert str(caught.value).startswith(where)


@pytest.mark.parametrize("size", [1, 7, 1000])
def test_a_log(size: int) -> None:
    content = LOG + b"# a comment\r\n0.001000 820c\r\n\n  0.5 10\n7 " + FRAME.hex().encode()
    parser = LogParser("x")
    blocks = fed(parser, content, size)
    assert parser.baud == (115200 if size > 100 else 420000)
    assert b"".join(block.data for block in blocks) == b"\x82\x0c\x10" + FRAME
    ends, times, length = [], [], 0
    for block in blocks:
        assert block.reads is not None
        ends += (block.reads.ends + length).tolist()
        times += block.reads.times_s.tolist()
        length += len(block.data)
    assert ends == [2, 3, 17]
    assert times == [0.001, 0.5, 7.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.1 82\n0.2 820\n", "x:2: not a time in seconds and bytes in hexadecimal"),
        ("0.1 82\n\n0.2\n", "x:3: not a time in seconds and bytes in hexadecimal"),
        ("0.1 82 0c\n", "x:1: not a time in seconds and bytes in hexadecimal"),
        ("soon 82\n", "x:1: not a time in seconds and bytes in hexadecimal"),
        ("nan 82\n", "x:1: not a time in seconds and bytes in hexadecimal"),
        ("82\n0.1 82 0.2\n", "x:1: not a time in seconds and bytes in hexadecimal"),
        (
            "0.1 82\n0.05 0c\n",
            "x:2: the time goes back, from 0.100000 to 0.05: is this more than one recording?",
        ),
        ("# ghst log 2\n", "x: a log of version 2, this ghst reads version 1: use the ghst that"),
    ],
)
def test_what_is_wrong_with_a_log(text: str, message: str) -> None:
    with pytest.raises(GhstError) as caught:
        fed(LogParser("x"), text.encode(), 1000)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("cut", [b"0.2", b"0.2 82f", b"0."])
def test_a_last_line_that_was_cut_off_is_left_out(cut: bytes) -> None:
    blocks = fed(LogParser("x"), b"0.1 82\n" + cut, 1000)
    assert b"".join(block.data for block in blocks) == b"\x82"


def test_what_is_written_is_read(tmp_path: Path) -> None:
    begun = datetime.datetime(2026, 5, 1, 12, tzinfo=datetime.UTC)
    text = header("/dev/ttyUSB0", begun, 400000) + line(0.25, b"\x82") + line(12.5, FRAME)
    assert text == (
        "# ghst log 1\n"
        "# 400000 baud, /dev/ttyUSB0, 2026-05-01T12:00:00+00:00\n"
        "# seconds since the beginning, when the last byte was there; the bytes of one read\n"
        "0.250000 82\n"
        "12.500000 820c10d8277e5c87747c7c1b1bea\n"
    )
    path = tmp_path / "x.log"
    path.write_text(text)
    source = Source(path)
    blocks = list(source.blocks())
    assert (source.format, source.baud) == ("log", 400000)
    assert b"".join(block.data for block in blocks) == b"\x82" + FRAME


def test_the_format_can_be_forced(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"82 0c\n")
    assert b"".join(block.data for block in Source(path, "raw").blocks()) == b"82 0c\n"
    assert b"".join(block.data for block in Source(path).blocks()) == b"\x82\x0c"


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(GhstError, match=r"none: No such file or directory$"):
        list(Source(tmp_path / "none").blocks())
    with pytest.raises(GhstError, match=r": Is a directory$"):
        list(Source(tmp_path).blocks())


def test_a_capture_of_px4() -> None:
    path = captures.px4_path()
    if not path.is_file():
        pytest.skip(f"the capture {path.name} is not beside the checkout: it is no part of it")
    blocks = list(Source(path).blocks())
    reads = captures.read_px4(path)
    assert b"".join(block.data for block in blocks) == b"".join(octets for octets, _ in reads)


def test_a_file_that_became_shorter_while_it_was_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"82 0c\n")
    blocks = Source(path, follow=True).blocks()
    assert next(blocks).data == b"\x82\x0c"
    monkeypatch.setattr(formats.time, "sleep", lambda seconds: path.write_bytes(b""))
    with pytest.raises(GhstError, match=r"became shorter while it was followed: start again$"):
        next(blocks)


def test_what_is_added_to_a_followed_file_comes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x"
    path.write_bytes(LOG + b"0.1 8")

    def add(seconds: float) -> None:
        with path.open("ab") as file:
            file.write(b"2\n0.2 0c\n")

    monkeypatch.setattr(formats.time, "sleep", add)
    blocks = Source(path, follow=True).blocks()
    assert [next(blocks).data for _ in range(2)] == [b"", b"\x82\x0c"]
