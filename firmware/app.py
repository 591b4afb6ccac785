"""The application: reads the board's description, flies, and leaves the pins quiet."""

import sys
import time

import machine
import micropython

from firmware import board, chip
from firmware.adapter import Adapter
from firmware.chip import this_chip
from firmware.report import Reporter
from ghst import __version__

_OLDEST_MICROPYTHON = (1, 25)
_LOOP_MS = 20
_CTRL_C = 3


def _prepare(path):
    if sys.implementation.version[:2] < _OLDEST_MICROPYTHON:
        version = ".".join(str(part) for part in sys.implementation.version[:3])
        raise board.BoardError(f"MicroPython {version} is too old: 1.25 or newer is needed")
    here = board.load(path)
    name = this_chip().NAME
    if here.chip != name:
        raise board.BoardError(f"{path} is for an {here.chip}, this is an {name}")
    return here, Adapter(
        here.wire, here.servos, failsafe=here.failsafe, failsafe_ms=here.failsafe_ms, led=here.led
    )


def _hello(here):
    servos = " ".join(f"GP{pin}={here.servos[pin]}" for pin in sorted(here.servos))
    version = ".".join(str(part) for part in sys.implementation.version[:3])
    text = f"micropython-ghst {__version__} on {here.name}, MicroPython {version}\n"
    text += f"wire GP{here.wire}, servos {servos}, failsafe after {here.failsafe_ms} ms"
    # reset_cause() cannot tell a time-out from machine.reset(), which uses the watchdog too.
    if machine.mem32[this_chip().WATCHDOG + chip.WATCHDOG_REASON] & 1:
        text += "\nrestarted by the watchdog"
    return text


def run(adapter, hello):
    """The main loop, until Ctrl-C. An exception in it is counted and shown, and costs no pulse.

    `hello` is what a press of Enter shows before the state of the link.
    """
    print(hello)
    reporter = Reporter(hello)
    faults = 0
    fault = None

    def report():
        reporter.update(adapter, faults, fault)

    while True:
        for step in (adapter.poll, report):
            try:
                step()
            except Exception as error:
                faults += 1
                fault = error
        time.sleep_ms(_LOOP_MS)


def main(path="/board.json"):
    """Starts the adapter that `path` describes and runs it until Ctrl-C."""
    try:
        here, adapter = _prepare(path)
    except (board.BoardError, ValueError) as error:
        print(f"micropython-ghst: {error}. Nothing moves.")
        return
    except OSError as error:
        print(f"micropython-ghst: DMA or PIO is taken by something else: {error}. Nothing moves.")
        return
    try:
        adapter.start()
        run(adapter, _hello(here))
    except KeyboardInterrupt:
        pass
    finally:
        while True:
            try:
                # From here on no Ctrl-C is taken; one may be pending, then all of it once more.
                micropython.kbd_intr(-1)
                adapter.stop()
                break
            except KeyboardInterrupt:
                pass
        micropython.kbd_intr(_CTRL_C)
        print("micropython-ghst stopped, pins quiet, watchdog paused. Start again: main()")
