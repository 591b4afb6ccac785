"""What a frozen image runs at boot: the user's /main.py if there is one, else the firmware.

MicroPython looks for a frozen main.py first, so that this one has to look for the other.
"""

from os import stat

try:
    stat("/main.py")
except OSError:
    from firmware.app import main

    main()
else:
    execfile("/main.py")  # noqa: F821 - MicroPython's own
