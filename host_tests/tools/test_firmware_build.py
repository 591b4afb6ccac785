"""Building images: the sources and the toolchain that are needed, and what is said without them.

Whether an image that was built flies is tested in host_tests/firmware/test_frozen.py.
"""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import small_checkout

from ghst_tools import (
    debian_packages,
    frozen,
    micropython_build,
    micropython_image,
    micropython_sources,
    toolchain,
)
from ghst_tools.build_steps import Steps
from ghst_tools.errors import GhstError


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    folder = tmp_path / "cache"
    monkeypatch.setenv(micropython_image.CACHE_VARIABLE, str(folder))
    return folder


def sources(folder: Path, version: tuple[int, int, int] = (1, 25, 0)) -> Path:
    """A folder that says that it has MicroPython in it."""
    names = ("MAJOR", "MINOR", "MICRO")
    lines = (
        f"#define MICROPY_VERSION_{name} {part}\n"
        for name, part in zip(names, version, strict=True)
    )
    (folder / "py").mkdir(parents=True)
    (folder / "py/mpconfig.h").write_text("// version\n" + "".join(lines))
    return folder


def test_the_version_of_a_users_sources(tmp_path: Path) -> None:
    found = micropython_sources.given(sources(tmp_path / "micropython", (1, 26, 1)))
    assert (found.folder, found.version) == (tmp_path / "micropython", "1.26.1")
    # The image says when it was built, as any other.
    assert found.epoch is None


def test_a_folder_without_micropython(tmp_path: Path) -> None:
    for folder in (tmp_path, tmp_path / "absent"):
        with pytest.raises(GhstError) as caught:
            frozen.build(micropython=folder)
        assert str(caught.value) == (
            f"{folder} has no MicroPython in it: name the folder that has py/mpconfig.h"
        )
    (tmp_path / "py").mkdir()
    (tmp_path / "py/mpconfig.h").write_text("#define MICROPY_VERSION_MAJOR 1\n")
    with pytest.raises(GhstError, match=r"mpconfig\.h does not say which MicroPython this is$"):
        frozen.build(micropython=tmp_path)


@pytest.mark.parametrize("version", [(1, 24, 1), (0, 99, 0)])
def test_sources_that_are_too_old(tmp_path: Path, version: tuple[int, int, int]) -> None:
    text = ".".join(map(str, version))
    with pytest.raises(GhstError, match=f": MicroPython {text} is too old: 1.25 or newer is"):
        frozen.build(micropython=sources(tmp_path, version))


def test_sources_without_their_submodules(tmp_path: Path, cache: Path) -> None:
    said: list[str] = []
    with pytest.raises(GhstError) as caught:
        frozen.build(micropython=sources(tmp_path / "micropython"), report=said.append)
    assert str(caught.value) == (
        f"{tmp_path / 'micropython'}: lib/pico-sdk is empty: run 'make -C ports/rp2 submodules' "
        "there"
    )
    assert said == ["building MicroPython 1.25.0 with the firmware for rpi_pico"]


def test_debian_has_nothing_for_the_esp32() -> None:
    with pytest.raises(GhstError) as caught:
        frozen.build("esp32_c3_supermini")
    assert str(caught.value) == (
        "Debian's packages can build images for RP2 chips only, esp32_c3_supermini has an "
        "ESP32-C3: name MicroPython's sources with --micropython (make: MICROPYTHON=...)"
    )


def test_the_esp32_needs_its_own_tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(GhstError, match=r"^idf\.py is missing: set ESP-IDF up"):
        frozen.build("esp32_devkit", sources(tmp_path))


def test_what_the_esp32_port_is_built_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MicroPython's own make does it; here a stand-in tells whether it has what it needs."""
    folder = sources(tmp_path / "micropython")
    (folder / "lib/micropython-lib").mkdir(parents=True)
    (folder / "lib/micropython-lib/README.md").touch()
    port = folder / "ports/esp32"
    port.mkdir(parents=True)
    (port / "Makefile").write_text(
        "all:\n"
        "\ttest -f $(BOARD_DIR)/sdkconfig.board\n"
        "\ttest -x $(MICROPY_MPYCROSS)\n"
        "\ttest -x $(PYTHON)\n"
        "\tprintf $(BOARD) > $(BUILD)/firmware.bin\n"
    )
    programs = tmp_path / "programs"
    programs.mkdir()
    (programs / "idf.py").symlink_to(sys.executable)
    monkeypatch.setenv("PATH", f"{programs}:/usr/bin:/bin")
    root = small_checkout.make(tmp_path / "checkout")
    image = frozen.build("esp32_s3_devkit", folder, root=root, report=lambda line: None)
    assert image == root / "build/esp32_s3_devkit/firmware.bin"
    assert image.read_text() == "GHST_ESP32_S3_DEVKIT"


def test_a_board_without_a_definition(tmp_path: Path) -> None:
    shutil.copytree(frozen.boards.checkout() / "boards", tmp_path / "boards")
    (tmp_path / "boards/rpi_pico/micropython/mpconfigboard.cmake").unlink()
    with pytest.raises(GhstError, match=r"there is no frozen image for rpi_pico$"):
        frozen.build(root=tmp_path)


def test_a_missing_toolchain_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    apt = tmp_path / "apt-get"
    apt.write_text("#!/bin/sh\nexit 1\n")
    apt.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    packages = (
        "gcc-arm-none-eabi cmake ninja-build libnewlib-arm-none-eabi "
        "libstdc++-arm-none-eabi-newlib"
    )
    with pytest.raises(GhstError) as caught:
        toolchain.need(False, print)
    assert str(caught.value) == (
        "the toolchain is missing: as root, run apt-get install --yes --no-install-recommends "
        + packages
    )
    apt.unlink()
    with pytest.raises(GhstError) as caught:
        frozen.build(micropython=sources(tmp_path))
    assert str(caught.value) == (f"the toolchain is missing: install what Debian calls {packages}")


def test_without_apt_there_are_no_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(GhstError) as caught:
        frozen.build()
    assert str(caught.value) == (
        "no sources of MicroPython from Debian's packages: this system has no apt-get: name "
        "sources of 1.25 or newer with --micropython (make: MICROPYTHON=...), or use Debian"
    )
    assert [path.name for path in cache.iterdir()] == ["lock"]


def test_native_code_that_would_be_misread_is_found() -> None:
    symbols = (
        "10048464 R mp_type_fun_bc\n"
        "10060101 r fun_data_bytecode\n"
        "         U absent\n"
        "{address} t fun_data_firmware_interrupts\n"
    )
    micropython_build._check_native_code(symbols.format(address="10061234"))
    with pytest.raises(GhstError, match=r"^fun_data_firmware_interrupts is not on a multiple of"):
        micropython_build._check_native_code(symbols.format(address="10061236"))


def test_errors_are_one_line_on_the_console(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "ghst_tools.cli", "firmware", "--micropython", str(tmp_path)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == (
        f"ghst: {tmp_path} has no MicroPython in it: name the folder that has py/mpconfig.h\n"
    )


@pytest.mark.skipif(shutil.which("apt-get") is None, reason="needs apt-get")
@pytest.mark.parametrize(
    ("name", "text", "mirror"),
    [
        ("a.list", "deb http://a.example/debian bookworm main\n", "http://a.example/debian"),
        (
            "a.list",
            "deb https://deb.other.example/x nodistro main\n"
            "deb [arch=all] https://m.example/mirror/debian/ trixie main contrib\n",
            "https://m.example/mirror/debian",
        ),
        (
            "a.sources",
            "Types: deb\nURIs: http://s.example/debian-security\nSuites: b-security\n"
            "Components: main\n\n"
            "Types: deb\n# old\nURIs: http://s.example/debian\nSuites: b b-updates\n"
            "Components: main\n",
            "http://s.example/debian",
        ),
        ("a.list", "deb http://u.example/ubuntu noble main\n", None),
    ],
)
def test_the_mirror_is_the_machines_own(
    tmp_path: Path, name: str, text: str, mirror: str | None
) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / name).write_text(text)
    (tmp_path / "lists/partial").mkdir(parents=True)
    (tmp_path / "apt.conf").write_text(
        'Dir::Etc::sourcelist "/dev/null";\n'
        f'Dir::Etc::sourceparts "{tmp_path}/parts";\nDir::State::Lists "{tmp_path}/lists";\n'
    )
    steps = Steps(tmp_path / "log", verbose=False)
    steps.environment["APT_CONFIG"] = str(tmp_path / "apt.conf")
    if mirror is not None:
        assert debian_packages.mirror(tmp_path, steps) == mirror
    else:
        with pytest.raises(GhstError, match="name no Debian archive"):
            debian_packages.mirror(tmp_path, steps)
