"""Pairs of settings for tests of both: each setting in every run, each pair under ``slow``."""

import pytest


def in_turn(first, second):
    """Every pair; those that are not slow have each of the first once, with the second by turns.

    A setting that is a tuple takes as many arguments.
    """
    return [
        pytest.param(
            *(one if isinstance(one, tuple) else (one,)),
            other,
            marks=() if j == k % len(second) else pytest.mark.slow,
        )
        for k, one in enumerate(first)
        for j, other in enumerate(second)
    ]
