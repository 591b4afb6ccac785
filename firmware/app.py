"""The application: reads the configuration, flies, and leaves the pins quiet."""

import gc
import sys
import time

import micropython

from ghst import __version__

_OLDEST_MICROPYTHON = (1, 25)
_LOOP_MS = 3  # more than one round for each slot at 160 Hz, with what a round takes
_CTRL_C = 3
# What a user's code may raise without stopping anything: all but Ctrl-C.
_FAULTS = (Exception, SystemExit)


def _prepare():
    from firmware.configuration.build import adapter
    from firmware.configuration.load import BoardError, load

    if sys.implementation.version[:2] < _OLDEST_MICROPYTHON:
        version = ".".join(str(part) for part in sys.implementation.version[:3])
        raise ValueError(f"MicroPython {version} is too old: 1.25 or newer is needed")
    try:
        here = load()
    except BoardError as error:
        raise ValueError(error) from None
    # "Raspberry Pi Pico with RP2040", "Generic ESP32S3 module with ESP32S3".
    name = sys.implementation._machine.split(" with ")[-1].lower()
    if here.board["chip"] != name:
        raise ValueError(f"/board.json is for an {here.board['chip']}, this is an {name}")
    for problem in here.problems:
        print(f"micropython-ghst: {problem}. Nothing moves.")
    return here, adapter(here)


def forget(*prefixes):
    """Gives the memory of modules back whose names begin so, and which nothing else holds."""
    for name in list(sys.modules):
        if name.startswith(prefixes):
            del sys.modules[name]
            package, _, last = name.rpartition(".")
            if package in sys.modules:
                delattr(sys.modules[package], last)


def _hello(here, restarted):
    """Returns what is said as soon as servos can move.

    `here`: the configuration; `restarted`: whether by the watchdog.
    """
    values = here.values
    version = ".".join(str(part) for part in sys.implementation.version[:3])
    text = f"micropython-ghst {__version__} on {here.board['name']}, MicroPython {version}\n"
    text += f"wire GP{values['wire']['pin']}, "
    if here.problems:
        text += f"nothing moves: {here.problems[0]}"
    elif values[""]["role"] == "goggles":
        text += "goggles"
    else:
        outputs = values["outputs"]
        servos = " ".join(f"GP{pin}={outputs[pin]['channel']}" for pin in sorted(outputs))
        text += f"servos {servos}, failsafe after {values['failsafe']['time_ms']} ms"
    if restarted:
        text += "\nrestarted by the watchdog"
    return text


def _found(application):
    """Returns lines about sensors and settings, each with its line feed."""
    text = ""
    if application.sensors:
        text += "sensors: " + ", ".join(sorted(application.sensors)) + "\n"
    for line in application.missing:
        text += f"sensor left out: {line}\n"
    return text


def _add_user(application):
    """Has `/user.py`, if there is one, add to the application; returns what went wrong or None."""
    try:
        import user
    except ImportError as error:
        # One that is there and imports what is not there is a mistake to be told.
        return None if "'user'" in str(error) else error
    except _FAULTS as error:
        return error
    try:
        user.setup(application)
    except _FAULTS as error:
        return error
    return None


def run(application, hello, fault=None):
    """The main loop, until Ctrl-C. An exception in it is counted and shown, and costs no pulse.

    `hello` is what a press of Enter shows before the state of the link; `fault`: an exception
    from before.
    """
    from firmware.report import Reporter

    reporter = Reporter(application, hello)
    if fault:
        reporter.count(fault)
    application.console.add("", reporter.show, "(Enter): the state of everything")
    steps = application.steps
    rest = application.adapter.control.rest
    began_us = time.ticks_us()
    while True:
        for step in steps:
            try:
                # The time of each step: one before it may have loaded something for 60 ms.
                step(time.ticks_ms())
            except _FAULTS as error:
                reporter.count(error)
        try:
            reporter.update()
        except _FAULTS as error:
            reporter.count(error)
        rest(_LOOP_MS)
        now_us = time.ticks_us()
        application.cycle_time_us = time.ticks_diff(now_us, began_us)
        began_us = now_us


def main():
    """Starts the adapter that the configuration describes and runs it until Ctrl-C."""
    try:
        here, adapter = _prepare()
    except ValueError as error:
        print(f"micropython-ghst: {error}. Nothing moves.")
        return
    except OSError as error:
        print(f"micropython-ghst: DMA or PIO is taken by something else: {error}. Nothing moves.")
        return
    try:
        adapter.start()
        try:
            hello = _hello(here, adapter.control.restarted)
            print(hello)
            forget("firmware.configuration", "firmware.parts_")
            # The servos follow already: loading the rest takes most of a second.
            from firmware.application import Application

            application = Application(here, adapter)
            here = None
            forget("firmware.devices", "firmware.json_text", "ghst_board")
            gc.collect()
            fault = _add_user(application)
            found = _found(application)
            print(found, end="")
            run(application, hello + "\n" + found, fault)
        except _FAULTS as error:
            # Something is broken that is not the control path: fly without the rest.
            print(f"micropython-ghst: no sensors, no telemetry: {type(error).__name__}: {error}")
            while True:
                adapter.poll()
                time.sleep_ms(_LOOP_MS)
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
