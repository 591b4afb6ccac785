"""Hard-iron calibration: a circle gives the offset, a part of one is refused."""

from firmware.sensors.hard_iron import HardIron

from behaviour.support import equal, sample

# A circle in steps of 15 degrees: 1000 times the cosine and the sine.
_COSINES = (1000, 966, 866, 707, 500, 259, 0, -259, -500, -707, -866, -966)
_COSINES += tuple([-cosine for cosine in _COSINES])
_OFFSET = (31_000, -18_000, 7_000)


def _turned(steps, radius=20, start=0, turns=3, rise=0):
    """A calibration that has seen `steps` of 24 directions, `turns` times."""
    circle = HardIron()
    for _ in range(turns):
        for step in range(start, start + steps):
            x = _OFFSET[0] + radius * _COSINES[step % 24]
            y = _OFFSET[1] + radius * _COSINES[(step + 18) % 24]
            circle.update((x, y, _OFFSET[2] + rise * _COSINES[(3 * step) % 24]))
    return circle


def _refused(circle, because):
    try:
        found = circle.offset_nt(0)
    except ValueError as error:
        assert because in str(error), error
    else:
        raise AssertionError(found)


def a_circle_gives_the_offset():
    for start in sample(range(0, 24, 5), 2):
        equal(_turned(24, start=start).offset_nt(-5), (31_000, -18_000, -5))


def z_is_found_when_the_model_was_turned_over_as_well():
    equal(_turned(24, rise=20).offset_nt(-5), _OFFSET)
    equal(_turned(24, rise=11).offset_nt(-5), (31_000, -18_000, -5))


def parts_of_a_circle_are_refused():
    for steps in sample((9, 12, 15, 17), 2):
        for start in sample(range(0, 24, 3), 2):
            _refused(_turned(steps, start=start, turns=6), "not complete")
    _refused(_turned(2, turns=25), "changed by 5 uT only")


def too_few_measurements():
    _refused(HardIron(), "only 0 measurements")
    _refused(_turned(24, turns=2), "only 48 measurements")


def fields_that_cannot_be_the_earths():
    _refused(_turned(24, radius=7), "changed by 14 uT only: turn the model a full circle")
    _refused(_turned(24, radius=76), "keep away from motors and magnets")


def an_ellipse_of_soft_iron_still_has_a_middle():
    circle = HardIron()
    for step in range(96):
        x = 20 * _COSINES[step % 24]
        y = 14 * _COSINES[(step + 18) % 24]
        circle.update((x + y + 900, x - y - 500, 0))
    equal(circle.offset_nt(1), (900, -500, 1))
