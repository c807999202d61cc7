"""Control variates under still and moving light: the supplement's table, medians over 200 seeds."""

import functools

import pytest
from published import Published, check, what

from sssfit.motion.table import (
    COLUMNS,
    PUBLISHED,
    PUBLISHED_COEFFICIENTS,
    measure_table,
    residual_integral,
)

TITLE = "Xie and Olano 2021"
SOURCE = (
    'T. Xie, M. Olano, "Real-time subsurface control variates: temporally stable adaptive '
    'sampling", *Proceedings of the ACM on Computer Graphics and Interactive Techniques* 4(1), '
    "2021, supplement; ours are medians over 200 seeds"
)
# Of a published value: quartiles over the seeds are up to 14 % of the median apart.
_SHARE = 0.2
_COEFFICIENTS = {
    "still": "optimal coefficient, still light",
    "moving": "optimal coefficient, moving light",
    "in_frame": "optimal coefficient, moving light, variate constant in a frame",
}


@functools.cache
def measured():
    """Return the table as JSON has it."""
    return measure_table(seeds=200).to_dict()


FIGURES = [
    *(
        Published(
            "table 1",
            f"{name}, {light} light",
            f"{value:.4f}",
            lambda light=light, name=name: measured()["table"][light][name],
            within=round(_SHARE * value, 6),
        )
        for light, row in PUBLISHED.items()
        for name, value in zip(COLUMNS, row, strict=True)
    ),
    *(
        Published(
            "section 3.2",
            _COEFFICIENTS[name],
            f"{value:.3f}",
            lambda name=name: measured()["coefficients"][name],
            within=0.003,
        )
        for name, value in PUBLISHED_COEFFICIENTS.items()
    ),
    Published(
        "section 4.1.2",
        "integral of the residual at the coefficient 1.388",
        "-0.000853",
        lambda: residual_integral(1.388),
    ),
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)
