"""The SIO block against the one of rp2040py that it stands for."""

import random

from rp2040py.rp2040 import RP2040
from rp2040py.sio import RPSIO

from ghst_tools.emulator.sio import Sio

CPUID, SPINLOCK_3 = 0x000, 0x10C
DIVIDER = (0x060, 0x064, 0x068, 0x06C, 0x070, 0x074)
DIVIDER_RESULTS = (0x078, 0x074, 0x070, 0x078)
VALUES = (0, 1, 2, 7, 1000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)


def test_every_register_answers_as_rp2040py_s_does() -> None:
    pick = random.Random(4)
    blocks = [(chip, sio(chip)) for sio in (Sio, RPSIO) for chip in [RP2040()]]
    for _ in range(3000):
        register = pick.choice((*DIVIDER, SPINLOCK_3))
        value = pick.choice((*VALUES, pick.getrandbits(32)))
        states = []
        for chip, sio in blocks:
            sio.write_uint32(register, value)
            read = [sio.read_uint32(offset) for offset in (CPUID, SPINLOCK_3, *DIVIDER_RESULTS)]
            states.append(([int(word) & 0xFFFFFFFF for word in read], chip.core.cycles))
        assert states[0] == states[1], (hex(register), hex(value))
    assert blocks[0][0].core.cycles > 0
