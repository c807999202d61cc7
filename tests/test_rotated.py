"""Chains of passes in three and four directions beside the single pair."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from sssfit import fit
from sssfit.errors import FitError
from sssfit.fit import fit_taps, make_target
from sssfit.fit._chain_stars import StarChain
from sssfit.fit._spectrum import spectral_target
from sssfit.fit.cascade import table_of
from sssfit.fit.rotated import _checked, last_shown
from sssfit.kernel.structure import parse
from sssfit.material import load_material
from sssfit.render.taps import response
from sssfit.simulate import simulate_exact


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def red(skin1):
    """The red channel alone: its sums have a third of the numbers."""
    by_channel = {
        each.name: value[..., :1]
        for each in fields(skin1)
        if isinstance(value := getattr(skin1, each.name), np.ndarray) and value.shape[-1] == 3
    }
    left_out = {"material": None, "energy_balance_stderr": None}
    by_channel["meta"] = {**skin1.meta, "channels": ["R"], **left_out}
    return replace(skin1, **by_channel)


def chain_of(profile, directions, taps, support_mm=9.0):
    target = make_target(profile, 0.3, support_mm)
    lit = list(range(profile.n_channels))
    return StarChain(spectral_target(target, lit, "natural"), _checked(directions, taps))


SHARED = {3: (0, 1, 1), 4: (0, 1, 0, 1)}


@pytest.mark.parametrize("directions", [3, 4])
def test_the_spectrum_is_that_of_the_rendered_kernel(skin1, directions):
    """Of one lit pixel, by a slow transform: fetches between texels in two dimensions."""
    chain = chain_of(skin1, directions, 5, support_mm=2.0)
    tied = last_shown(chain, SHARED[directions])
    x = tied.full(tied.start(np.random.default_rng(2)))
    taps = table_of("rotated", make_target(skin1, 0.3, 2.0), chain, x, {})
    seen = response(taps, 0.3)
    place = np.arange(len(seen)) - len(seen) // 2
    waves = np.exp(1j * np.outer(chain.target.frequencies, place))
    found = np.einsum("wy,yxc,vx->cvw", waves, seen, waves, optimize=True)  # (C, wx, wy)
    np.testing.assert_allclose(chain.spectrum(x), found.real, rtol=0, atol=1e-12)
    assert np.abs(found.imag).max() < 1e-12  # mirror images make it even along both axes


def test_derivatives_are_those_of_differences(skin1):
    chain = chain_of(skin1, 3, 5)
    tied = last_shown(chain, SHARED[3])
    p = tied.start(np.random.default_rng(3))
    _, gradient = tied.value_and_gradient(p)
    for k in range(p.size):
        step = np.zeros(p.size)
        step[k] = 1e-5
        after, before = (tied.value_and_gradient(p + s * step)[0] for s in (1, -1))
        assert gradient[k] == pytest.approx((after - before) / 2e-5, abs=1e-8, rel=1e-5)


@pytest.mark.parametrize("directions", [3, 4])
def test_lines_that_are_mirror_images_are_alike(skin1, directions):
    taps = fit(skin1, "rotated", directions=directions, taps=3)
    angles = [each.angle_degrees for each in taps.stages]
    assert angles == [0.0, 180.0 / directions, *np.arange(2, directions) * 180.0 / directions]
    for ours, kind in zip(taps.stages, SHARED[directions], strict=True):
        other = taps.stages[kind]
        np.testing.assert_array_equal(ours.offsets_mm, other.offsets_mm)
        np.testing.assert_array_equal(ours.weights, other.weights)
    assert (taps.blend[1:-1] == 0.0).all()
    assert (taps.fetches, taps.passes) == (3 * directions + 1, directions)
    np.testing.assert_allclose(taps.energy, skin1.diffuse_reflectance, rtol=1e-9)
    kernel = response(taps)
    np.testing.assert_allclose(kernel, kernel[::-1], atol=1e-15)
    if directions == 4:
        np.testing.assert_allclose(kernel, kernel.transpose(1, 0, 2), atol=1e-15)


def test_more_directions_are_nearer_at_about_36_fetches(red):
    """The misfit of skin1's red: .0022 by two passes, .0007 by three and .0004 by four."""
    found = {
        directions: fit(red, "rotated", directions=directions, taps=taps)
        for directions, taps in ((2, 17), (3, 11), (4, 9))
    }
    misfits = {key: float(each.errors["spectral"][0] ** 2) for key, each in found.items()}
    assert [each.fetches for each in found.values()] == [35, 34, 37]
    assert misfits[2] < 3.5e-3
    assert misfits[3] < 0.5 * misfits[2]
    assert misfits[4] < 0.8 * misfits[3]


def test_a_turned_stage_of_a_cascade_is_fitted(red):
    """Along the diagonals its taps reach between the texels; one 1-2 is no better than 1-2x."""
    taps = fit(red, "cascade", stages="1-2x")
    assert taps.structure == "1-2x"
    assert taps.fetches == fit(red, "cascade", stages="1-2").fetches
    kernel = response(taps)
    np.testing.assert_allclose(kernel, kernel.transpose(1, 0, 2), atol=1e-15)
    assert [each.angle_degrees for each in parse("1-2x")] == [0.0, 45.0]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"directions": 5}, "directions = 5; expected 2, 3 or 4."),
        ({"directions": "3"}, "directions = '3'; expected 2, 3 or 4."),
        ({"taps": 8}, "taps = 8; expected an odd number from 3 to 129"),
        ({"taps": 131}, "taps = 131; expected an odd number from 3 to 129"),
        ({"taps": math.nan}, "taps = nan; expected an odd number"),
    ],
)
def test_bad_settings_are_one_line(skin1, settings, said):
    with pytest.raises(FitError) as caught:
        fit_taps(skin1, "rotated", **settings)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
