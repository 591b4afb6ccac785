"""What turns a board into a Ghost adapter. `main.py` on the board starts `firmware.app`."""

# The adapter that has the hardware: interrupts and DMA know its memory by address alone, and only
# this keeps it from the garbage collector.
running = None
