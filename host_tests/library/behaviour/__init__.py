"""The behaviour of `lib/ghst`, written once for CPython and MicroPython.

Every public function of a module in here is one test without arguments: it returns when the
behaviour is right and raises AssertionError when it is not. `support` is no test module. What
runs these on each interpreter is `targets.py`, one folder up.
"""
