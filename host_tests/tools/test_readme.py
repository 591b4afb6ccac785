"""The README's example runs as it stands, on CPython and on the unix port."""

import os
import re
import subprocess
import sys

import pytest

from ghst_tools import boards, micropython_image

OUTPUT = "[1500.0, 1500.0, 1000.0, 2000.0] us\n97 % -71 dBm, frames: 1\n"


def example() -> str:
    text = (boards.checkout() / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return str(block)


@pytest.mark.parametrize("interpreter", ["cpython", "unix"])
def test_the_example_prints_what_it_should(interpreter: str) -> None:
    program = sys.executable if interpreter == "cpython" else micropython_image.unix_micropython()
    library = str(boards.checkout() / "lib")
    variables = {**os.environ, "PYTHONPATH": library, "MICROPYPATH": library}
    done = subprocess.run(
        [program, "-c", example()], capture_output=True, text=True, env=variables, check=False
    )
    assert done.stdout == OUTPUT, done.stderr


def test_the_links_lead_somewhere() -> None:
    text = (boards.checkout() / "README.md").read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (boards.checkout() / target).exists(), target
