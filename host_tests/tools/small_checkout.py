"""A small checkout for tests: one board, a library of two modules, a firmware of two."""

import shutil
from pathlib import Path

from ghst_tools import boards

HELLO = "micropython-ghst 0.0 on emulated board"


def make(root: Path) -> Path:
    """Write the checkout into `root`; returns it."""
    files = {
        "lib/ghst/__init__.py": "from ghst.answer import ANSWER\n",
        "lib/ghst/answer.py": "ANSWER = 42\n",
        "lib/ghst/_host.py": "# host only\nimport ctypes\n",
        "firmware/__init__.py": "",
        "firmware/sub/__init__.py": "",
        "firmware/sub/app.py": (
            "import ghst\n\n\ndef run():\n"
            f'    print("{HELLO}", ghst.ANSWER)\n'
            "    while True:\n        pass\n"
        ),
        "firmware/main.py": "from firmware.sub import app\n\napp.run()\n",
        "pyproject.toml": '[project]\nname = "micropython-ghst"\nversion = "1.2.3"\n',
    }
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    shutil.copytree(boards.checkout() / "boards", root / "boards")
    return root


BOARD_FILES = [
    "/board.json",
    "/lib/firmware/__init__.mpy",
    "/lib/firmware/sub/__init__.mpy",
    "/lib/firmware/sub/app.mpy",
    "/lib/ghst/__init__.mpy",
    "/lib/ghst/answer.mpy",
    "/main.py",
]
"""What `device_files.collect` makes of it."""
