"""Random MSP payloads: made where they are taken, the result judged by the host.

A workload, not a set of tests; the host makes the same payloads with the same generator and
compares what its model counts.
"""

from behaviour.random_bytes import step
from behaviour.support import heap_lock, heap_unlock
from ghst.msp import Responder
from ghst.msp_commands import answer
from ghst.msp_state import State

PAYLOADS = 64


def fill_with_noise(block, seed, sequence):
    """Fills `block`, PAYLOADS payloads, with random bytes."""
    for at in range(len(block)):
        seed = step(seed)
        block[at] = seed >> 16 & 255
    return seed, sequence


def fill_with_messages(block, seed, sequence):
    """The same with chunks that often continue each other, of messages that are often short."""
    seed, _ = fill_with_noise(block, seed, sequence)
    for at in range(0, len(block), 10):
        seed = step(seed)
        choice = seed >> 16 & 63
        status = 0x20 if choice & 1 else 0x40
        if choice & 6 == 0:
            status |= 0x10
            block[at + 2] = (1, 4, 89, 101, 105, 110, 250, block[at + 2])[choice >> 3]
            if choice & 1:
                block[at + 1] = 255 if choice >> 3 == 7 else block[at + 1] & 63
            else:
                block[at + 3] = 0
                block[at + 4] &= 63
                block[at + 5] &= 4 if choice >> 3 == 7 else 0
        elif choice == 62:
            status = 0x60
        elif choice == 63:
            sequence += 1
        block[at] = status | sequence & 15
        sequence += 1
        if choice >> 2 == 14 and choice & 2:
            # The board's name, a long answer, and no slot to send it in: often asked again.
            block[at : at + 3] = b"\x30\x00\x04"
            block[at + 9] = 0
    return seed, sequence


def run(fill, blocks, seed):
    """Feeds random payloads with the heap locked; returns counters and a sum of the chunks.

    Between two payloads up to three chunks of the reply go out, as the slots allow on the air.
    """
    state = State()
    responder = Responder()
    answer(responder, state, None, lambda: True)
    block = bytearray(10 * PAYLOADS)
    chunk = bytearray(6)
    sequence = count = total = 0
    for _ in range(blocks):
        seed, sequence = fill(block, seed, sequence)
        heap_lock()
        for at in range(0, len(block), 10):
            responder.feed(block, at)
            for _ in range(block[at + 9] & 3):
                if responder.next_chunk(chunk):
                    count += 1
                    for value in chunk:
                        total = total * 31 + value & 0xFFFFF
        heap_unlock()
    request = responder.request
    return [
        count,
        total,
        request.sequence_errors,
        request.restarts,
        request.oversized,
        request.orphans,
        request.malformed,
        responder.answered,
        responder.errors,
        responder.replaced,
        responder.repeated,
    ]
