"""The console command `config`: how programs read, check and replace the configuration.

    config                      what is in force, and the file as it stands
    config read OFFSET          a piece of the file
    config begin SIZE [BASE]    a new file; BASE: the hash of the one that it replaces, - for none
    config put OFFSET BASE64    a piece of it
    config check HASH           whether all of it has come, and what the board says to it
    config save [force]         it takes the place of the old one
    config restart [force]      the board begins anew, with the new one

Each is answered with one line of JSON, whose key "ghst" is "config", "ok" or "error", and whose
key "to" has the two words behind `config`: an answer that comes late is no answer to what was
asked after it. A hash is the first 16 hex digits of the SHA-256. Nothing gets to the flash before
`save`.
"""

import binascii
import gc
import hashlib
import json
import time

import machine

from firmware.forget import forget
from firmware.json_text import LARGEST
from ghst import __version__

_FILE = "/ghst.json"
_PIECE = 384  # bytes of the file in an answer
_SHOWN = 20  # problems in an answer


class ConfigCommand:
    """Answers the lines; `application` is the one that runs, None at MicroPython's prompt."""

    def __init__(self, application=None):
        self._application = application
        self._restart = False
        self._drop()

    def __call__(self, arguments=""):
        """Answers a line of the console."""
        words = arguments.split()
        self._to = " ".join(words[:2])
        name = words.pop(0) if words else ""
        commands = {
            "": self._state,
            "read": self._read,
            "begin": self._begin,
            "put": self._put,
            "check": self._check,
            "save": self._save,
            "restart": self._restart_board,
        }
        try:
            if name not in commands:
                raise ValueError(f"config {name} is unknown")
            commands[name](*words)
        except MemoryError:
            self._drop()
            self._answer("error", text="not enough memory for it while the application runs")
        except OSError as error:
            self._answer("error", text=f"{_FILE}: OSError {error}")
        except Exception as error:
            # What cannot be answered is told: a program waits for it.
            self._answer("error", text=str(error) or type(error).__name__)

    def _answer(self, kind, **values):
        values["to"] = self._to
        # MicroPython's dictionaries have no order.
        print('{"ghst": "' + kind + '", ' + json.dumps(values)[1:])

    def _drop(self):
        self._buffer = None
        self._size = self._received = 0
        self._base = None
        self._good = False

    def _state(self):
        application = self._application
        if application:
            name = application.identity[0]
            link = application.adapter.link
            problems = application.problems
        else:
            from firmware.configuration.load import load

            here = load()
            name = here.board["name"]
            link = None
            problems = here.problems
            forget("firmware.configuration")
        size, digest = _digest()
        self._answer(
            "config",
            version=__version__,
            board=name,
            id=binascii.hexlify(machine.unique_id()).decode(),
            link=link,
            problems=problems[:_SHOWN],
            size=size,
            hash=digest,
            restart=self._restart,
        )

    def _read(self, offset):
        with open(_FILE, "rb") as file:
            file.seek(int(offset))
            data = file.read(_PIECE)
        self._answer("config", at=int(offset), data=binascii.b2a_base64(data).decode().strip())

    def _begin(self, size, base=None):
        self._drop()
        if not 0 < int(size) <= LARGEST:
            raise ValueError(f"the file has {size} bytes, must have 1..{LARGEST}")
        gc.collect()
        self._buffer = bytearray(int(size))
        self._size = int(size)
        self._base = base
        self._answer("ok", at=0)

    def _data(self):
        if self._buffer is None:
            raise ValueError("no new file was begun")
        return memoryview(self._buffer)

    def _put(self, offset, text):
        view = self._data()
        data = binascii.a2b_base64(text)
        at = int(offset)
        # One that comes twice, since its answer was lost, is no mistake.
        if not 0 <= at <= self._received or at + len(data) > self._size:
            raise ValueError(f"bytes {at}..{at + len(data)} of {self._size} come out of order")
        view[at : at + len(data)] = data
        self._received = at + len(data)
        self._good = False
        self._answer("ok", at=self._received)

    def _check(self, digest):
        found = hashlib.sha256(self._data()).digest().hex()[:16]
        if self._received != self._size or found != digest:
            raise ValueError("the new file arrived damaged")
        problems = self._problems()
        self._good = not problems
        self._answer("config", problems=problems[:_SHOWN], count=len(problems))

    def _problems(self):
        from firmware.configuration.check import check
        from firmware.configuration.load import board
        from firmware.json_text import parse

        try:
            try:
                tree = parse(self._buffer)
            except MemoryError:
                raise
            except Exception:
                # Whatever it is that nonsense does to the parser.
                return [("", "no valid JSON")]
            return check(tree, board())[1]
        finally:
            forget("firmware.configuration", "firmware.json_text")
            gc.collect()

    def _save(self, force=None):
        data = self._data()
        if not self._good:
            raise ValueError("the new file was not checked")
        self._refuse_linked(force)
        application = self._application
        if application:
            settings = application.settings
        else:
            from firmware.settings import Settings

            settings = Settings()
            settings.load()
        begun_ms = time.ticks_ms()
        # What waits to be saved, or was cut off, comes first: it is a change of the old file.
        settings.poll(True)
        if self._base is not None and (_digest()[1] or "-") != self._base:
            raise ValueError("the file on the board has changed meanwhile")
        if not settings.replace(data):
            raise ValueError(settings.error)
        took_ms = time.ticks_diff(time.ticks_ms(), begun_ms)
        data = None
        self._drop()
        self._restart = application is not None
        self._answer("ok", hash=_digest()[1], ms=took_ms)

    def _restart_board(self, force=None):
        self._refuse_linked(force)
        self._answer("ok", restart=True)
        time.sleep_ms(100)  # for the answer to leave
        if self._application:
            self._application.adapter.stop()
        machine.reset()

    def _refuse_linked(self, force):
        if force not in (None, "force"):
            raise ValueError(f"{force} is unknown, there is force")
        if force is None and self._application and self._application.adapter.link == "linked":
            raise ValueError("the link is up")


def _digest():
    """Returns (bytes, hash) of the file, (None, None) if there is none."""
    digest = hashlib.sha256()
    view = memoryview(bytearray(256))
    size = 0
    try:
        with open(_FILE, "rb") as file:
            while count := file.readinto(view):
                digest.update(view[:count])
                size += count
    except OSError:
        return None, None
    return size, digest.digest().hex()[:16]
