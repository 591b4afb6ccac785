"""Tuning the video receiver takes no memory."""

from firmware.rx5808 import Rx5808

from behaviour.telemetry_memory import _expect_no_heap


class _Pin:
    OUT = 1

    def init(self, mode, value):
        self.value(value)

    def value(self, level):
        self.level = level


def tuning():
    receiver = Rx5808(_Pin(), _Pin(), _Pin())
    _expect_no_heap([lambda: receiver.set_frequency(5800), lambda: receiver.set_frequency(5299)])
