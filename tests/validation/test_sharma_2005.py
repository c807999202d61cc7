"""The CIE Delta E 2000 of published pairs of colours."""

from pathlib import Path

import numpy as np
import pytest
import reference_delta_e as reference
from published import Published, check, what

from sssfit.measure.delta_e import load_colour

TITLE = "Sharma, Wu and Dalal 2005"
SOURCE = (
    'G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 color-difference formula: implementation notes, '
    'supplementary test data, and mathematical observations", *Color Research and Application* '
    "30(1), 2005"
)
PAIRS = np.loadtxt(
    Path(__file__).parents[1] / "data" / "ciede2000.csv", delimiter=",", skiprows=1, ndmin=2
)


def delta_e(k):
    """Return the Delta E of pair k by the function that the measures use."""
    return load_colour().difference.delta_E_CIE2000(PAIRS[k, :3], PAIRS[k, 3:6])


FIGURES = [
    Published("table 1", f"pair {k + 1}", f"{pair[6]:.4f}", lambda k=k: delta_e(k))
    for k, pair in enumerate(PAIRS)
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


def test_the_literal_formula_of_the_tests_has_the_same_digits():
    assert len(PAIRS) == 34
    literal = [reference.delta_e_2000(each[:3], each[3:6]) for each in PAIRS]
    np.testing.assert_allclose(literal, PAIRS[:, 6], rtol=0, atol=0.5e-4)
    np.testing.assert_allclose([delta_e(k) for k in range(34)], literal, rtol=1e-12)
