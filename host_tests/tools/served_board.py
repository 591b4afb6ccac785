"""The emulated board behind a TCP port, in a process of its own, for tests."""

import os
import subprocess
import sys
from pathlib import Path

from ghst_tools import micropython_image


class ServedBoard:
    """`ghst emulate`, running; `address` is what mpremote takes for a port.

    With `wire` its Ghost wire is on another one, `wire_address`.
    """

    def __init__(self, image: Path, filesystem: Path | None = None, wire: bool = False) -> None:
        content = ["--filesystem", str(filesystem)] if filesystem else ["--empty"]
        content += ["--wire-port", "0"] if wire else []
        self.process = subprocess.Popen(
            [sys.executable, "-m", "ghst_tools.cli", "emulate", *content],
            stdout=subprocess.PIPE,
            env={**os.environ, micropython_image.IMAGE_VARIABLE: str(image)},
            text=True,
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        self.address = line.removeprefix("rpi_pico is at ").partition(": mpremote")[0]
        assert self.address.startswith("socket://127.0.0.1:"), line
        if wire:
            line = self.process.stdout.readline()
            self.wire_address = line.removeprefix("its wire is at ").partition(": ghst")[0]
            assert self.wire_address.startswith("socket://127.0.0.1:"), line

    def stop(self) -> int:
        """End it as a user does; returns its exit status."""
        self.process.terminate()
        self.process.communicate()
        return self.process.returncode
