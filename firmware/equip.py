"""Builds the application around a control path that flies, and forgets what the start has needed.

Code that was loaded from files is in RAM until nothing holds it any more. What only the start
needs is taken out of the modules of the control path, and they leave `sys.modules`: the next
start loads them whole.
"""

import gc
import sys

from firmware.forget import erase, forget, remove
from ghst import __version__

# What a user's code may raise without stopping anything: all but Ctrl-C.
_FAULTS = (Exception, SystemExit)

# Of each module: its names, and those of its class, which only the start needs.
_START_ONLY = (
    ("firmware.adapter", "_parts", "Adapter", "__init__ start"),
    (
        "firmware.control",
        "asm_pio rp2 frame_handler tick_handler scan",
        "Control",
        "__init__ start restarted",
    ),
    (
        "firmware.outputs",
        "by_pin shapes _RATES _divider _counts _top _scale _word",
        "ServoOutputs",
        "__init__ lost_address shape _claim _prepare",
    ),
    (
        "firmware.shapes",
        "",
        "Shapes",
        "__init__ add _link set_arming set_link_limits _channel lost_address",
    ),
    ("firmware.slot_pio", "asm_pio rp2 PIO", "PioSlot", "__init__ start"),
    (
        "firmware.wire_pio",
        "asm_pio rp2 PIO",
        "PioWire",
        "__init__ start _start_dma _release_stale_channels",
    ),
)


def equip(here, adapter):
    """Returns the `Application` around a started adapter, with `/user.py`; tells what is here.

    `here`: the configuration, of which nothing is left.
    """
    from firmware.application import Application

    hello = _hello(here, adapter.control.restarted)
    print(hello)
    application = Application(here, adapter, hello + "\n")
    here.board = here.values = None
    _reduce()
    fault = _add_user(application)
    names = sorted(list(application.sensors) + list(application.search.waiting))
    found = "sensors: " + ", ".join(names) + "\n" if names else ""
    application.reporter.hello += found
    for line in application.missing:
        found += f"sensor left out: {line}\n"
    print(found, end="")
    if fault:
        application.reporter.count(fault)
    return application


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


def _reduce():
    """Takes out of the control path what only its start needs, and forgets the rest."""
    import __main__

    modules = [sys.modules.get(name) for name, _, _, _ in _START_ONLY]
    # First: if Ctrl-C comes in the middle, the next start must find nothing that is not whole.
    forget(*[name for name, _, _, _ in _START_ONLY])
    for module, (_, names, owner, members) in zip(modules, _START_ONLY):  # noqa: B905
        if module is not None:
            if owner:
                remove(getattr(module, owner), *members.split())
            remove(module, *names.split())
    # The interrupts have no global names.
    erase("firmware.interrupts", "firmware.configuration", "firmware.start", "firmware.parts_")
    erase("firmware.devices", "firmware.json_text", "ghst_board")
    forget("firmware.output", "firmware.shape_", "rp2")
    # MicroPython's own start leaves it there.
    remove(__main__, "rp2")
    gc.collect()
