"""The Pareto front as it is defined, point against point."""

import math


def literal_front(cost, error):
    """Whether no other point beats each: n^2 comparisons."""
    points = list(zip(cost, error, strict=True))
    return [
        all(map(math.isfinite, point))
        and not any(_beats(j, other, i, point) for j, other in enumerate(points) if j != i)
        for i, point in enumerate(points)
    ]


def _beats(j, other, i, point):
    if not all(map(math.isfinite, other)):
        return False
    no_worse = other[0] <= point[0] and other[1] <= point[1]
    better = other[0] < point[0] or other[1] < point[1]
    return no_worse and (better or j < i)  # of equals the first
