"""The bytes of a real Ghost receiver, in the chunks in which they were read."""

from pathlib import Path

import pytest
from targets import Unix

from ghst import Receiver
from ghst_tools import captures
from ghst_tools.campaign.model import Model, differences
from ghst_tools.captures import Read
from ghst_tools.errors import GhstError

FRAMES = 1546


@pytest.fixture(scope="module")
def reads() -> list[Read]:
    path = captures.px4_path()
    if not path.is_file():
        pytest.skip(f"the capture {path.name} is not beside the checkout: it is no part of it")
    return captures.read_px4(path)


def test_on_cpython(reads: list[Read]) -> None:
    receiver, model = Receiver(), Model()
    shown = 0
    for chunk, decoded in reads:
        assert receiver.feed(chunk) == model.feed(chunk)
        assert differences(model, receiver) == []
        if decoded is None:
            continue
        shown += 1
        for pulse, us in zip(receiver.pulses, decoded, strict=True):
            if us is None:
                assert pulse == 0
            else:
                assert abs(pulse - 4 * us) <= 4
    assert receiver.frames == shown == FRAMES
    assert receiver.crc_errors == receiver.length_errors == receiver.skipped_bytes == 0
    assert receiver.unknown_frames == receiver.foreign_frames == receiver.msp_frames == 0
    assert model.pending == b""


def test_on_the_unix_port(reads: list[Read], unix: Unix, tmp_path: Path) -> None:
    path = tmp_path / "chunks"
    path.write_bytes(b"".join(bytes([len(chunk)]) + chunk for chunk, _ in reads))
    found = unix.evaluate("replay", f"list(run({str(path)!r}))")
    model = Model()
    wanted = []
    for chunk, _ in reads:
        controls = model.feed(chunk)
        link = [model.lq, model.rssi_dbm, model.rf_mode, model.tx_power_dbm]
        wanted.append([controls, model.frames, *model.pulses, *link])
    assert found == wanted
    assert wanted[-1][1] == FRAMES


_CHANNELS = ", ".join(["0x05dc"] * 15 + ["0xffff"]) + ", "


def _read(tmp_path: Path, *lines: str) -> list[Read]:
    path = tmp_path / "capture.txt"
    path.write_text("\n".join(["About INPUT", "-----", *lines]))
    return captures.read_px4(path)


def test_reads_and_what_was_decoded_after_them(tmp_path: Path) -> None:
    lines = ("INPUT 0x82, 0x0c, ", "INPUT 0x11, ", f"DECODED {_CHANNELS}", "", "INPUT 0x80, ")
    assert _read(tmp_path, *lines) == [
        (b"\x82\x0c", None),
        (b"\x11", (1500,) * 15 + (None,)),
        (b"\x80", None),
    ]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["OUTPUT 0x82, "], "capture.txt:3: neither INPUT nor DECODED"),
        (["INPUT 0x82, 130, "], "capture.txt:3: not a list of hexadecimal numbers with a comma "),
        (["INPUT "], "capture.txt:3: not a list of hexadecimal numbers with a comma "),
        (["INPUT 0x82, ", "INPUT 0x100, "], "capture.txt:4: 0x100 is no byte"),
        (["INPUT 0x82, ", "DECODED 0x1, "], "capture.txt:4: 1 channels, must be 16"),
        ([f"DECODED {_CHANNELS}"], "capture.txt:3: DECODED without an INPUT before it"),
        ([], "capture.txt: no INPUT line below a dashed line"),
    ],
)
def test_what_is_wrong_with_a_capture(tmp_path: Path, lines: list[str], message: str) -> None:
    with pytest.raises(GhstError) as caught:
        _read(tmp_path, *lines)
    assert message in str(caught.value)


def test_a_capture_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(GhstError, match=r"none\.txt: No such file or directory$"):
        captures.read_px4(tmp_path / "none.txt")


def test_a_capture_that_is_not_text(tmp_path: Path) -> None:
    path = tmp_path / "capture.txt"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(GhstError, match=r"capture\.txt: not a capture: it is not plain text$"):
        captures.read_px4(path)
