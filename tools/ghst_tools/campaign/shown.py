"""What the decoder of an emulated board has, as a `ghst.Receiver` of this machine shows it."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import ghst  # type: ignore[import-not-found]
from ghst import decoder
from ghst_tools.campaign.model import Model, differences
from ghst_tools.emulator import Board


class Shown:
    """A receiver that gets the memory of the chip's, which nothing on the chip notices."""

    def __init__(self) -> None:
        self.receiver = ghst.Receiver()

    def look(self, board: Board, memory: int, pulses: Sequence[int] | None = None) -> None:
        """Take the decoder's memory at this address, and its pulses."""
        words = array("I", (board.read32(memory + at) for at in range(0, decoder.MEMORY_SIZE, 4)))
        self.receiver.memory[:] = words.tobytes()
        if pulses is not None:
            self.receiver.pulses[:] = array("H", pulses)

    def differences(self, model: Model) -> list[str]:
        """One line for each value, and for MSP, in which it is not as the model.

        Takes the MSP frames that wait from both.
        """
        lines = differences(model, self.receiver)
        found, wanted = _msp(self.receiver), _msp(model)
        if found != wanted:
            lines.append(f"MSP: {found}, the model has {wanted}")
        return lines


def _msp(receiver: ghst.Receiver | Model) -> tuple[list[str], int]:
    """The payloads that wait, and how many were lost before them."""
    payload = bytearray(10)
    taken = []
    while receiver.next_msp(payload):
        taken.append(payload.hex())
    return taken, receiver.msp_lost
