"""Runs the commands of a build, with a log and an environment that is always the same."""

import os
import re
import subprocess
import sys
from pathlib import Path

from ghst_tools.errors import GhstError

# What a build must not inherit: flags of the caller, and make's own when run under `make`.
_INHERITED = re.compile(r"(PATH|HOME|TMPDIR|USER|LOGNAME|IDF_\w+|\w*_proxy|\w*_PROXY)$")


def environment() -> dict[str, str]:
    """What of this process's environment a build gets."""
    kept = {name: value for name, value in os.environ.items() if _INHERITED.match(name)}
    # MicroPython's scripts write tables in the order of Python's sets: fix that order too.
    return {**kept, "LC_ALL": "C", "PYTHONHASHSEED": "0"}


class Steps:
    """Commands that are run one after the other; `environment` may be added to."""

    def __init__(self, log: Path, verbose: bool) -> None:
        """`log`: a new file for what the commands print; with `verbose` it goes to stderr."""
        self.log = log
        self.verbose = verbose
        self.environment = environment()
        log.write_text("")

    def run(self, *command: str | Path, folder: Path, keep: bool = False) -> str:
        """Run one command in `folder`; return what it printed if `keep`.

        `GhstError` if it fails, and says where to read why.
        """
        line = " ".join(map(str, command))
        with self.log.open("a") as log:
            print(f"+ {line}", file=sys.stderr if self.verbose else log, flush=True)
            output = subprocess.PIPE if keep else sys.stderr if self.verbose else log
            done = subprocess.run(
                command,
                cwd=folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=sys.stderr if self.verbose else log,
                text=True,
            )
        if done.returncode != 0:
            where = "" if self.verbose else f": see {self.log}"
            raise GhstError(f"'{command[0]}' ended with {done.returncode}{where}")
        return done.stdout or ""
