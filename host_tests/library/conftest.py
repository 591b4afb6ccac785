"""Fixtures of the library's tests."""

import pytest
from targets import CPython, Rp2040, Target, Unix


@pytest.fixture(scope="module", params=["cpython", "unix", "rp2040"])
def target(request: pytest.FixtureRequest) -> Target:
    """Each interpreter in turn; one instance, so one boot, serves all tests of a module."""
    if request.param == "cpython":
        return CPython()
    if request.param == "unix":
        return Unix()
    return Rp2040(request.getfixturevalue("micropython_image"))


@pytest.fixture(scope="module")
def unix() -> Unix:
    """MicroPython's unix port alone, for what would take an emulated chip too long."""
    return Unix()
