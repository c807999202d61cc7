"""Predicted steps of walks beside the steps that walks take."""

import numpy as np
import pytest

from sssfit.grid import RadialGrid
from sssfit.material import Layer, Material
from sssfit.simulate._steps import steps_per_photon
from sssfit.simulate.montecarlo import make_walk

PHOTONS = 2000
COARSE = RadialGrid(1.0, 100)


def taken(material):
    """The steps of a photon, counted by the walk itself."""
    return make_walk([material], [COARSE], 1, PHOTONS).trace(0).flights / PHOTONS


def slab(albedo, g, eta, thickness_mm):
    layer = Layer(eta, [g], [1.0 - albedo], [albedo], thickness_mm)
    return Material("slab", ("mono",), (layer,))


def skin(thickness_mm, above, below):
    top = Layer(1.4, [0.8], [above], [10.0], thickness_mm)
    return Material("skin", ("mono",), (top, Layer(1.4, [0.8], [below], [12.0])))


@pytest.mark.parametrize("thickness_mm", [0.5, 3.0, 30.0, np.inf])
@pytest.mark.parametrize("g", [0.0, 0.8])
def test_steps_heed_albedo_thickness_and_index(g, thickness_mm):
    """Within a factor of two from 1 step to 600; what a task of two seconds may be off by."""
    for albedo in (0.1, 0.9, 0.999):
        for eta in (1.0, 1.4):
            material = slab(albedo, g, eta, thickness_mm)
            ratio = steps_per_photon(material) / taken(material)
            assert 0.5 < ratio < 2.0, (albedo, eta, ratio)


@pytest.mark.parametrize("thickness_mm", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("above", [0.01, 1.0])
def test_steps_heed_the_layers(thickness_mm, above):
    for below in (0.01, 0.3):
        material = skin(thickness_mm, above, below)
        assert 0.5 < steps_per_photon(material) / taken(material) < 2.0


def test_steps_of_channels_that_scatter_apart_add_up():
    one = slab(0.9, 0.5, 1.4, 2.0)
    layer = one.layers[0]
    both = Material(
        "two",
        ("a", "b"),
        (Layer(1.4, [0.5, 0.6], [0.1, 0.1], [0.9, 0.9], layer.thickness_mm),),
    )
    assert 1.9 < steps_per_photon(both) / steps_per_photon(one) < 2.6
