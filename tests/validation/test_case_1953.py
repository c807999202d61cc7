"""The decay of light deep inside a half space, on which the exact solver's last panel rests."""

import pytest
from published import Published, check, what

from sssfit.simulate._depth import decay_rate

TITLE = "Case, de Hoffmann and Placzek 1953"
SOURCE = (
    "K. M. Case, F. de Hoffmann, G. Placzek, *Introduction to the Theory of Neutron Diffusion*, "
    "Los Alamos, 1953"
)
RATES = {0.5: "0.957504", 0.9: "0.525430", 0.99: "0.172511", 1.0: "0.000000"}

FIGURES = [
    Published(
        "table 2",
        f"decay rate at albedo {albedo:g}, per mean free path",
        printed,
        lambda a=albedo: decay_rate(a),
        within=1e-6,
    )
    for albedo, printed in RATES.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)
