"""The coefficients of the paper's eleven materials."""

import pytest
from published import Published, check, what

from sssfit.material import load_material, material_names

TITLE = "Jensen et al. 2001"
SOURCE = (
    'H. W. Jensen, S. R. Marschner, M. Levoy, P. Hanrahan, "A practical model for subsurface light '
    'transport", SIGGRAPH 2001; as printed in "Separable Subsurface Scattering", supplement G'
)
# sigma_a and sigma_s of R, G, B [1/mm], eta
COEFFICIENTS = {
    "apple": ("0.0030 0.0034 0.0460", "2.2900 2.3900 1.9700", "1.3"),
    "chicken1": ("0.0150 0.0770 0.1900", "0.1500 0.2100 0.3800", "1.3"),
    "chicken2": ("0.0180 0.0880 0.2000", "0.1900 0.2500 0.3200", "1.3"),
    "cream": ("0.0002 0.0028 0.0163", "7.3800 5.4700 3.1500", "1.3"),
    "ketchup": ("0.0610 0.9700 1.4500", "0.1800 0.0700 0.0300", "1.3"),
    "marble": ("0.0021 0.0041 0.0071", "2.1900 2.6200 3.0000", "1.5"),
    "potato": ("0.0024 0.0090 0.1200", "0.6800 0.7000 0.5500", "1.3"),
    "skimmilk": ("0.0014 0.0025 0.0142", "0.7000 1.2200 1.9000", "1.3"),
    "skin1": ("0.0320 0.1700 0.4800", "0.7400 0.8800 1.0100", "1.3"),
    "skin2": ("0.0130 0.0700 0.1450", "1.0900 1.5900 1.7900", "1.3"),
    "wholemilk": ("0.0011 0.0024 0.0140", "2.5500 3.2100 3.7700", "1.3"),
}


def coefficients(name):
    """Return sigma_a, sigma_s and eta of a shipped material, in this order."""
    layer = load_material(name).layers[0]
    return [*layer.sigma_a_per_mm, *layer.sigma_s_per_mm, layer.eta]


FIGURES = [
    Published(
        "figure 5",
        f"{name}: sigma_a, sigma_s (R G B, 1/mm), eta",
        " ".join(printed),
        lambda n=name: coefficients(n),
        within=1e-15,
    )
    for name, printed in COEFFICIENTS.items()
]


@pytest.mark.parametrize("figure", FIGURES, ids=what)
def test_figure(figure):
    check(figure)


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_the_record_is_a_half_space_of_isotropic_scattering(name):
    material = load_material(name)
    assert material.name == name
    assert material.source == "Jensen et al. 2001"
    assert material.channels == ("R", "G", "B")
    assert material.is_semi_infinite
    assert material.layers[0].g.tolist() == [0.0, 0.0, 0.0]
    expected = [float(each) for text in COEFFICIENTS[name] for each in text.split()]
    assert coefficients(name) == expected


def test_the_papers_materials_are_these():
    assert material_names(paper=True) == tuple(COEFFICIENTS)
