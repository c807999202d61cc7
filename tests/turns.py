"""Settings of a test of which every run takes some, and those marked ``slow`` all."""

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


def mostly_slow(every, *in_every_run):
    """All of them, of which only the named ones are not slow."""
    assert set(in_every_run) <= set(every)
    return [
        each if each in in_every_run else pytest.param(each, marks=pytest.mark.slow)
        for each in every
    ]
