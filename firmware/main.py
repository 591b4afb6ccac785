"""What MicroPython runs at boot."""

from firmware.app import main

main()
