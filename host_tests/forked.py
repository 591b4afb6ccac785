"""Has tests run in a fork, so that many can start from one booted board."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import pytest

from ghst_tools.campaign.fork import ChildError, in_child


def forked(test: Callable[..., None]) -> Callable[..., None]:
    """Has `test` run in a fork."""

    @functools.wraps(test)
    def run(*args: Any, **kwargs: Any) -> None:
        try:
            in_child(lambda: test(*args, **kwargs))
        except ChildError as error:
            pytest.fail(str(error), pytrace=False)

    return run
