"""The whole firmware on MicroPython's unix port, with the ESP32's `machine` in its place."""
