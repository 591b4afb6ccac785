"""From the last stop bit to the last compare register, in emulated time at 125 MHz.

The emulator models no cache misses of the flash: see docs/figures.md.
"""

from itertools import cycle

import pytest
from rig import Pico

import ghst

LIMIT_US = 35.0
PRIMARIES = (344, 3624, 1984, 2784)
FRAMES = {
    0x10: ghst.encode.channels(0x10, PRIMARIES, (22, 124, 226, 174)),
    0x11: ghst.encode.channels(0x11, PRIMARIES, (22, 124, 226, 174)),
    0x13: ghst.encode.link_data(0x13, PRIMARIES),
    0x14: ghst.encode.channels(0x14, PRIMARIES),
    0x30: ghst.encode.channels(0x30, PRIMARIES, (22, 124, 226, 174)),
    0x33: ghst.encode.link_data(0x33, PRIMARIES),
}


@pytest.mark.run()
@pytest.mark.parametrize("kind", FRAMES)
def test_a_single_frame_reaches_the_registers_in_time(pico: Pico, kind: int) -> None:
    receiver = pico.fly(lambda index, t: FRAMES[kind] if index < 20 else None, 250)
    pico.board.run_for(90e6)
    latencies = pico.latencies_us(receiver)
    assert len(latencies) == 20
    assert max(latencies) <= LIMIT_US, latencies


@pytest.mark.parametrize(
    "loop",
    [
        "adapter.poll(); time.sleep_ms(20)",
        "adapter.poll(); [bytearray(64) for n in range(20)]; import gc; gc.collect()",
        "adapter.poll(); print('x' * 200)",
    ],
    ids=["idle", "collecting", "printing"],
)
def test_at_500_hz_no_frame_is_lost_and_none_is_late(pico: Pico, loop: str) -> None:
    pico.run(loop)
    frames = cycle(FRAMES.values())
    receiver = pico.fly(lambda index, t: next(frames) if index < 300 else None, 500)
    pico.board.run_for(620e6)
    latencies = pico.latencies_us(receiver)
    assert len(latencies) == 300
    assert pico.word(ghst.decoder.FRAMES) == 300
    assert pico.word(ghst.decoder.SKIPPED_BYTES) == 0
    assert None not in latencies
    assert max(latencies) <= LIMIT_US, sorted(latencies)[-5:]
