"""Wax on paint: Mie's theory against published and limiting values, and light under the wax."""

import dataclasses
import math

import make_wax_on_paint as wax
import numpy as np
import pytest

from sssfit.material import load_material
from sssfit.simulate import simulate_montecarlo

GRID = {"photons": 40_000, "dr_mm": 0.005, "radius_mm": 1.0}


def test_a_sphere_scatters_as_bohren_and_huffman_print():
    # Appendix A: radius .525 um and index 1.55, wavelength .6328 um
    efficiency, _ = wax.mie(2.0 * math.pi * 0.525 / 0.6328, 1.55)
    assert efficiency == pytest.approx(3.10543, abs=5e-6)


def test_small_spheres_scatter_as_rayleigh_found():
    size, index = 0.01, 1.8
    efficiency, g = wax.mie(size, index)
    polarised = (index**2 - 1.0) / (index**2 + 2.0)
    assert efficiency == pytest.approx(8.0 / 3.0 * size**4 * polarised**2, rel=1e-3)
    assert abs(g) < 1e-3


def test_large_spheres_take_twice_their_section():
    # of light that they do not absorb: half of it by diffraction (van de Hulst 1957, section 8.22)
    efficiencies = [wax.mie(size, 1.5)[0] for size in np.linspace(80.0, 120.0, 41)]
    assert np.mean(efficiencies) == pytest.approx(2.0, rel=0.06)


def test_rutile_has_the_index_of_devore_at_the_sodium_line():
    # 589.3 nm: n_o 2.613 and n_e 2.909 in handbooks
    assert wax.rutile(589.3) == pytest.approx((2 * 2.613 + 2.909) / 3.0, abs=1e-3)


def test_the_file_holds_what_the_script_makes():
    text = wax.FILE.read_text("utf-8")
    assert text == wax.COMMENT + wax.material().to_toml()
    found = load_material(wax.FILE)
    assert found.layers == wax.material().layers
    assert found.source == wax.SOURCE


def test_wax_lets_paint_glow_around_the_beam():
    """What the paint returns beyond the critical angle comes down again some film's widths away."""
    both = wax.material()
    alone = dataclasses.replace(both, layers=both.layers[1:])
    covered, bare = (simulate_montecarlo(each, **GRID) for each in (both, alone))
    for profile in (covered, bare):
        out = profile.diffuse_reflectance + profile.transmittance + profile.specular_reflectance
        np.testing.assert_allclose(out, 1.0, atol=1e-6)  # nothing absorbs
    annulus = int(2.0 * wax.WAX_MM / GRID["dr_mm"])
    near = [each.cumulative[annulus] / each.diffuse_reflectance for each in (covered, bare)]
    assert np.all(near[0] < near[1] - 0.2)
