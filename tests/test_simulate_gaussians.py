"""Sums of Gaussians as profiles: energies by quadrature, the published skin, bad input."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from sssfit import shapes
from sssfit.errors import SimulationError
from sssfit.fit import fit_falloff
from sssfit.formats.csv import parse_csv
from sssfit.profile import Profile
from sssfit.simulate import DEON_SKIN, simulate_deon_skin, simulate_gaussians

# Written out once more, from the paper's table: variance [mm^2], then R, G, B.
PUBLISHED = """
0.0064 0.233 0.455 0.649
0.0484 0.100 0.336 0.344
0.187  0.118 0.198 0.000
0.567  0.113 0.007 0.007
1.99   0.358 0.004 0.000
7.41   0.078 0.000 0.000
"""
TABLE = np.array([line.split() for line in PUBLISHED.split("\n") if line], dtype=float)
VARIANCES, WEIGHTS = TABLE[:, 0], TABLE[:, 1:]
ONE = {"name": "one", "channels": ["a"]}


@pytest.fixture(scope="module")
def skin():
    return simulate_deon_skin()


def energy_by_quadrature(inner, outer, channel):
    """2 pi r R_d from one radius to another, R_d written out."""

    def ring(r):
        r_d = sum(
            w * math.exp(-r * r / (2 * v)) / (2 * math.pi * v)
            for v, w in zip(VARIANCES, WEIGHTS[:, channel], strict=True)
        )
        return 2 * math.pi * r * r_d

    return quad(ring, inner, outer, epsabs=0, epsrel=1e-12)[0]


@pytest.mark.parametrize("channel", range(3))
@pytest.mark.parametrize("annulus", [0, 1, 10, 100, 700, 2150])
def test_energy_of_annuli_is_the_integral_of_the_density(skin, annulus, channel):
    inner, outer = skin.r_edges_mm[annulus : annulus + 2]
    expected = energy_by_quadrature(inner, outer, channel)
    # blue's last annulus holds 1e-115, and all its digits; the exponent itself rounds there
    assert skin.annulus_energy[annulus, channel] == pytest.approx(expected, rel=1e-11, abs=0)


def test_cumulative_reflectance_and_what_lies_beyond(skin):
    for c in range(3):
        within = energy_by_quadrature(0, 0.08, c) + energy_by_quadrature(0.08, 0.8, c)
        assert skin.cumulative[100, c] == pytest.approx(within, rel=1e-11)
        beyond = energy_by_quadrature(skin.r_edges_mm[-1], 60.0, c)
        assert skin.beyond_grid[c] == pytest.approx(beyond, rel=1e-9, abs=0)
    assert (skin.beyond_grid < 1e-9).all()


def test_every_channel_returns_all_light(skin):
    np.testing.assert_allclose(WEIGHTS.sum(axis=0), 1.0, atol=1e-12)
    np.testing.assert_allclose(skin.diffuse_reflectance, 1.0, rtol=1e-13)


def test_default_grid(skin):
    np.testing.assert_allclose(np.diff(skin.r_edges_mm), 0.008, rtol=1e-9)
    assert skin.n_annuli == 2151


@pytest.mark.parametrize(("pitch_mm", "most"), [(0.02, 3e-4), (0.034, 3e-5), (0.1, 3e-5)])
def test_middle_pixel_has_its_energy(skin, pitch_mm, most):
    sides = [math.erf(pitch_mm / math.sqrt(8 * v)) for v in VARIANCES]
    expected = np.square(sides) @ WEIGHTS
    found = skin.quadrant_kernel(pitch_mm, 0)[0, 0]
    np.testing.assert_allclose(found, expected, rtol=most)


def test_what_the_file_says_of_itself(skin, tmp_path):
    skin.save(tmp_path / "skin.profile.npz")
    profile = Profile.load(tmp_path / "skin.profile.npz")
    assert profile.material_name == DEON_SKIN.name == "deon-skin"
    assert profile.meta["method"] == "gaussians"
    assert profile.meta["material"]["source"] == "d'Eon, Luebke, Enderton 2007"
    assert profile.meta["settings"]["variances_mm2"] == VARIANCES.tolist()
    assert profile.meta["settings"]["weights"] == WEIGHTS.tolist()
    assert (profile.channels, profile.photons) == (("R", "G", "B"), None)
    assert profile.specular_reflectance == 0.0
    assert len(profile.absorbed) == 0
    assert np.isnan(profile.energy_balance).all()
    assert np.isnan(profile.annulus_energy_stderr).all()


def test_the_2012_model_stands_on_the_same_red_skin(skin):
    # all of the light scattered, as wide as p: the pass is red skin along lines, in pixels
    width = 1.0 / (127.7 * 1.001)
    result = fit_falloff(skin, mm_per_pixel=0.2, width=width, strength=1.0, falloff=1.0)
    expected = skin.line_kernel(0.2, result.kernel.pixels // 2)[:, 0]
    found = result.kernel.weights[0, :, 0]
    np.testing.assert_allclose(found / found.sum(), expected / expected.sum(), rtol=3e-3)


def test_negative_weights_may_cancel_but_not_outdo():
    crater = simulate_gaussians([1.0, 2.0], [[-0.2], [0.6]], dr_mm=0.1, **ONE)
    assert crater.diffuse_reflectance[0] == pytest.approx(0.4, rel=1e-12)
    with pytest.raises(SimulationError, match="one: annulus 0 of channel a has the energy -0"):
        simulate_gaussians([1.0, 2.0], [[-0.5], [0.6]], dr_mm=0.1, **ONE)
    with pytest.raises(SimulationError, match="the negative weights outdo the others"):
        simulate_gaussians([1.0, 2.0], [[0.6], [-0.1]], dr_mm=0.1, **ONE)


def test_grids_that_are_given():
    profile = simulate_gaussians([0.25], [[0.5, 0.0]], name="n", channels=("a", "b"), radius_mm=1.0)
    assert (profile.n_annuli, profile.r_edges_mm[-1]) == (20, pytest.approx(1.0))
    np.testing.assert_allclose(profile.beyond_grid, [0.5 * math.exp(-2.0), 0.0], rtol=1e-14)
    dark = simulate_gaussians([0.25], [[0.0]], **ONE)
    assert dark.diffuse_reflectance[0] == 0.0


@pytest.mark.parametrize(
    ("given", "fragment"),
    [
        ({"variances_mm2": [-1.0]}, "variances_mm2[0] = -1.0; expected a number from 1e-18"),
        ({"variances_mm2": [0.0]}, "variances_mm2[0] = 0.0"),
        ({"variances_mm2": [math.nan]}, "variances_mm2[0] = nan"),
        ({"variances_mm2": [math.inf]}, "variances_mm2[0] = inf"),
        ({"variances_mm2": []}, "variances_mm2 has the shape (0,)"),
        ({"variances_mm2": 1.0}, "variances_mm2 has the shape ()"),
        ({"variances_mm2": ["wide"]}, "are not numbers"),
        ({"weights": [[math.nan]]}, "weights[0][0] = nan; expected a finite"),
        ({"weights": [[math.inf]]}, "weights[0][0] = inf"),
        ({"weights": [0.5]}, "weights has the shape (1,); expected (1, 1): a row for each"),
        ({"weights": [[0.5, 0.5]]}, "weights has the shape (1, 2)"),
        ({"weights": [[0.5], [0.1, 0.2]]}, "weights = [[0.5], [0.1, 0.2]] are not numbers"),
        ({"weights": [[1.1]]}, "weights add up to 1.1 in a channel; expected 1 at most"),
        ({"dr_mm": 0.0}, "dr_mm = 0.0; expected a length"),
        ({"dr_mm": "fine"}, "dr_mm = 'fine' is not a number"),
        ({"radius_mm": 0.0}, "radius_mm = 0.0; expected a length"),
        ({"radius_mm": math.nan}, "radius_mm = nan"),
        ({"dr_mm": 1e-6}, "over the limit of 100000"),
        ({"name": "../up"}, "name = '../up' cannot be part of a file name"),
        ({"source": 3}, "source = 3 is not a text"),
        ({"channels": "a"}, "channels = 'a'; expected a list"),
        ({"channels": []}, "channels = [] has 0 names"),
    ],
)
def test_bad_input_is_one_clear_line(given, fragment):
    call = {"variances_mm2": [1.0], "weights": [[0.5]], **ONE} | given
    with pytest.raises(SimulationError) as caught:
        simulate_gaussians(**call)
    assert fragment in str(caught.value)
    assert "\n" not in str(caught.value)


def test_energy_between_radii_keeps_its_digits():
    # 1e-8 of a deviation from the beam, and 30 of them away
    assert shapes.gaussian_between(0.0, 1e-8, 1.0) == pytest.approx(0.5e-16, rel=1e-14)
    assert shapes.gaussian_between(30.0, 40.0, 1.0) == pytest.approx(math.exp(-450), rel=1e-13)
    assert shapes.gaussian_beyond(30.0, 1.0) == pytest.approx(math.exp(-450), rel=1e-13)


def test_a_table_without_a_material_can_be_fitted_under_the_name_of_its_file(skin):
    rows = "".join(f"{r},{e}\n" for r, e in zip((1, 2, 3, 4), (0.2, 0.2, 0.1, 0.05), strict=True))
    table = parse_csv(f"r_mm,grey\n{rows}", "wax.csv", quantity="energy")
    assert table.material_name is None
    kernel = fit_falloff(table, mm_per_pixel=0.5).kernel
    assert kernel.meta["material"] == "wax.csv"
    foreign = Profile(
        **{name: getattr(table, name) for name in table.__dataclass_fields__ if name != "meta"},
        meta={**table.meta, "material": {"name": "../../up"}},
    )
    assert foreign.material_name is None
