"""Settings in a real file: what is read, kept, refused, and left behind by saves cut short."""

import json
import os
import sys

import firmware.settings as module
from firmware.settings import LARGEST, Settings

from behaviour.support import equal, sample

_OLD = '{"vtx": {"power": 1, "band": 5}}'
_NEW = '{"vtx": {"power": 3}, "compass": {"offsets": [1, -2, 3]}}'
# Cut short, empty, bytes that are no text, no object, sections that are none, names that are none.
_BROKEN = (
    _OLD[:-1],
    _OLD[:9],
    "",
    " ",
    "[[[[",
    b"\xff\xfe{}",
    b"\x00" * 40,
    "[1]",
    "null",
    '"vtx"',
    _OLD + "x",
)
_SUFFIXES = ("", ".new", ".broken")


def _in_a_folder(test):
    """Runs `test(path)` with a folder of its own; nothing of it is left behind."""
    name = "".join(f"{byte:02x}" for byte in os.urandom(8))
    folder = ("/" if sys.platform == "rp2" else "/tmp/") + "settings-" + name
    os.mkdir(folder)
    path = folder + "/ghst.json"
    try:
        test(path)
    finally:
        for suffix in _SUFFIXES:
            _put(path + suffix, None)
        os.rmdir(folder)


def _put(path, content):
    """Makes a file of text or bytes; none for None."""
    if content is None:
        if _get(path) is not None:
            os.remove(path)
        return
    with open(path, "wb") as file:
        file.write(content if isinstance(content, bytes) else content.encode())


def _get(path):
    """The contents of a file as bytes, None if there is none."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except OSError:
        return None


def _expect(path, main, new=None, broken=None):
    """Which JSON object is in the file, and which bytes in those beside it."""
    found = _get(path)
    equal(found and json.loads(found), main, "the file")
    equal(_get(path + ".new"), new, ".new")
    equal(_get(path + ".broken"), broken, ".broken")


def _loaded(path):
    settings = Settings(path)
    settings.load()
    return settings


def _values(settings):
    """All that the tests put into settings, as far as it is there."""
    found = {}
    for section, key in (("vtx", "power"), ("vtx", "band"), ("compass", "offsets")):
        value = settings.get(section, key)
        if value is not None:
            found.setdefault(section, {})[key] = value
    return found


def no_file_is_no_settings():
    def test(path):
        settings = _loaded(path)
        equal((settings.error, settings.changed, settings.saves), (None, False, 0))
        equal(settings.get("vtx", "power"), None)
        equal(settings.get("vtx", "power", 7), 7)
        settings.request_save()
        equal(settings.poll(True), False)
        _expect(path, None)

    _in_a_folder(test)


def what_is_set_is_there_at_once_and_after_a_restart_if_it_was_saved():
    def test(path):
        settings = _loaded(path)
        settings.set("vtx", "power", 3)
        settings.set("compass", "offsets", (1, -2, 3))
        equal(settings.changed, True)
        equal(settings.poll(True), False)
        settings.request_save()
        equal(settings.poll(False), False)
        _expect(path, None)
        equal(_values(settings), json.loads(_NEW))
        equal(settings.poll(True), True)
        equal((settings.changed, settings.saves, settings.error), (False, 1, None))
        _expect(path, json.loads(_NEW))
        equal(settings.poll(True), False)
        again = _loaded(path)
        equal(_values(again), json.loads(_NEW))
        equal((again.error, again.changed, again.saves), (None, False, 0))

    _in_a_folder(test)


def every_kind_of_value_comes_back():
    values = (None, True, False, 0, 1, -1, 1 << 40, 0.5, -1.5e10, "", 'a "b" \\ \n \xe4 \u20ac')
    values += ([], [1, 0.25, "x", None, True], list(range(50)))

    def test(path):
        settings = _loaded(path)
        for index, value in enumerate(values):
            settings.set("all", str(index), value)
        settings.request_save()
        equal(settings.poll(True), True)
        again = _loaded(path)
        for index, value in enumerate(values):
            found = again.get("all", str(index), "nothing")
            equal((type(found), found), (type(value), value))

    _in_a_folder(test)


def only_a_change_is_a_change():
    def test(path):
        _put(path, '{"a": {"one": 1, "list": [1, 2]}}')
        settings = _loaded(path)
        settings.set("a", "one", 1)
        settings.set("a", "list", (1, 2))
        equal(settings.changed, False)
        settings.request_save()
        equal(settings.poll(True), False)
        # The request was answered: there was nothing to save.
        settings.set("a", "one", True)
        equal((settings.changed, settings.poll(True)), (True, False))
        settings.set("a", "one", 1.0)
        settings.set("a", "list", [2, 1])
        settings.request_save()
        equal((settings.poll(True), settings.saves), (True, 1))
        _expect(path, {"a": {"one": 1.0, "list": [2, 1]}})

    _in_a_folder(test)


def a_list_is_kept_as_it_was_when_it_was_set():
    settings = Settings("/nowhere/ghst.json")
    offsets = [1, 2]
    settings.set("compass", "offsets", offsets)
    offsets.append(3)
    equal(settings.get("compass", "offsets"), [1, 2])


def what_no_file_can_hold_is_refused():
    settings = Settings("/nowhere/ghst.json")
    for value in (
        b"x",
        {},
        {1: 2},
        [[1]],
        [b"x"],
        (None, ()),
        settings,
        float("inf"),
        [1e400 * 0],
    ):
        try:
            settings.set("a", "b", value)
        except ValueError as error:
            assert "a.b" in str(error) and "\n" not in str(error)
        else:
            raise AssertionError(f"{value!r} was taken")
    for section, key in ((1, "b"), ("a", None), (b"a", "b")):
        try:
            settings.set(section, key, 1)
        except ValueError as error:
            assert "strings" in str(error)
        else:
            raise AssertionError(f"{section!r}, {key!r} was taken")
    equal((settings.changed, settings.get("a", "b")), (False, None))


def a_broken_file_is_told_and_kept_and_nothing_is_saved_in_its_place():
    def test(path):
        for content in sample(_BROKEN, 3):
            _put(path, content)
            settings = _loaded(path)
            assert path in settings.error and "\n" not in settings.error, content
            equal(_values(settings), {})
            # Nothing is written unless somebody wants it.
            equal(settings.poll(True), False)
            bytes_of = content if isinstance(content, bytes) else content.encode()
            equal((_get(path), _get(path + ".broken")), (bytes_of, None))
            # A file with nothing but this would let all outputs move as by default.
            settings.set("vtx", "power", 3)
            settings.request_save()
            equal(settings.poll(True), False)
            assert "put it in order" in settings.error, settings.error
            equal(
                (_get(path), _get(path + ".new"), _get(path + ".broken")), (bytes_of, None, None)
            )
            # A whole new file may be: the user's own is kept beside it.
            equal(settings.replace(b'{"vtx": {"power": 3}}'), True)
            _expect(path, {"vtx": {"power": 3}}, broken=bytes_of)
            # The next save leaves that alone.
            settings.set("vtx", "power", 4)
            settings.request_save()
            equal(settings.poll(True), True)
            _expect(path, {"vtx": {"power": 4}}, broken=bytes_of)
            _put(path + ".broken", None)

    _in_a_folder(test)


def what_is_no_section_is_kept():
    def test(path):
        tree = {"name": "Wing", "vtx": 5, "outputs": {"6": {"channel": 3}}}
        _put(path, json.dumps(tree))
        settings = _loaded(path)
        equal((settings.error, settings.get("vtx", "power", 7)), (None, 7))
        for section in ("vtx", "name"):
            try:
                settings.set(section, "power", 1)
            except ValueError as error:
                assert section in str(error)
            else:
                raise AssertionError(section)
        settings.set("gps", "configure", False)
        settings.request_save()
        equal(settings.poll(True), True)
        tree["gps"] = {"configure": False}
        equal(json.loads(_get(path)), tree)

    _in_a_folder(test)


def a_file_that_ends_too_early_is_broken():
    def test(path):
        for length in sample(range(len(_NEW)), 7):
            _put(path, _NEW[:length])
            assert _loaded(path).error, length
        _put(path, _NEW + " \n")
        equal(_loaded(path).error, None)

    _in_a_folder(test)


def a_file_that_is_too_large_is_broken_and_not_written():
    def test(path):
        _put(path, '{"a": {"b": "' + "x" * (LARGEST - 13) + '"}}')
        assert "bytes" in _loaded(path).error
        settings = Settings(path)
        for index in range(17):
            settings.set("a", str(index), "x" * 1000)
        settings.request_save()
        equal((settings.poll(True), settings.changed, settings.saves), (False, True, 0))
        assert path in settings.error and "\n" not in settings.error
        # It waits for another request, and then is right again.
        equal(settings.poll(True), False)
        settings.set("a", "0", None)
        settings.set("a", "1", None)
        settings.request_save()
        equal((settings.poll(True), settings.error), (True, None))
        equal(_loaded(path).get("a", "8"), "x" * 1000)

    _in_a_folder(test)


def what_cannot_be_written_is_told_and_kept_here():
    settings = Settings("/no-such-folder/ghst.json")
    settings.load()
    equal(settings.error, None)
    settings.set("vtx", "power", 3)
    settings.request_save()
    equal((settings.poll(True), settings.saves, settings.changed), (False, 0, True))
    assert "/no-such-folder/ghst.json" in settings.error and "\n" not in settings.error
    equal(settings.get("vtx", "power"), 3)


class _Forgetful:
    """A file that loses the last byte of what is written to it."""

    def __init__(self, path, mode="r"):
        self._file = open(path, mode)  # noqa: SIM115
        self.read = self._file.read

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self._file.close()

    def write(self, data):
        return self._file.write(bytes(data)[:-1])


def a_new_file_that_reads_back_differently_takes_nobody_s_place():
    def test(path):
        _put(path, _OLD)
        settings = _loaded(path)
        settings.set("vtx", "power", 3)
        settings.request_save()
        module.open = _Forgetful
        try:
            equal((settings.poll(True), settings.saves, settings.changed), (False, 0, True))
        finally:
            del module.open
        assert "reads back differently" in settings.error, settings.error
        equal(_get(path), _OLD.encode())
        settings.request_save()
        equal((settings.poll(True), settings.error), (True, None))
        equal(json.loads(_get(path)), {"vtx": {"power": 3, "band": 5}})

    _in_a_folder(test)


def a_file_that_cannot_be_read_now_is_no_missing_file_and_nothing_takes_its_place():
    class Unreadable:
        error = None

        def stat(self, path):
            if path.endswith(".json"):
                raise self.error
            return os.stat(path)

    def test(path):
        _put(path, _OLD)
        for module.os.error, text in ((OSError(5), "cannot be read"), (MemoryError(), "memory")):
            settings = _loaded(path)
            assert path in settings.error and text in settings.error, settings.error
            settings.set("vtx", "power", 3)
            settings.request_save()
            equal(settings.poll(True), False)
            equal(_get(path), _OLD.encode())

    module.os = Unreadable()
    try:
        _in_a_folder(test)
    finally:
        module.os = os


def a_folder_in_place_of_the_file_is_told_and_kept():
    def test(path):
        os.mkdir(path)
        settings = _loaded(path)
        assert path in settings.error
        settings.set("vtx", "power", 3)
        settings.request_save()
        equal(settings.poll(True), False)
        assert os.listdir(path) == []
        equal(settings.replace(b'{"vtx": {"power": 3}}'), True)
        _expect(path, {"vtx": {"power": 3}})
        os.rmdir(path + ".broken")

    _in_a_folder(test)


def what_a_save_leaves_behind_when_it_is_cut_off():
    old, new = json.loads(_OLD), json.loads(_NEW)
    broken = _OLD[:-3]
    raw = broken.encode()
    cases = (
        # While the new file was written: the old one counts. After that: the new one.
        (None, _NEW[:20], {}, (None,)),
        (None, "", {}, (None,)),
        (_OLD, _NEW[:20], old, (old,)),
        (_OLD, "", old, (old,)),
        (_OLD, _NEW, old, (old,)),
        (None, _NEW, new, (new,)),
        (broken, _NEW[:20], {}, (broken,)),
        (broken, _NEW, new, (new, None, raw)),
    )
    for main, beside, loaded, left in sample(cases, 4):

        def test(path, main=main, beside=beside, loaded=loaded, left=left):
            _put(path, main)
            _put(path + ".new", beside)
            settings = _loaded(path)
            equal(_values(settings), loaded)
            equal(settings.error is None, left[0] != broken)
            # Loading writes nothing, and nothing is written while the link is up.
            equal(settings.poll(False), False)
            equal(_get(path + ".new"), beside.encode())
            equal(settings.poll(True), False)
            if left[0] == broken:
                equal((_get(path), _get(path + ".new")), (raw, None))
            else:
                _expect(path, *left)
            # And it can be saved to, unless it is broken.
            settings.set("vtx", "power", 9)
            settings.request_save()
            equal(settings.poll(True), left[0] != broken)
            if left[0] == broken:
                equal(settings.replace(b'{"vtx": {"power": 9}}'), True)
            equal(_loaded(path).get("vtx", "power"), 9)
            equal(_get(path + ".broken"), raw if main == broken else None)

        _in_a_folder(test)


def a_save_finishes_what_was_left_first():
    def test(path):
        _put(path, "broken")
        _put(path + ".new", _NEW)
        settings = _loaded(path)
        settings.set("vtx", "power", 4)
        settings.request_save()
        equal(settings.poll(True), True)
        wanted = json.loads(_NEW)
        wanted["vtx"]["power"] = 4
        _expect(path, wanted, broken=b"broken")

    _in_a_folder(test)


def a_whole_file_takes_the_place_of_the_old_one_byte_for_byte():
    text = b'{ "vtx" : {"power": 3},\n\t"name": "Wing"}\n' + b" " * 600

    def test(path):
        for before in sample((_OLD, None, _BROKEN[0], text), 2):
            _put(path, before)
            settings = _loaded(path)
            settings.set("vtx", "band", 7)
            equal(settings.replace(memoryview(text)), True)
            equal((_get(path), _get(path + ".new")), (text, None))
            # What was set before and not saved is not in it, and does not come back.
            equal((settings.changed, settings.error, settings.saves), (False, None, 1))
            equal(_values(settings), {"vtx": {"power": 3}})
            settings.request_save()
            equal(settings.poll(True), False)
            broken = _BROKEN[0].encode() if before == _BROKEN[0] else None
            equal(_get(path + ".broken"), broken)
            # Later changes are changes of the new one.
            settings.set("vtx", "band", 5)
            settings.request_save()
            equal(settings.poll(True), True)
            _expect(path, {"vtx": {"power": 3, "band": 5}, "name": "Wing"}, broken=broken)
            _put(path + ".broken", None)

    _in_a_folder(test)


def a_file_that_cannot_take_the_place_leaves_the_old_one():
    def test(path):
        _put(path, _OLD)
        settings = _loaded(path)
        equal(settings.replace(b" " * (LARGEST + 1)), False)
        assert f"{LARGEST + 1} bytes" in settings.error
        _expect(path, json.loads(_OLD))
        equal(_values(settings), json.loads(_OLD))

    _in_a_folder(test)
    settings = Settings("/no-such-folder/ghst.json")
    settings.load()
    equal((settings.replace(b"{}"), settings.saves), (False, 0))
    assert "/no-such-folder/ghst.json" in settings.error


def no_bytes_make_loading_raise():
    def test(path):
        seed = 1
        words = ("{", "}", "[", "]", ":", ",", '"a"', '"', "1", "-", "1e9", "null", " ", "\\", "t")
        for _ in sample(range(300), 12):
            text = ""
            for _ in range(seed % 12):
                seed = seed * 16807 % 2147483647
                text += words[seed % len(words)]
            seed = seed * 16807 % 2147483647
            _put(path, '{"a": ' + text if seed % 3 else text.encode() + bytes([seed % 256]))
            settings = _loaded(path)
            settings.get("a", "a")
            if settings.error:
                assert "\n" not in settings.error

    _in_a_folder(test)
