"""The bytes of a real Ghost receiver, bit by bit over the wire into the running firmware.

The whole file: 1546 frames, every 2.5 ms instead of every 18 ms, which saves emulated time and is
harder.
"""

import pytest
from rig import Pico, steps

from ghst import decoder
from ghst_tools.captures import px4_path, read_px4

FRAME_SIZE = 14
PERIOD_NS = 2.5e6


def channels_of(frame: bytes) -> dict[int, int]:
    """The channels in a legacy control frame, by the table of the description."""
    packed = int.from_bytes(frame[3:9], "little")
    found = {
        channel: 6000 + (5 * ((packed >> 12 * channel & 0xFFF) - 1984) >> 2)
        for channel in range(4)
    }
    if frame[2] < 0x13:
        first = 4 + 4 * (frame[2] - 0x10)
        found |= {first + at: 6000 + 20 * (frame[9 + at] - 124) for at in range(4)}
    return found


def test_the_whole_capture_over_the_wire(pico: Pico) -> None:
    path = px4_path()
    if not path.exists():
        pytest.skip(f"{path} is not there: the capture is not part of the project")
    stream = b"".join(chunk for chunk, _ in read_px4(path))
    frames = [stream[at : at + FRAME_SIZE] for at in range(0, len(stream), FRAME_SIZE)]
    assert len(frames) == 1546
    pico.run()
    channels = dict.fromkeys(range(16), 0)
    expected = []
    for frame in frames:
        assert frame[:2] == b"\x82\x0c"
        channels |= channels_of(frame)
        expected += [
            (3 + n, steps(channels[2 * n + 1]) << 16 | steps(channels[2 * n])) for n in range(4)
        ]
    receiver = pico.fly(
        lambda index, t: frames[index] if index < len(frames) else None, 1e9 / PERIOD_NS
    )
    pico.board.run_for((len(frames) + 3) * PERIOD_NS)
    receiver.stop()
    assert pico.word(decoder.FRAMES) == 1546
    for counter in ("CRC_ERRORS", "LENGTH_ERRORS", "UNKNOWN_FRAMES", "SKIPPED_BYTES"):
        assert pico.word(getattr(decoder, counter)) == 0, counter
    assert [(write.slice, write.value) for write in pico.compares] == expected
    assert pico.pulses() == list(channels.values())
