"""What is set while the board runs and must outlast its power: in the configuration's file.

    settings = Settings()
    settings.load()
    settings.get("vtx", "vtx_power", 1)
    settings.set("vtx", "vtx_power", 3)
    settings.request_save()
    settings.poll(link_is_down)         # in every round of the main loop

Writing flash stops all interrupts for milliseconds, so it is done in `poll` alone, and only while
that is safe. Whenever the power fails, the file has all of its old or all of its new contents:
the new ones go into a file of their own, are read back, and that file is renamed to the old one's
name, which littlefs does in one piece.
"""

import json
import os

from firmware.json_text import LARGEST, parse

_ENOENT = 2
_ENOSPC = 28
_PIECE = 256  # bytes that are compared at a time


class Settings:
    """Sections of named values: None, numbers, strings, or lists of them; all else is kept.

    `changed`: whether there is something to save. `saves`: how often the file was written.
    `error`: one line about what went wrong with the file, None while nothing did.
    """

    def __init__(self, path="/ghst.json"):
        """Begins empty. `path`: the file; beside it, `path` + ".new" and ".broken" are used."""
        self._path = path
        self._new_path = path + ".new"
        self._sections = {}
        self._file_is_broken = False
        self._finish = None  # what a save that was cut off has left to do
        self._requested = False
        self.changed = False
        self.saves = 0
        self.error = None

    def load(self):
        """Reads the file; writes nothing, and raises nothing.

        No file is no settings. A broken one, or one that cannot be read, is as well, with `error`
        saying so; nothing is saved then but by `replace`, which keeps it as `path` + ".broken".
        """
        self._finish = None
        self._requested = self.changed = False
        sections, self.error = self._read(self._path)
        self._file_is_broken = self.error is not None
        if _exists(self._new_path):
            self._finish = self._remove_new
            if sections is None:
                # The power failed between the end of a save and its last step.
                sections, broken = self._read(self._new_path)
                if not broken:
                    self._finish = self._rename_new
                    self.error = None
        self._sections = sections or {}

    def get(self, section, key, default=None):
        """Returns a value, `default` if there is none. A list is not to be changed."""
        values = self._sections.get(section)
        return values.get(key, default) if isinstance(values, dict) else default

    def set(self, section, key, value):
        """Changes a value here, not in the file; raises `ValueError` for what no file can hold."""
        if not isinstance(section, str) or not isinstance(key, str):
            raise ValueError(f"setting {section!r}, {key!r}: both names must be strings")
        values = list(value) if isinstance(value, (list, tuple)) else [value]
        for element in values:
            # Infinity and what is no number are floats, but no JSON.
            if type(element) not in (type(None), bool, int, float, str) or (
                type(element) is float and element - element != 0
            ):
                raise ValueError(f"setting {section}.{key} cannot be {element!r}")
        if isinstance(value, (list, tuple)):
            value = values
        before = self._sections.setdefault(section, {})
        if not isinstance(before, dict):
            raise ValueError(f"{section} in {self._path} is no JSON object")
        # As text: 1, True and 1.0 are equal.
        if key not in before or json.dumps(before[key]) != json.dumps(value):
            before[key] = value
            self.changed = True

    def request_save(self):
        """Has what has changed saved by a later `poll`."""
        self._requested = True

    def poll(self, safe):
        """Saves if that was requested; returns whether it did.

        `safe`: whether nothing is at stake if all interrupts stand still for a tenth of a second.
        After a failure, which `error` tells, it waits for the next request.
        """
        if not safe or not (self._requested or self._finish):
            return False
        return self._tried(self._save_what_was_asked_for)

    def replace(self, data):
        """Makes `data`, the bytes of a whole file, the file's contents; returns whether it did.

        Only while it is safe, as in `poll`. What was set and not saved is forgotten.
        """
        if not self._tried(self._write, data):
            return False
        saves = self.saves
        self.load()
        self.saves = saves
        return True

    def _tried(self, save, *arguments):
        """Returns whether `save` did, after what an earlier one has left to do."""
        finish = self._finish
        self._finish = None
        try:
            if finish:
                finish()
            if not save(*arguments):
                return False
        except OSError as error:
            # MicroPython has no name for this one.
            reason = "the flash is full" if error.errno == _ENOSPC else f"OSError {error}"
            self.error = f"{self._path} was not saved: {reason}"
            return False
        except (ValueError, MemoryError) as error:
            self.error = f"{self._path} was not saved: {error}"
            return False
        self.changed = False
        self.saves += 1
        self.error = None
        return True

    def _save_what_was_asked_for(self):
        if not self._requested:
            return False
        self._requested = False
        if not self.changed:
            return False
        if self._file_is_broken:
            # What is set here alone would be a configuration, and all outputs move by it.
            raise ValueError("it is broken, put it in order first")
        return self._write(json.dumps(self._sections).encode())

    def _write(self, data):
        if len(data) > LARGEST:
            raise ValueError(f"{len(data)} bytes, {LARGEST} at most")
        self._finish = self._remove_new
        with open(self._new_path, "wb") as file:
            file.write(data)
        if not _holds(self._new_path, memoryview(data)):
            raise ValueError("it reads back differently")
        self._finish = self._rename_new
        self._rename_new()
        self._finish = None
        return True

    def _rename_new(self):
        if self._file_is_broken:
            os.rename(self._path, self._path + ".broken")
            self._file_is_broken = False
        os.rename(self._new_path, self._path)

    def _remove_new(self):
        if _exists(self._new_path):
            os.remove(self._new_path)

    @staticmethod
    def _read(path):
        # Returns (sections, None), (None, None) if there is no file, (None, line) if it is broken.
        try:
            if os.stat(path)[6] > LARGEST:
                return None, f"{path} is broken: more than {LARGEST} bytes"
            with open(path, "rb") as file:
                sections = parse(file.read())
        except OSError as error:
            if error.errno == _ENOENT:
                return None, None
            return None, f"{path} cannot be read: OSError {error}"
        except MemoryError:
            return None, f"{path} cannot be read: out of memory"
        except (ValueError, TypeError, RuntimeError):
            return None, f"{path} is broken: no valid JSON"
        if not isinstance(sections, dict):
            return None, f"{path} is broken: no JSON object"
        return sections, None


def _holds(path, data):
    with open(path, "rb") as file:
        for start in range(0, len(data), _PIECE):
            if file.read(_PIECE) != data[start : start + _PIECE]:
                return False
        return not file.read(1)


def _exists(path):
    try:
        os.stat(path)
    except OSError:
        return False
    return True
