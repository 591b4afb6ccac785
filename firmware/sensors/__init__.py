"""The sensors whose values go to the pilot's radio; each is a file that a board may leave out.

A sensor is an object with

* `update(now_ms)`: one step, called in every round of the main loop with `time.ticks_ms()`. It
  does what can be done at once, never blocks more than 5 ms, and never raises for anything that
  the hardware does. Returns True when there are new values. Code that only some hardware needs is
  loaded when that answers; the step that does so takes up to 150 ms, once.
* its values as attributes, integers with the unit in the name, None where not known.
* `faults`: how often the hardware did not do what it should, modulo 2^30.
* `describe()`: one line for the status, such as "16.71 V, 12.3 A"; may allocate.

Buses, pins and UARTs are handed in ready made. Impossible options raise `ValueError`.
"""
