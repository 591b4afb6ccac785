"""What the chip writes to its flash, and what would be there had the power failed on the way."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass

from rp2040py.peripherals import ssi

from ghst_tools.emulator.board import Board


@dataclass(frozen=True)
class FlashWrite:
    """An erase (4 or 64 KB) or a program command (a page): what it found and what it left."""

    offset: int
    before: bytes
    after: bytes
    erases: bool


class FlashLog:
    """Records the writes to the file system of `board` from now on."""

    def __init__(self, board: Board) -> None:
        self.writes: list[FlashWrite] = []
        self._board = board
        self._region = board.filesystem
        self.restart()
        self._ssi = board.mcu.ssi
        self._apply = self._ssi._apply_command
        self._ssi._apply_command = self._record

    def restart(self) -> None:
        """Forget what was written; the file system as it is now is the start."""
        self.start = self._board.flash_filesystem()
        self.writes.clear()

    def cuts(self) -> Iterator[bytes]:
        """File systems as a failure of the power leaves them.

        One before the first write, and three for each write: half of its bytes done, some of its
        bits, and all. A page that is being programmed has bits that are 0 already, a sector that
        is being erased has some that are 1 already.
        """
        noise = random.Random(len(self.writes))
        image = bytearray(self.start)
        yield bytes(image)
        for write in self.writes:
            size = len(write.before)
            place = slice(write.offset, write.offset + size)
            half = size // 2
            image[place] = write.after[:half] + write.before[half:]
            yield bytes(image)
            mask = noise.randbytes(size)
            image[place] = bytes(
                b & m | a & ~m for b, a, m in zip(write.before, write.after, mask, strict=True)
            )
            yield bytes(image)
            image[place] = write.after
            yield bytes(image)

    def _record(self) -> None:
        command = bytes(self._ssi._tx_buffer)
        sizes = {
            ssi.CMD_PAGE_PROGRAM: ssi.FLASH_PAGE_SIZE,
            ssi.CMD_SECTOR_ERASE: ssi.FLASH_SECTOR_SIZE,
            ssi.CMD_BLOCK_ERASE: ssi.FLASH_BLOCK_SIZE,
        }
        size = sizes.get(command[0]) if command and self._ssi._write_enabled else None
        if size is None:
            self._apply()
            return
        flash = self._board.mcu.flash
        address = int.from_bytes(command[1:4], "big") & ~(size - 1)
        before = bytes(flash[address : address + size])
        self._apply()
        after = bytes(flash[address : address + size])
        offset = address - self._region.offset
        if 0 <= offset < self._region.size:
            erases = command[0] != ssi.CMD_PAGE_PROGRAM
            self.writes.append(FlashWrite(offset, before, after, erases))
