"""Other ways for the frame interrupt to take our echo, and what each costs."""

from __future__ import annotations

from collections.abc import Sequence

from ghst_tools.bench.figures import Effort
from ghst_tools.bench.rig import Change, Rig
from ghst_tools.bench.talking import Talking

SHARE_HZ = 500
_INTERRUPTS = "firmware/interrupts.py"

# `controls` tells whether there is anything for the decoder.
_UNSCANNED = (
    (
        "        if ptr32(c[SENT_REGISTER])[0] & SENT_FLAG:\n",
        "        controls = 1\n        if ptr32(c[SENT_REGISTER])[0] & SENT_FLAG:\n",
    ),
    (
        "                words[LINE_QUIET] = 0\n",
        "                words[LINE_QUIET] = 0\n                controls = 0\n",
    ),
    (
        "        controls = int(scan(c[MEMORY], c[PULSES]))\n",
        "        if controls:\n            controls = int(scan(c[MEMORY], c[PULSES]))\n",
    ),
)
_COMPARING = """\
                    ring = ptr8(c[RING_ADDRESS])
                    frame = ptr8(c[SLOT_FRAME])
                    while index < _FRAME_BYTES and ring[(tail + index) & 255] == frame[index]:
                        index += 1
"""
# Two bytes at once where the ring allows it: it is aligned, and so is the frame.
_HALFWORDS = """\
                    if tail & 1 == 0:
                        at = tail >> 1
                        while (
                            index < _FRAME_BYTES >> 1
                            and ptr16(c[RING_ADDRESS])[(at + index) & 127]
                            == ptr16(c[SLOT_FRAME])[index]
                        ):
                            index += 1
                        index = index << 1
                    while (
                        index < _FRAME_BYTES
                        and ptr8(c[RING_ADDRESS])[(tail + index) & 255]
                        == ptr8(c[SLOT_FRAME])[index]
                    ):
                        index += 1
"""
_LAST_BYTE = """\
                    if ptr8(c[RING_ADDRESS])[(head - 1) & 255] == ptr8(c[SLOT_FRAME])[13]:
                        index = _FRAME_BYTES
"""

ECHO_WAYS: dict[str, dict[str, Sequence[Change]]] = {
    "echo: not for the decoder": {_INTERRUPTS: _UNSCANNED},
    "echo: two bytes at once": {_INTERRUPTS: ((_COMPARING, _HALFWORDS),)},
    "echo: length and CRC byte only": {_INTERRUPTS: ((_COMPARING, _LAST_BYTE),)},
    "echo: two bytes at once, not for the decoder": {
        _INTERRUPTS: (*_UNSCANNED, (_COMPARING, _HALFWORDS))
    },
    "echo: length and CRC byte only, not for the decoder": {
        _INTERRUPTS: (*_UNSCANNED, (_COMPARING, _LAST_BYTE))
    },
}


def cost(rig: Rig, effort: Effort) -> tuple[int, float]:
    """CPU cycles of an echo's interrupt, and the share of the CPU with one behind each frame."""
    talking = Talking(rig)
    without = talking.rounds(effort.share_s)
    left, _ = talking.rounds_in_flight(effort.share_s, SHARE_HZ, talk=True)
    _, echo = talking.interrupts()  # at each place in the ring it is the same
    return echo, 100 * (1 - left / without)
