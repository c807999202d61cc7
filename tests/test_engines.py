"""The samplers of engines, against their published kernels and against single pixels by hand."""

import math

import numpy as np
import pytest
from reference_taps import texel, turn_of

import sssfit
from sssfit.compare.engines import engines
from sssfit.errors import FitError, RenderError
from sssfit.fit import fit_burley, fit_falloff
from sssfit.fit.falloff import STRETCH
from sssfit.kernel.listing import listing
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole

PITCH = 0.3
BY_LABEL = {each.label: each for each in engines()}
PLACES = [(0, 0), (12, 9), (23, 5), (7, 24), (16, 16)]


@pytest.fixture(scope="module")
def skin1():
    return simulate_dipole(sssfit.load_material("skin1"))


@pytest.fixture(scope="module")
def shapes(skin1):
    found = fit_burley(skin1).kernel.parameters
    return np.array([each["s_per_mm"] for each in found.values()])


@pytest.fixture(scope="module")
def scene():
    return Scene("noise", np.random.default_rng(1).uniform(size=(26, 25, 3)), PITCH)


def test_budgets_are_those_of_the_engines():
    assert {each.label: (each.fetches, each.passes) for each in engines()} == {
        **{f"HDRP {n}": (n, 1) for n in (20, 40, 80)},
        "Babylon.js 40": (40, 1),
        "EEVEE 16": (16, 1),
        **{f"O3DE {n}": (n + 4, 2) for n in (80, 200)},
        **{f"iryoku {n}": (2 * n, 2) for n in (11, 17, 25)},
        "community-shaders 21": (42, 2),
    }
    for each in engines():
        assert "/" in each.source.split(",")[0]
        assert each.method


@pytest.mark.parametrize("label", BY_LABEL)
def test_constant_light_stays_constant_with_the_reflectance(skin1, label):
    grey = Scene("grey", np.full((21, 34, 1), 2.0), PITCH)
    out = BY_LABEL[label].render(grey, skin1)
    expected = np.broadcast_to(2.0 * skin1.diffuse_reflectance, (21, 34, 3))
    np.testing.assert_allclose(out, expected, rtol=1e-12)


# Middle, then rows by offset, of SeparableSSS.h in its first release, to six digits.
PUBLISHED = {
    11: {
        0.0: (0.560479, 0.669086, 0.784728),
        0.08: (0.0771802, 0.113491, 0.0793803),
        0.32: (0.0821904, 0.0358608, 0.0209261),
        0.72: (0.03639, 0.0130999, 0.00643685),
        1.28: (0.0192831, 0.00282018, 0.00084214),
        2.0: (0.00471691, 0.000184771, 5.07566e-5),
    },
    17: {
        0.0: (0.536343, 0.624624, 0.748867),
        0.03125: (0.0324462, 0.0656718, 0.0532821),
        0.28125: (0.0571056, 0.0287432, 0.0172844),
        2.0: (0.00317394, 0.000134823, 3.77269e-5),
    },
    25: {
        0.0: (0.530605, 0.613514, 0.739601),
        0.0208333: (0.0211412, 0.0459286, 0.0378196),
        0.75: (0.017924, 0.00711691, 0.00347194),
        3.0: (0.000973794, 1.11862e-5, 9.43437e-7),
    },
}


@pytest.mark.parametrize("taps", PUBLISHED)
def test_the_listing_makes_the_published_kernels(taps):
    offsets, weights = listing(taps, np.array([0.48, 0.41, 0.28]), np.array([1.0, 0.37, 0.3]))
    at = np.concatenate(([0.0], offsets))
    assert at.size == taps // 2 + 1
    np.testing.assert_allclose(weights[0] + 2.0 * weights[1:].sum(axis=0), 1.0, rtol=1e-12)
    for offset, row in PUBLISHED[taps].items():
        k = int(np.argmin(np.abs(at - offset)))
        assert at[k] == pytest.approx(offset, abs=1e-6)
        np.testing.assert_allclose(weights[k], row, rtol=2e-5)


@pytest.mark.parametrize("taps", [1, 2, 10])
def test_a_listing_of_few_or_even_taps_is_one_line(taps):
    with pytest.raises(FitError, match="expected an odd number from 3"):
        listing(taps, np.ones(3), np.ones(3))


def radius_of(u, s):
    """The inverse of the cumulative energy, in the closed form that the shaders have."""
    u = 1.0 - u
    g = 1.0 + 4.0 * u * (2.0 * u + math.sqrt(1.0 + 4.0 * u * u))
    return 3.0 * math.log((1.0 + g ** (-1 / 3) + g ** (1 / 3)) / (4.0 * u)) / s


def burley(r, s):
    return s * (math.exp(-s * r) + math.exp(-s * r / 3.0))


def mean_of(scene, row, column, fetches, channel):
    """The weighted mean of whole texels; fetches are (radius, angle, weight)."""
    picture, light, total = scene.irradiance[..., channel], 0.0, 0.0
    for radius, angle, weight in fetches:
        down = round(radius / PITCH * math.sin(angle))
        right = round(radius / PITCH * math.cos(angle))
        light += weight * texel(picture, row + down, column + right, "mirror")
        total += weight
    return light / total


@pytest.mark.parametrize(("label", "n"), [("HDRP 20", 20), ("HDRP 80", 80), ("Babylon.js 40", 40)])
def test_a_golden_spiral_by_hand(scene, skin1, shapes, label, n):
    ours = BY_LABEL[label].render(scene, skin1)
    least = min(shapes)
    for row, column in PLACES:
        turn = 0.0 if label.startswith("Babylon") else turn_of(column, row, 0)
        for c, s in enumerate(shapes):
            fetches = []
            for i in range(n):
                r = radius_of((i + 0.5) / n, least)
                angle = turn + 2.0 * math.pi * i / 1.618033988749895
                fetches.append((r, angle, burley(r, s) / burley(r, least)))
            seen = skin1.diffuse_reflectance[c] * mean_of(scene, row, column, fetches, c)
            assert ours[row, column, c] == pytest.approx(seen, rel=1e-9)


def test_eevee_by_hand(scene, skin1, shapes):
    ours = BY_LABEL["EEVEE 16"].render(scene, skin1)
    golden = math.pi * (3.0 - math.sqrt(5.0))
    albedo = skin1.diffuse_reflectance / max(skin1.diffuse_reflectance)
    lengths = [(1.9 - a + 3.5 * (a - 0.8) ** 2) / s for a, s in zip(albedo, shapes, strict=True)]
    drawn = 1.04 / max(lengths)  # s of the samples: 1.9 - 1 + 3.5 * .2^2 at albedo 1
    for row, column in PLACES:
        noise = math.fmod(0.06711056 * column + 0.00583715 * row, 1.0)
        turn = math.fmod(52.9829189 * noise, 1.0) * golden
        for c, s in enumerate(shapes):
            fetches = []
            for i in range(16):
                r = radius_of(0.9963790093708328 * (1.0 + 0.5 / 16) * i / 16, drawn) if i else 0.0
                weight = burley(r, s) / burley(r, drawn) if r * s < 16.0 else 0.0
                fetches.append((r, golden * i + math.pi + turn, weight))
            seen = skin1.diffuse_reflectance[c] * mean_of(scene, row, column, fetches, c)
            assert ours[row, column, c] == pytest.approx(seen, rel=1e-9)


@pytest.mark.parametrize("n", [80, 200])
def test_o3de_by_hand(scene, skin1, shapes, n):
    ours = BY_LABEL[f"O3DE {n}"].render(scene, skin1)
    least = min(shapes)
    quarters = {(0, 0): 0, (0, 1): 2, (1, 0): 1, (1, 1): 3}
    for row, column in PLACES:
        for c, s in enumerate(shapes):
            block = []
            for y, x in (
                (row, column),
                (row - 1, column),
                (row, column - 1),
                (row - 1, column - 1),
            ):
                y, x = max(y, 0), max(x, 0)
                turn = 0.5 * math.pi * quarters[y % 2, x % 2]
                fetches = []
                for i in range(1, n):
                    u = sum(((i >> bit) & 1) / 2 ** (bit + 1) for bit in range(32))
                    r = radius_of(u, least)
                    angle = 2.0 * math.pi * i * 2.0 / (1.0 + math.sqrt(5.0)) + turn
                    fetches.append((r, angle, burley(r, s) / burley(r, least)))
                block.append(mean_of(scene, y, x, fetches, c))
            seen = skin1.diffuse_reflectance[c] * sum(block) / 4.0
            assert ours[row, column, c] == pytest.approx(seen, rel=1e-9)


def test_community_shaders_by_hand(scene, skin1):
    ours = BY_LABEL["community-shaders 21"].render(scene, skin1)
    found = list(fit_falloff(skin1, mm_per_pixel=PITCH).kernel.parameters.values())
    strength = np.array([(1.0 - 0.233) * each["strength"] for each in found])
    offsets, weights = listing(21, strength, np.array([each["falloff"] for each in found]))
    width_mm = STRETCH * found[0]["width"]
    steps = [(0, weights[0])]
    for offset, row in zip(offsets * width_mm / PITCH, weights[1:], strict=True):
        steps += [(math.trunc(sign * offset + 0.5), row) for sign in (1, -1)]
    for row, column in PLACES:
        for c in range(3):
            picture, seen = scene.irradiance[..., c], 0.0
            for down, v in steps:
                for right, w in steps:
                    seen += v[c] * w[c] * texel(picture, row + down, column + right, "mirror")
            assert ours[row, column, c] == pytest.approx(
                skin1.diffuse_reflectance[c] * seen, rel=1e-9
            )


def test_few_pixels_take_fewer_fetches(skin1, shapes):
    """HDRP takes a fetch for four pixels of the disk at most, and none of pixels that hold it."""
    radius = radius_of(0.997, min(shapes))
    noise = np.random.default_rng(2).uniform(size=(16, 16, 3))
    wide = Scene("noise", noise, radius * math.sqrt(math.pi / 4.0) * 1.01)  # less than one fetch
    for label in ("HDRP 20", "Babylon.js 40"):
        np.testing.assert_array_equal(
            BY_LABEL[label].render(wide, skin1), noise * skin1.diffuse_reflectance
        )
    # Eleven fetches: 20 and 80 are the same.
    some = Scene("noise", noise, radius * math.sqrt(math.pi / (4.0 * 11.5)))
    np.testing.assert_array_equal(
        BY_LABEL["HDRP 20"].render(some, skin1), BY_LABEL["HDRP 80"].render(some, skin1)
    )


def test_a_channel_without_light_stays_dark(skin1):
    energy = skin1.annulus_energy.copy()
    energy[:, 1] = 0.0
    beyond = np.where([True, False, True], skin1.beyond_grid, 0.0)
    dark = type(skin1)(
        **{
            name: getattr(skin1, name)
            for name in (
                *("r_edges_mm", "annulus_energy_stderr", "beyond_grid_stderr", "absorbed"),
                *("specular_reflectance", "unfinished", "annulus_transmittance", "meta"),
            )
        },
        annulus_energy=energy,
        beyond_grid=beyond,
    )
    noise = Scene("noise", np.random.default_rng(3).uniform(size=(12, 12, 1)), PITCH)
    for each in engines():
        out = each.render(noise, dark)
        assert (out[..., 1] == 0.0).all(), each.label
        assert (out[..., [0, 2]] > 0.0).all(), each.label


def test_other_channels_are_one_line(skin1):
    two = Scene("two", np.ones((4, 4, 2)), PITCH)
    for each in engines():
        with pytest.raises(RenderError, match="the picture has 2 channels and the kernel 3"):
            each.render(two, skin1)
