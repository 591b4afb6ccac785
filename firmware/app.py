"""Flies what the configuration describes until Ctrl-C, and leaves the pins quiet."""

import time

import micropython
from micropython import const

_LOOP_MS = const(3)  # more than one round for each slot at 160 Hz, with what a round takes
_CTRL_C = const(3)
# What a user's code may raise without stopping anything: all but Ctrl-C.
_FAULTS = (Exception, SystemExit)


def run(application):
    """The main loop, until Ctrl-C. An exception in it is counted and shown, and costs no pulse."""
    reporter = application.reporter
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
    from firmware.start import control_path

    try:
        here, adapter = control_path()
    except ValueError as error:
        print(f"micropython-ghst: {error}. Nothing moves.")
        return
    except OSError as error:
        print(f"micropython-ghst: DMA or PIO is taken by something else: {error}. Nothing moves.")
        return
    try:
        adapter.start()
        try:
            control_path = None
            # The servos follow already: loading the rest takes a quarter of a second.
            from firmware.equip import equip

            application = equip(here, adapter)
            here = equip = None
            from firmware.forget import erase

            erase("firmware.equip")
            run(application)
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
