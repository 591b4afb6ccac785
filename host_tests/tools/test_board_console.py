"""The console of a running board, with the test as the board on a pseudo-terminal."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from terminal import Terminal, terminal

from ghst_tools.board_console import BoardConsole, NoApplicationError, message_of
from ghst_tools.errors import GhstError


@contextmanager
def board(*answers: bytes) -> Iterator[tuple[Terminal, list[bytes]]]:
    """A terminal that answers each line that it gets with the next of `answers`."""
    got: list[bytes] = []
    with terminal() as line:

        def answer() -> None:
            for text in answers:
                received = b""
                while not received.endswith(b"\r"):
                    received += line.receive(1)
                got.append(received)
                line.send(text)

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            yield line, got
        finally:
            thread.join()


def asked(*answers: bytes, ask: Callable[[BoardConsole], object]) -> tuple[object, list[str]]:
    """What `ask` returns when the board answers so, and the lines for people."""
    texts: list[str] = []
    with board(*answers) as (line, got), BoardConsole(line.port, texts.append) as console:
        result = ask(console)
        assert got == [b"\x02\x15status\r"] * len(answers)
    return result, texts


def test_the_answer_is_found_among_lines_for_people() -> None:
    answer = (
        b'link: linked\r\n{"ghst": "ok"}\r\n{7}\r\n{"lq": 3}\r\n{"lq": 97, "ghst": "status"}\r\n'
    )
    result, texts = asked(answer, ask=lambda console: console.ask("status", "status"))
    assert result == {"ghst": "status", "lq": 97}
    assert texts == ["link: linked", "{7}", '{"lq": 3}']


def test_what_had_come_before_is_no_answer() -> None:
    with board(b'{"ghst": "ok", "n": 2}\r\n') as (line, _), BoardConsole(line.port) as console:
        line.send(b'half a line\r\n{"ghst": "ok", "n": 1}\r\nand ha')
        # What was sent last has come when the whole of it is there.
        while console._line.in_waiting < 43:
            pass
        assert console.ask("status") == {"ghst": "ok", "n": 2}


def test_a_late_answer_is_passed_over() -> None:
    answer = b'{"ghst": "ok", "to": "put 0"}\r\n{"ghst": "error", "to": "put 0"}\r\n'
    answer += b'{"ghst": "ok", "to": "put 45", "at": 90}\r\n'
    with board(answer) as (line, _), BoardConsole(line.port) as console:
        assert console.ask("config put 45 AAAA")["at"] == 90


def test_lines_that_come_by_themselves() -> None:
    texts: list[str] = []
    with terminal() as line, BoardConsole(line.port, texts.append) as console:
        line.send(b'one\r\n{"ghst": "status"}\r\n\xff\r\nfour')
        assert console.read_line(20.0) == "one"
        assert console.read_message(20.0) == {"ghst": "status"}
        assert console.read_message(0.0) is None
        line.send(b" more\n")
        assert console.read_line(20.0) == "four more"
        assert texts == ["\ufffd"]


@pytest.mark.parametrize(
    ("answer", "error"),
    [
        (b'{"ghst": "error", "text": "the link is up"}\r\n', "the link is up"),
        (b"no command 'status': type help\r\n", "the board does not know 'status': its firmware "),
        (b"  NameError: x\r\n>>> ", "the board stands at MicroPython's prompt: main() or "),
        (b"link: searching\r\n", "no answer within 0.5 s: does it run micropython-ghst?"),
    ],
)
def test_what_is_no_answer_is_one_line(answer: bytes, error: str) -> None:
    with pytest.raises(GhstError) as caught:
        asked(answer, ask=lambda console: console.ask("status", "status", timeout_s=0.5))
    assert str(caught.value).partition(": ")[2].startswith(error)
    assert isinstance(caught.value, NoApplicationError) is ("prompt" in error)


def test_a_board_that_is_unplugged() -> None:
    with terminal() as line, BoardConsole(line.port) as console:
        line.unplug()
        with pytest.raises(GhstError) as caught:
            console.ask("status")
        assert str(caught.value) == (
            f"{line.port}: gone (unplugged?): connect it again, or press its reset button"
        )


def test_a_port_that_is_not_there() -> None:
    with pytest.raises(GhstError, match=r"^/dev/ttyNONE: there is no such port$"):
        BoardConsole("/dev/ttyNONE")


@pytest.mark.parametrize("line", ["", "[]", "{}", "{", "5", '{"ghs": 1}', ' {"ghst": "ok"}'])
def test_what_is_no_message(line: str) -> None:
    assert message_of(line) is None
