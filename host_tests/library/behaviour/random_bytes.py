"""Random bytes by the million: made where they are decoded, the result judged by the host.

This module is a workload, not a set of tests; the host makes the same bytes with the same
generator and compares what the model counts.
"""

from behaviour.support import heap_lock, heap_unlock
from ghst import Receiver, crc8

BLOCK = 256
COUNTERS = (
    "frames",
    "crc_errors",
    "length_errors",
    "unknown_frames",
    "foreign_frames",
    "msp_frames",
    "skipped_bytes",
)


def step(seed):
    """The next state 0..2^31-1 of a linear congruential generator (the C standard's example)."""
    return (seed * 1103515245 + 12345) & 0x7FFFFFFF


def fill_with_noise(block, seed):
    """Fills `block` with random bytes; returns the generator's new state."""
    for at in range(len(block)):
        seed = (seed * 1103515245 + 12345) & 0x7FFFFFFF
        block[at] = seed >> 16 & 255
    return seed


def fill_with_frames(block, seed, crc=crc8):
    """Fills `block` with frames of random kinds, some broken or cut off, and noise between."""
    at = 0
    size = len(block)
    while at < size:
        seed = step(seed)
        choice = seed >> 16 & 15
        length = 12 if choice < 10 else 2 + (seed >> 20) % 11
        if choice == 15 or at + length + 2 > size:
            block[at] = seed >> 22 & 255
            at += 1
            continue
        block[at] = 0x82 if choice < 12 else 0x80 + (seed >> 20) % 10
        block[at + 1] = length
        for index in range(at + 2, at + length + 1):
            seed = step(seed)
            block[index] = seed >> 16 & 255
        if choice < 9:
            seed = step(seed)
            block[at + 2] = 0x10 + (seed >> 16) % 0x30
        block[at + length + 1] = crc(block, at + 2, at + length + 1)
        seed = step(seed)
        broken = seed >> 16 & 7
        if broken == 0:
            block[at + 2 + (seed >> 20) % length] ^= 1 << (seed >> 24 & 7)
        at += length + 2
        if broken == 1:
            at -= 1 + (seed >> 20) % length
    return seed


def run(fill, blocks, seed):
    """Feeds `blocks` random blocks with the heap locked; returns counters, pulses and link data.

    The first number is the sum of what `feed` returned, the last the bytes that are unfinished.
    """
    receiver = Receiver()
    block = bytearray(BLOCK)
    controls = 0
    for _ in range(blocks):
        seed = fill(block, seed)
        heap_lock()
        controls += receiver.feed(block)
        heap_unlock()
    before = receiver.skipped_bytes
    values = [controls]
    values += [getattr(receiver, name) for name in COUNTERS]
    values += list(receiver.pulses)
    values += [receiver.lq, receiver.rssi_dbm, receiver.rf_mode, receiver.tx_power_dbm]
    receiver.discard_partial()
    values.append(receiver.skipped_bytes - before)
    return values
