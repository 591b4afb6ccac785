"""Which files a board gets, and how they are compiled."""

import ast
from pathlib import Path

import pytest
import small_checkout

from ghst_tools import boards, device_files
from ghst_tools.errors import GhstError


def collect(root: Path) -> dict[str, bytes]:
    return device_files.collect(boards.load("rpi_pico", root), root)


def test_a_board_gets_modules_compiled_and_main_as_it_is(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    files = collect(root)
    assert list(files) == small_checkout.BOARD_FILES
    assert files["/main.py"] == (root / "firmware/main.py").read_bytes()
    assert files["/board.json"] == boards.load("rpi_pico", root).definition


def test_the_same_sources_give_the_same_bytes_anywhere(tmp_path: Path) -> None:
    assert collect(small_checkout.make(tmp_path / "a")) == collect(
        small_checkout.make(tmp_path / "other/place")
    )


def test_native_code_is_for_the_boards_architecture(tmp_path: Path) -> None:
    source = tmp_path / "native.py"
    source.write_text("import micropython\n@micropython.viper\ndef f(x: int) -> int:\n return x\n")
    # Header of a .mpy: 'M', version 6, sub-version 3 in bits 0-1 and the architecture in bits
    # 2-5 (4 = armv6m, 7 = armv7emsp), bits of a small int.
    header = device_files.compile_module(source, "native.py", "armv6m")[:4]
    assert header == bytes([ord("M"), 6, 4 << 2 | 3, 31])
    header = device_files.compile_module(source, "native.py", "armv7emsp")[:4]
    assert header == bytes([ord("M"), 6, 7 << 2 | 3, 31])


def test_constants_are_folded_across_modules(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    (root / "lib/ghst/answer.py").write_text("ANSWER = const(42)\nQUESTION = 6 * 9\n")
    (root / "firmware/sub/app.py").write_text("from ghst.answer import ANSWER\nprint(ANSWER)\n")
    files = collect(root)
    assert b"ANSWER" not in b"".join(files.values())
    assert b"QUESTION" in files["/lib/ghst/answer.mpy"]
    frozen = device_files.frozen_modules(boards.load("rpi_pico", root), root)
    assert frozen["firmware/sub/app.py"] == b"pass\nprint(42)\n"


def test_tracebacks_name_the_module(tmp_path: Path) -> None:
    files = collect(small_checkout.make(tmp_path))
    for path in ("/lib/ghst/answer.mpy", "/lib/firmware/sub/app.mpy"):
        assert path.encode() in files[path]
    assert str(tmp_path).encode() not in b"".join(files.values())


@pytest.mark.parametrize(
    ("text", "line", "error"),
    [
        ("a = 1\nb = = 2\n", 2, "SyntaxError: invalid syntax"),
        ("def f():\n  x = 1\n y = 2\n", 2, "IndentationError: unindent"),
        (
            "import micropython\n@micropython.viper\ndef f():\n  x: int = 1\n  return x\n",
            5,
            "ViperTypeError: return expected 'object' but got 'int'",
        ),
    ],
)
def test_a_compile_error_names_file_and_line(
    tmp_path: Path, text: str, line: int, error: str
) -> None:
    root = small_checkout.make(tmp_path)
    path = root / "lib/ghst/answer.py"
    path.write_text(text)
    with pytest.raises(GhstError) as caught:
        collect(root)
    assert str(caught.value).startswith(f"{path}:{line}: {error}")
    assert "\n" not in str(caught.value)


def test_a_tree_without_main_is_refused(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    (root / "firmware/main.py").unlink()
    with pytest.raises(GhstError, match=r"main\.py is missing"):
        collect(root)


def test_a_tree_without_library_is_refused(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    for path in (root / "lib/ghst").glob("*.py"):
        path.write_text("# host only\n")
    with pytest.raises(GhstError, match="no modules to install"):
        collect(root)


def test_a_board_gets_only_what_its_chip_needs(tmp_path: Path) -> None:
    root = small_checkout.make(tmp_path)
    for chip in ("rp2", "esp32"):
        (root / f"firmware/{chip}.py").write_text(f"# only on {chip}\nANSWER = 42\n")
    for name, own, other in (
        ("rpi_pico", "rp2", "esp32"),
        ("rpi_pico2", "rp2", "esp32"),
        ("esp32_devkit", "esp32", "rp2"),
        ("esp32_c3_supermini", "esp32", "rp2"),
    ):
        board = boards.load(name, root)
        files = device_files.collect(board, root)
        assert f"/lib/firmware/{own}.mpy" in files
        assert f"/lib/firmware/{other}.mpy" not in files
        frozen = device_files.frozen_modules(board, root)
        assert f"firmware/{own}.py" in frozen
        assert f"firmware/{other}.py" not in frozen


CHOOSE_AT_RUN_TIME = ("firmware/adapter.py", "firmware/devices.py", "firmware/status_outputs.py")


@pytest.mark.parametrize("name", boards.names())
def test_no_module_of_a_board_imports_one_of_another_chip(name: str) -> None:
    board = boards.load(name)
    modules = device_files.sources(board=board)
    there = {path.removesuffix(".py").removesuffix("/__init__") for path in modules}
    others = {
        path.removesuffix(".py")
        for path in device_files.sources().keys() - modules.keys()
        if not path.endswith("/__init__.py")
    }
    assert len(others) >= 5
    for path, text in device_files.folded(modules).items():
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.ImportFrom) or not node.module:
                continue
            package = node.module.replace(".", "/")
            wanted = {package, *(f"{package}/{alias.name}" for alias in node.names)}
            if path not in CHOOSE_AT_RUN_TIME:
                assert not wanted & others, (path, wanted & others)
            assert (
                package in there
                or not package.startswith(("firmware", "ghst/"))
                or (path in ("firmware/adapter.py", "firmware/devices.py", "ghst/crc.py"))
            )
