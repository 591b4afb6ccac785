"""What turns a board into a Ghost adapter. `main.py` on the board starts `firmware.app`."""
