"""The start of the control path, by the configuration."""

import sys

_OLDEST_MICROPYTHON = (1, 25)


def control_path():
    """Returns the configuration and the `Adapter`, not started; tells what is wrong.

    Raises `ValueError` for what cannot be, and `OSError` if the hardware is taken.
    """
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
