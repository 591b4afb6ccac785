"""Random bytes by the million, the same on every target, judged by the model."""

import pytest
from behaviour import random_bytes
from targets import Target

from ghst_tools.campaign.model import Model, crc

BLOCKS = {
    "fill_with_noise": {"cpython": 4_000, "unix": 16_000, "rp2040": 2},
    "fill_with_frames": {"cpython": 2_000, "unix": 4_000, "rp2040": 2},
}
"""Of 256 bytes each: 1.5 million on CPython, 5 million on the unix port."""

SEED = 20210309


def _expected(fill: str, blocks: int) -> list[int]:
    """What `random_bytes.run` has to return, from the model."""

    def slow_crc(block: bytearray, start: int, stop: int) -> int:
        return crc(bytes(block[start:stop]))

    model = Model()
    block = bytearray(random_bytes.BLOCK)
    seed = SEED
    controls = 0
    for _ in range(blocks):
        if fill == "fill_with_frames":
            seed = random_bytes.fill_with_frames(block, seed, slow_crc)
        else:
            seed = random_bytes.fill_with_noise(block, seed)
        controls += model.feed(bytes(block))
    total = blocks * random_bytes.BLOCK
    assert total == model.frame_bytes + model.skipped_bytes + len(model.pending)
    return [
        controls,
        *(getattr(model, name) for name in random_bytes.COUNTERS),
        *model.pulses,
        *(model.lq, model.rssi_dbm, model.rf_mode, model.tx_power_dbm),
        len(model.pending),
    ]


@pytest.mark.parametrize("fill", BLOCKS)
def test_random_bytes(target: Target, fill: str, request: pytest.FixtureRequest) -> None:
    blocks = BLOCKS[fill][request.node.callspec.params["target"]]
    found = target.evaluate("random_bytes", f"run({fill}, {blocks}, {SEED})")
    assert found == _expected(fill, blocks)


def test_the_frames_of_the_workload_reach_every_counter() -> None:
    counters = _expected("fill_with_frames", 400)[: 1 + len(random_bytes.COUNTERS)]
    assert min(counters) > 50
