# host only
"""CPython stand-ins for MicroPython's viper, so that the same sources run on both.

MicroPython compiles the functions marked `@micropython.viper` to machine code; pointer parameters
are then raw addresses. Here they become `memoryview`s of the same element type, so an index
outside the buffer raises `IndexError` instead of reading foreign memory.
"""

import functools
import inspect
import threading


class _Pointer:
    """Turns a buffer into a view of unsigned bytes, unsigned halfwords or signed words."""

    def __init__(self, code):
        self.code = code

    def __call__(self, buffer):
        if type(buffer) is memoryview and buffer.format == self.code:
            return buffer
        view = memoryview(buffer)
        return view if view.format == self.code else view.cast("B").cast(self.code)


ptr8 = _Pointer("B")
ptr16 = _Pointer("H")
ptr32 = _Pointer("i")


def uint(value):
    """Returns `value` as the unsigned 32-bit number that viper makes of it."""
    return value & 0xFFFFFFFF


def const(value):
    """Returns `value`; MicroPython's compiler folds it into the code."""
    return value


def one_at_a_time(function):
    """Returns `function` with a lock: threads that call it together wait for each other."""
    lock = threading.Lock()

    @functools.wraps(function)
    def alone(*arguments):
        with lock:
            return function(*arguments)

    return alone


class micropython:
    """Carries the decorators under the names that MicroPython's compiler looks for."""

    @staticmethod
    def native(function):
        """Returns `function`; MicroPython compiles it to machine code that behaves the same."""
        return function

    @staticmethod
    def viper(function):
        """Converts the pointer parameters of `function`, as a viper function does on entry."""
        parameters = inspect.signature(function).parameters.values()
        pointers = tuple(
            (position, parameter.annotation)
            for position, parameter in enumerate(parameters)
            if isinstance(parameter.annotation, _Pointer)
        )
        if not pointers:
            return function

        @functools.wraps(function)
        def convert(*arguments):
            values = list(arguments)
            for position, pointer in pointers:
                values[position] = pointer(values[position])
            return function(*values)

        return convert
