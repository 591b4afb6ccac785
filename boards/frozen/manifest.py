# What is frozen into an image, for every board. Included by boards/<name>/micropython/manifest.py
# with the board's name as an option; MicroPython's tools/manifestfile.py gives the functions.
# ruff: noqa: F821

import os
import sys
from pathlib import Path

# This file is run from its text: it has no __file__, but the current folder is its own.
root = Path(os.getcwd()).parents[1]
sys.path.insert(0, str(root / "tools"))

from ghst_tools import boards, device_files  # noqa: E402

board = boards.load(options.board, root)

# MicroPython's own: it mounts the file system. The rest of its default manifest (asyncio, drivers,
# networking) is used by nothing here, and can be put on the file system.
freeze("$(PORT_DIR)/modules")

# What a board gets otherwise as files, its /board.json, and the main.py beside this file.
freeze(
    str(device_files.write_frozen_modules(board, root)),
    tuple(device_files.frozen_modules(board, root)),
)
