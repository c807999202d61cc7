"""The coefficients of eleven diluted media, shipped undiluted."""

import numpy as np
import pytest
from published import Published, check, what

from sssfit.material import load_material

TITLE = "Narasimhan et al. 2006"
SOURCE = (
    "S. G. Narasimhan, M. Gupta, C. Donner, R. Ramamoorthi, S. K. Nayar, H. W. Jensen, "
    '"Acquiring scattering properties of participating media by dilution", *ACM Transactions on '
    "Graphics* 25, 2006; diluted and undiluted as in the tables of two renderers"
)
# Diluted [1e-2/mm]: ml in 23 l of water, sigma_a, sigma_s, g.
DILUTED = {
    "chocolatemilk": (16, (7, 30, 100), (7352, 9142, 10588), (0.862, 0.838, 0.806)),
    "espresso": (8, (1669, 2287, 3078), (2707, 2828, 2970), (0.907, 0.896, 0.880)),
    "grapefruit": (160, (96, 131, 395), (3513, 3669, 5237), (0.548, 0.545, 0.565)),
    "lowfatchocmilk": (10, (5, 16, 68), (4277, 4998, 5723), (0.934, 0.927, 0.916)),
    "lowfatmilk": (16, (2, 4, 8), (9124, 10744, 12492), (0.932, 0.902, 0.859)),
    "lowfatsoymilk": (16, (1, 5, 25), (1418, 1620, 2715), (0.850, 0.853, 0.842)),
    "mintmocha": (6, (984, 1519, 2040), (916, 1081, 1460), (0.910, 0.907, 0.914)),
    "reducedmilk": (18, (2, 4, 10), (10748, 12209, 13931), (0.819, 0.797, 0.746)),
    "regularmilk": (15, (1, 3, 13), (11873, 13293, 14589), (0.750, 0.714, 0.681)),
    "rubygrapefruit": (240, (896, 1911, 2636), (1617, 1606, 1669), (0.929, 0.929, 0.931)),
    "soymilk": (12, (1, 5, 34), (2433, 2714, 4563), (0.873, 0.858, 0.832)),
}
# pbrt-v4's table of the same: sigma_a and (1 - g) sigma_s of the undiluted medium [1/mm].
UNDILUTED = {
    "chocolatemilk": ([0.010063, 0.043125, 0.14375], [1.4585, 2.1289, 2.9527]),
    "espresso": ([4.7984, 6.5751, 8.8493], [0.72378, 0.84557, 1.0247]),
    "grapefruit": ([0.0138, 0.018831, 0.056781], [0.22826, 0.23998, 0.32748]),
    "lowfatchocmilk": ([0.0115, 0.0368, 0.1564], [0.64925, 0.83916, 1.1057]),
    "lowfatmilk": ([0.002875, 0.00575, 0.0115], [0.89187, 1.5136, 2.532]),
    "lowfatsoymilk": ([0.0014375, 0.0071875, 0.035937], [0.30576, 0.34233, 0.61664]),
    "mintmocha": ([3.772, 5.8228, 7.82], [0.31602, 0.38538, 0.48131]),
    "reducedmilk": ([0.0025556, 0.0051111, 0.012778], [2.4858, 3.1669, 4.5214]),
    "regularmilk": ([0.0015333, 0.0046, 0.019933], [4.5513, 5.8294, 7.136]),
    "rubygrapefruit": ([0.085867, 0.18314, 0.25262], [0.011002, 0.010927, 0.011036]),
    "soymilk": ([0.0019167, 0.0095833, 0.065167], [0.59223, 0.73866, 1.4693]),
}


def undiluted(name):
    """Return sigma_a and the reduced sigma_s of a shipped material [1/mm]."""
    layer = load_material(name).layers[0]
    return [*layer.sigma_a_per_mm, *layer.reduced_sigma_s_per_mm]


def digits(values):
    """Return numbers as text with five digits, as the table has them."""
    return " ".join(np.format_float_positional(each) for each in values)


FIGURES = [
    Published(
        "pbrt-v4, media table",
        f"{name}: sigma_a, reduced sigma_s (R G B, 1/mm)",
        digits([*sigma_a, *sigma_s]),
        lambda n=name: undiluted(n),
    )
    for name, (sigma_a, sigma_s) in UNDILUTED.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize("name", DILUTED)
def test_the_diluted_media_ship_undiluted(name):
    ml, *diluted, g = DILUTED[name]
    material = load_material(name)
    layer = material.layers[0]
    assert material.name == name
    assert material.source.startswith("Narasimhan et al. 2006")
    assert (layer.eta, layer.g.tolist()) == (1.33, list(g))
    sigma_a, sigma_s = (1e-6 * 23000 / ml * np.array(each) for each in diluted)
    np.testing.assert_allclose(layer.sigma_a_per_mm, sigma_a, rtol=5e-6)
    np.testing.assert_allclose(layer.sigma_s_per_mm, sigma_s, rtol=5e-6)
    # two programs' tables of the one measurement: five digits
    np.testing.assert_allclose(layer.sigma_a_per_mm, UNDILUTED[name][0], rtol=5e-5)
    np.testing.assert_allclose(layer.reduced_sigma_s_per_mm, UNDILUTED[name][1], rtol=1e-4)
