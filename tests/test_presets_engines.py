"""Presets against what engines publish: their units, their shipped numbers, their own formulas."""

import math

import numpy as np
import pytest

from sssfit.export.presets import (
    engine_look,
    import_preset,
    parameters_from,
    preset_of,
    preset_text,
)
from sssfit.export.presets.blender import cycles_albedo, dipole_albedo, widths_mm
from sssfit.export.presets.gltf import multiscatter_colour
from sssfit.export.presets.hdrp import filter_radius_mm
from sssfit.export.presets.medium import albedo_of_colour, entering_colour
from sssfit.export.presets.separable import FALLOFF, STRENGTH
from sssfit.export.presets.unreal import distance_mm
from sssfit.kernel.listing import listing
from sssfit.material import Layer, Material, load_material
from sssfit.shapes import diffusion_radius, s_diffuse_mean_free_path, s_perpendicular
from sssfit.simulate import simulate_dipole, simulate_exact
from sssfit.simulate.inversion import reflectance_of, van_de_hulst_albedo

SKIN = {"SurfaceAlbedo": (0.44, 0.22, 0.13), "MeanFreePathColor": (1.0, 0.735, 0.518)}
# Jensen et al. 2001, table 1, and what Unreal's documents give for skin and marble [cm].
SHIPPED = {"skin1": ((0.44, 0.22, 0.13), 0.1295), "marble": ((0.83, 0.79, 0.75), 0.0456)}


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.mark.parametrize("name", SHIPPED)
def test_unreals_shipped_presets_are_the_coefficients_of_2001(name):
    albedo, distance_cm = SHIPPED[name]
    material = load_material(name)
    found = preset_of("unreal", simulate_dipole(material), match="coefficients")
    red_cm = found["MeanFreePathDistance"] * found["MeanFreePathColor"][0]
    assert red_cm == pytest.approx(distance_cm, abs=5e-5)
    # A dipole's reflectance, of the light that enters; for skin1's green, .2273, the table has .22.
    entering = 1.0 - material.specular_reflectance
    np.testing.assert_allclose(np.array(found["SurfaceAlbedo"]) / entering, albedo, atol=0.0075)


def test_unreals_two_switches_draw_the_same():
    """An older asset, upgraded by the engine's own rule, keeps its distances."""
    albedo = np.array(SKIN["SurfaceAlbedo"])
    older = parameters_from(
        "unreal",
        {**SKIN, "MeanFreePathDistance": 2.0, "WorldUnitScale": 0.1, "EnableMeanFreePath": False},
    )
    dmfp = 2.0 * np.array(SKIN["MeanFreePathColor"])
    mfp = 0.6 * s_perpendicular(albedo) / s_diffuse_mean_free_path(albedo) * dmfp
    newer = parameters_from(
        "unreal",
        {
            "SurfaceAlbedo": SKIN["SurfaceAlbedo"],
            "MeanFreePathColor": mfp / mfp.max(),
            "MeanFreePathDistance": mfp.max(),
            "WorldUnitScale": 0.1 / 0.3,
        },
    )
    np.testing.assert_allclose(distance_mm(newer), distance_mm(older), rtol=1e-12)


def test_unreals_older_triple_is_the_kernel_of_separable_sss():
    found = parameters_from("unreal", {**SKIN, "EnableBurley": False, "ScatterRadius": 1.2})
    offsets, weights = listing(25, np.array(STRENGTH), np.array(FALLOFF))
    (stage,) = engine_look(found).stages
    np.testing.assert_allclose(stage.offsets_mm, 4.0 * offsets)
    np.testing.assert_allclose(stage.weights, weights)
    profile = import_preset("unreal", found.values)
    np.testing.assert_allclose(profile.diffuse_reflectance, SKIN["SurfaceAlbedo"], rtol=1e-12)
    # The unblurred share lies in the first annulus.
    share = profile.annulus_energy[0] / profile.diffuse_reflectance
    np.testing.assert_allclose(share, 1.0 - np.array(STRENGTH), atol=0.01)


def test_unreals_tint_leaves_the_rest_of_the_light_where_it_fell():
    given = {**SKIN, "MeanFreePathDistance": 0.13}
    whole = import_preset("unreal", given)
    tinted = import_preset("unreal", {**given, "Tint": "0.25,0.5,1"})
    np.testing.assert_allclose(tinted.diffuse_reflectance, whole.diffuse_reflectance, rtol=1e-12)
    share = tinted.annulus_energy[5:] / whole.annulus_energy[5:]
    np.testing.assert_allclose(share, np.broadcast_to((0.25, 0.5, 1.0), share.shape), rtol=1e-9)


def test_hdrps_filter_holds_997_of_a_thousand():
    found = parameters_from(
        "hdrp",
        {
            "baseColor": "0.5,0.5,0.5",
            "scatteringDistance": "1,0.5,0.25",
            "scatteringDistanceMultiplier": 2.0,
        },
    )
    assert filter_radius_mm(found) == pytest.approx(2.0 * 16.5643987534, rel=1e-11)
    assert "maximum radius of 33.13 mm" in preset_text(found)


def test_blenders_radius_is_four_pi_mean_free_paths_or_the_dipoles():
    colour = np.array((0.44, 0.22, 0.13))
    np.testing.assert_allclose(widths_mm("random_walk", colour, 1.4) * 4.0 * math.pi, 1.0)
    alpha = np.array([dipole_albedo(each, 1.4) for each in colour])
    skin = widths_mm("random_walk_skin", colour, 1.4)
    np.testing.assert_allclose(skin, np.sqrt(3.0 * (1.0 - alpha)))
    # Back through the dipole's own reflectance, Jensen et al. 2001, eq. 15.
    f_dr = -1.440 / 1.4**2 + 0.710 / 1.4 + 0.668 + 0.0636 * 1.4
    boundary = 4.0 / 3.0 * (1.0 + f_dr) / (1.0 - f_dr)
    again = 0.5 * alpha * (1.0 + np.exp(-boundary * skin)) * np.exp(-skin)
    np.testing.assert_allclose(again, colour, rtol=1e-12)


def test_cycles_colour_is_that_of_its_walk_without_an_interface():
    """Its fit to walks that begin with a cosine, against the exact solver at index 1."""
    colour = np.array((0.1, 0.2, 0.44, 0.6, 0.8))
    seen = reflectance_of(cycles_albedo(colour), 1.0, "diffuse")
    np.testing.assert_allclose(seen, colour, rtol=0.015)  # 1.4 % at 0.8, 4 % at 0.9


def test_openpbrs_colour_is_the_reflectance_below_the_interface(skin1):
    found = preset_of("openpbr", skin1)
    entering = 1.0 - skin1.specular_reflectance
    np.testing.assert_allclose(
        np.array(found["subsurface_color"]) * entering, skin1.diffuse_reflectance, rtol=1e-5
    )
    radius_mm = 10.0 * found["subsurface_radius"] * np.array(found["subsurface_radius_scale"])
    np.testing.assert_allclose(radius_mm, skin1.material.layers[0].mean_free_path_mm, rtol=1e-12)


def test_the_albedo_of_a_colour_has_it_to_nine_digits():
    colour = np.array([0.0, 1e-4, 7e-3, 0.44, 0.97, 1.0])
    for eta, g in ((1.0, 0.0), (1.4, 0.9)):
        albedo = albedo_of_colour(colour, g, eta)
        assert ((albedo >= 0.0) & (albedo <= 1.0)).all()
        np.testing.assert_allclose(entering_colour(albedo, g, eta), colour, rtol=2e-8, atol=1e-12)


def test_openpbrs_colour_of_forward_scattering_is_exact():
    """Taken as g = 0 it would be 0.3 %, 2.7 % and 58 % too bright."""
    layer = Layer(1.3, np.full(3, 0.7), np.array([0.02, 0.1, 0.9]), np.array([6.0, 5.0, 2.0]))
    profile = simulate_exact(Material("forward", ("R", "G", "B"), (layer,)))
    for name in ("openpbr", "materialx"):
        found = preset_of(name, profile)
        seen = np.array(found["subsurface_color"]) * (1.0 - profile.specular_reflectance)
        np.testing.assert_allclose(seen, profile.diffuse_reflectance, rtol=1e-5)
        again = import_preset(name, found.values).layers[0]
        np.testing.assert_allclose(again.sigma_s_per_mm, layer.sigma_s_per_mm, rtol=1e-9)


def test_an_albedo_of_backward_scattering_does_not_exceed_1():
    assert albedo_of_colour(np.array([0.3, 1.0]), -0.9, 1.4)[1] == 1.0


def test_gltf_reads_the_coefficients_back(skin1):
    found = preset_of("gltf", skin1)
    layer = skin1.material.layers[0]
    sigma_t = -np.log(found["attenuationColor"]) / found["attenuationDistance"]  # 1/m
    np.testing.assert_allclose(sigma_t / 1000.0, layer.sigma_t_per_mm, rtol=1e-12)
    np.testing.assert_allclose(
        van_de_hulst_albedo(np.array(found["multiscatterColor"])), layer.albedo, rtol=1e-12
    )
    albedo = np.linspace(0.0, 1.0, 101)[1:]
    np.testing.assert_allclose(van_de_hulst_albedo(multiscatter_colour(albedo)), albedo, atol=2e-6)
    (warning,) = found.warnings
    assert "R 0.439, G 0.213, B 0.115" in warning


def test_babylons_shader_finds_the_shapes_in_its_own_order(skin1):
    found = preset_of("babylon", skin1)
    red, green, blue = found["color"]
    stored = np.array((red, blue, green))  # addDiffusionProfile pushes r, b, g
    wanted = preset_of("hdrp", skin1)
    distance_mm_ = wanted["scatteringDistanceMultiplier"] * np.array(wanted["scatteringDistance"])
    # S is per mm of a scene whose unit is metersPerUnit; samples are made for max(color).
    np.testing.assert_allclose(stored * found["metersPerUnit"], 1.0 / distance_mm_)
    assert max(stored) * min(stored) == pytest.approx(1.0)
    equal = preset_of("babylon", skin1, equal=True)
    assert len(set(equal["color"])) == 1
    assert not equal.warnings
    half = parameters_from("babylon", {**equal.values, "color": "0.3,0.3,0.3"})
    assert "Samples reach over 40 %" in half.warnings[0]


def test_godots_own_constants_are_the_published_skin():
    """subsurface_scattering.glsl, as Godot 4 ships it, six digits."""
    given = {
        "albedo": "1,1,1",
        "subsurface_scattering_depth_scale": 0.01,
        "strength": STRENGTH,
        "falloff": FALLOFF,
    }
    shipped = {
        25: ((0.530605, 0.613514, 0.739601, 0.0), (0.0402784, 0.0657244, 0.04631, 0.0833333)),
        17: ((0.536343, 0.624624, 0.748867, 0.0), (0.0582416, 0.0659959, 0.0411329, 0.125)),
        11: ((0.560479, 0.669086, 0.784728, 0.0), (0.0821904, 0.0358608, 0.0209261, 0.32)),
    }
    for taps, rows in shipped.items():
        text = preset_text(parameters_from("godot", {**given, "taps": taps}))
        table = text.split("skin_kernel")[-1]
        for k, row in zip((0, 2), rows, strict=True):
            line = table.splitlines()[k + 1]
            found = [float(each) for each in line.split("(")[1].split(")")[0].split(",")]
            np.testing.assert_allclose(found, row, rtol=5e-6)  # printed with six digits
        assert f"kernel_size = {taps // 2 + 1};" in text


@pytest.mark.parametrize(
    ("name", "given", "reach_mm"),
    [
        # Three units of an offset: twice the width, since a texture coordinate spans half of it.
        ("iryoku", {"sssWidth": 0.012, "strength": STRENGTH, "falloff": FALLOFF}, 24.0),
        ("stride", {"ScatteringWidth": 0.015, "Strength": STRENGTH, "Falloff": FALLOFF}, 30.0),
        (
            "godot",
            {
                "subsurface_scattering_depth_scale": 0.01,
                "subsurf_scatter_strength": 0.5,
                "strength": STRENGTH,
                "falloff": FALLOFF,
            },
            10.0,
        ),
        ("community-shaders", {"BlurRadius": 1.0}, 28.56),
    ],
)
def test_widths_are_lengths_on_the_surface(name, given, reach_mm):
    look = engine_look(parameters_from(name, {"albedo": "1,1,1", **given}))
    reach = 3.0 if look.stages[0].offsets_mm.size >= 10 else 2.0
    assert look.stages[0].offsets_mm[-1] * 3.0 / reach == pytest.approx(reach_mm)


# The re-derived algorithm: red's weight at the centre and at the next tap, and its offset; the root
# of the second moment along an axis before and after the strength is mixed in [mm].
LISTED = {
    25: (0.53060512, 0.02114117, 0.0208333, 0.724, 0.501),
    17: (0.53634254, 0.03244625, 0.03125, 0.584, 0.405),
    11: (0.56047879, 0.07718024, 0.08, 0.571, 0.396),
}


@pytest.mark.parametrize("taps", LISTED)
def test_the_kernel_of_separable_sss_is_the_published_one(taps):
    centre, near, offset, before_mm, after_mm = LISTED[taps]
    given = {"albedo": "1,1,1", "sssWidth": 0.0015, "strength": STRENGTH, "falloff": FALLOFF}
    (stage,) = engine_look(
        parameters_from("iryoku", {**given, "SSSS_N_SAMPLES": taps})
    ).stages  # sssWidth of 1.5 mm: one unit of an offset is 1 mm
    red = stage.weights[:, 0]
    assert red[0] == pytest.approx(centre, abs=5e-9)
    assert red[1] == pytest.approx(near, abs=5e-9)
    assert stage.offsets_mm[0] == pytest.approx(offset, abs=5e-8)
    assert stage.offsets_mm[-1] == pytest.approx(3.0 if taps > 20 else 2.0)
    # Quadratic spacing, and unit sums in every channel.
    np.testing.assert_allclose(
        np.sqrt(stage.offsets_mm / stage.offsets_mm[-1]), np.arange(1, len(red)) / (len(red) - 1)
    )
    np.testing.assert_allclose(stage.weights[0] + 2.0 * stage.weights[1:].sum(axis=0), 1.0)
    second = 2.0 * float(red[1:] @ stage.offsets_mm**2)
    assert math.sqrt(second) == pytest.approx(after_mm, abs=5e-4)
    assert math.sqrt(second / STRENGTH[0]) == pytest.approx(before_mm, abs=5e-4)


def test_normalised_diffusions_radii_are_the_published_ones():
    found = diffusion_radius([0.5, 0.9, 0.997], 1.0)
    np.testing.assert_allclose(found, [1.5521832635, 6.0622291433, 16.5643987534], atol=5e-11)


def test_o3de_draws_twice_its_distance(skin1):
    found, hdrp = preset_of("o3de", skin1), preset_of("hdrp", skin1)
    assert 2.0 * found["scatterDistance"] == hdrp["scatteringDistanceMultiplier"]


def test_the_fitted_kernel_beats_the_published_skin_and_its_neighbours(skin1):
    """The fit is a minimum of what it says it minimises: taps moved by 2 % are worse."""
    from sssfit.export.presets import separable_fit
    from sssfit.export.presets.source import source_of

    spectra = separable_fit._Spectra.of(skin1)
    found = separable_fit.fit_separable(source_of(skin1), 25)

    def misfit(c, unit_mm, strength, falloff):
        a = separable_fit._spectrum(25, strength, falloff, unit_mm, spectra)
        return float(((spectra.weight * (np.outer(a, a) - spectra.wanted[c])) ** 2).sum())

    for c in range(3):
        own = (found.unit_mm, found.strength[c], found.falloff[c])
        least = misfit(c, *own)
        assert least < misfit(c, 4.0, STRENGTH[c], FALLOFF[c])
        for k in {0, 1} if c == 0 else {1, 2}:
            for factor in (0.98, 1.02):
                moved = [each * (factor if j == k else 1.0) for j, each in enumerate(own)]
                assert least < misfit(c, *moved)
