"""The materials with layers: files are what the published formulas give, and all can be solved."""

import make_layered_materials
import numpy as np
import pytest

from sssfit.material import load_material, material_names
from sssfit.simulate import simulate_exact

LEAVES = make_layered_materials.LEAVES


def test_files_hold_what_the_formulas_give():
    for make in (make_layered_materials.skins, make_layered_materials.films):
        for name, source, comment, layers in make():
            text = (make_layered_materials.FOLDER / f"{name}.toml").read_text("utf-8")
            assert text.startswith(comment)
            found = load_material(name)
            assert found.source == source
            assert list(found.layers) == layers


def test_blood_absorbs_as_the_table_says():
    # 2.303 e 150 / 64 500, for oxygenated blood at 550 nm: 43 016 -> 230.4 / cm
    molar = make_layered_materials.OXYHAEMOGLOBIN[1]
    assert 2.303 * molar * 150 / 64_500 == pytest.approx(230.4, abs=0.05)
    mixed = make_layered_materials.blood_per_mm()[1]
    share = 0.75 + 0.25 * 53412.0 / 43016.0
    assert mixed == pytest.approx(23.04 * share, rel=1e-3)


def test_prospect_loses_nothing_without_absorbers():
    nothing = dict.fromkeys(("cab", "car", "ant", "brown", "water"), 0.0)
    r, t = make_layered_materials.leaf_light(n=1.5, **nothing, dry=1e-9)
    np.testing.assert_allclose(r + t, 1.0, atol=1e-6)


def test_an_interface_lets_diffuse_light_in_as_walsh_found():
    # Walsh 1926: 9.18 % of diffuse light is reflected by an index of 1.5.
    assert 1.0 - make_layered_materials.interface(90.0, 1.5) == pytest.approx(0.0918, abs=5e-5)


def leaf_is_prospects(name, **settings):
    """Solve for a leaf, and compare its totals with PROSPECT's."""
    material = load_material(name)
    profile = simulate_exact(material, dr_mm=0.05, radius_mm=5.0, **settings)
    found = profile.diffuse_reflectance + material.specular_reflectance, profile.transmittance
    np.testing.assert_allclose(found, make_layered_materials.leaf_light(**LEAVES[name]), atol=2e-5)


def test_a_leaf_has_the_light_of_prospect():
    leaf_is_prospects("leaf-young", tolerance=3e-4)  # the same directions, and so the same totals


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in LEAVES if name != "leaf-young"])
def test_every_leaf_has_the_light_of_prospect(name):
    leaf_is_prospects(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", material_names(layered=True))
def test_every_stack_is_solved(name):
    profile = simulate_exact(load_material(name))
    share = profile.annulus_energy_stderr.max() / profile.diffuse_reflectance.min()
    assert share < 1e-3
    assert np.all(profile.annulus_energy >= 0.0)
