"""Presets: an engine's parameters are the material's, in its own units, and lead back to it."""

import ast
import dataclasses
import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest

from sssfit import __version__
from sssfit.errors import ArgumentError, KernelError, SssfitError
from sssfit.export import kernel_text
from sssfit.export.presets import (
    engine_look,
    import_preset,
    parameters_from,
    preset,
    preset_json,
    preset_of,
    preset_text,
)
from sssfit.export.presets.separable import (
    LEAST_FALLOFF,
    Separable,
    separable_of_taps,
    separable_taps,
)
from sssfit.export.presets.source import Source
from sssfit.fit import fit_burley, fit_preintegrated
from sssfit.kernel import Taps
from sssfit.material import Layer, Material, load_material
from sssfit.methods import PRESETS
from sssfit.optics import normal_transmittance
from sssfit.profile import Profile
from sssfit.simulate import (
    simulate_deon_skin,
    simulate_exact,
    simulate_gaussians,
    simulate_multipole,
)

MEDIA = ("openpbr", "materialx", "pbrt", "mitsuba", "gltf")
# Every preset, and what a user may choose that changes the conversion.
CHOICES = [
    *((name, {}) for name in PRESETS),
    ("unreal", {"EnableMeanFreePath": False, "WorldUnitScale": 0.1}),
    ("unreal", {"match": "coefficients"}),
    ("babylon", {"equal": True, "sceneMetersPerUnit": 0.01}),
    *(("blender", {"method": each}) for each in ("burley", "eevee", "random_walk_skin")),
    ("community-shaders", {"SSMode": 1}),
    ("iryoku", {"SSSS_N_SAMPLES": 11, "meters_per_unit": 0.01}),
    ("godot", {"taps": 17}),
    ("openpbr", {"mm_per_unit": 1000.0}),
]
# Coefficients are not in a profile, and 21 taps of the kernel in no table that is read back.
LEAD_BACK = [
    each
    for each in CHOICES
    if each[1].get("match") != "coefficients" and each != ("community-shaders", {})
]
IDS = [f"{name} {choice}" if choice else name for name, choice in CHOICES]


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def of_skin1(skin1):
    """Parameters of skin1 by preset and choice, each converted once."""
    kept = {}

    def found(name, choice):
        key = name, *choice.items()
        if key not in kept:
            kept[key] = preset_of(name, skin1, **choice)
        return kept[key]

    return found


@pytest.fixture(scope="module")
def kernel(skin1):
    return fit_preintegrated(skin1).kernel


@pytest.fixture(scope="module")
def marble():
    return simulate_exact(load_material("marble"))


def assert_same(found, wanted, rtol=1e-6):
    assert found.keys() == wanted.keys()
    for key, value in wanted.items():
        if isinstance(value, str | bool):
            assert found[key] == value, key
        else:
            np.testing.assert_allclose(found[key], value, rtol=rtol, atol=1e-9, err_msg=key)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_says_what_it_is(name):
    found = preset(name)
    assert found.name == name
    assert found.engine
    assert found.model
    assert found.lost.endswith(".")
    assert all("github.com/" in each or "." in each for each in found.origin)
    names = [each.name for each in found.fields]
    assert len(set(names)) == len(names)
    for each in found.fields:
        assert each.meaning
        assert each.unit or each.kind in ("flag", "choice", "whole")


@pytest.mark.parametrize(("name", "choice"), CHOICES, ids=IDS)
def test_parameters_are_read_back_from_their_own_words(of_skin1, name, choice):
    found = of_skin1(name, choice)
    assert found.title == "skin1"
    assert {key: found[key] for key in choice} == choice
    record = json.loads(preset_json(found))
    assert list(record["parameters"]) == [each.name for each in found.preset.fields]
    words = {
        key: ",".join(map(repr, each["value"]))
        if isinstance(each["value"], list)
        else str(each["value"])
        for key, each in record["parameters"].items()
    }
    assert parameters_from(name, words, "skin1").values == found.values


@pytest.mark.parametrize(("name", "choice"), CHOICES, ids=IDS)
def test_the_look_has_the_energy_of_the_profile(skin1, of_skin1, name, choice):
    look = engine_look(of_skin1(name, choice))
    total = look.energy if isinstance(look, Taps) else look.diffuse_reflectance
    np.testing.assert_allclose(total, skin1.diffuse_reflectance, rtol=3e-5)


@pytest.mark.parametrize(
    ("name", "choice"),
    LEAD_BACK,
    ids=[IDS[CHOICES.index(each)] for each in LEAD_BACK],
)
def test_what_an_engine_draws_gives_its_parameters_again(of_skin1, name, choice):
    """Through the medium, the profile or the taps; for the walks at the index of a bare profile."""
    first = of_skin1(name, choice)
    if name == "blender":
        first = parameters_from(name, {**first.values, "ior": 1.4}, "skin1")
    if name == "hdrp":
        first = parameters_from(name, {**first.values, "indexOfRefraction": 1.4}, "skin1")
    is_taps = first.preset.of_taps is not None
    made = engine_look(first) if is_taps else import_preset(name, first.values, "skin1")
    assert_same(preset_of(name, made, **choice).values, first.values)


def test_community_shaders_kernel_is_the_one_of_separable_sss(of_skin1):
    found = of_skin1("community-shaders", {})
    look = engine_look(found)
    assert 2 * len(look.stages[0].offsets_mm) + 1 == 21
    # Three units of an offset are twice BlurRadius, in game units of 14.28 mm.
    assert look.stages[0].offsets_mm[-1] == pytest.approx(2.0 * 14.28 * found["BlurRadius"])


@pytest.mark.parametrize("name", MEDIA)
@pytest.mark.parametrize("g", [0.0, 0.8])
def test_media_lead_back_to_their_material(name, g):
    layer = Layer(1.4, g, [0.01, 0.2, 0.6], [2.0, 1.5, 0.9])
    material = Material("wax", ("R", "G", "B"), (layer,))
    profile = simulate_exact(dataclasses.replace(material, layers=(reduced(layer),)))
    record = Profile(**{**fields_of(profile), "meta": {**profile.meta, **record_of(material)}})
    found = preset_of(name, record)
    back = import_preset(name, found.values, "wax").layers[0]
    assert back.eta == pytest.approx(1.4)
    np.testing.assert_allclose(back.g, g, atol=1e-12)
    np.testing.assert_allclose(back.sigma_s_per_mm, layer.sigma_s_per_mm, rtol=2e-6)
    np.testing.assert_allclose(back.sigma_a_per_mm, layer.sigma_a_per_mm, rtol=2e-5)


def reduced(layer):
    """The isotropic layer of the same reduced coefficients."""
    return Layer(layer.eta, 0.0, layer.sigma_a_per_mm, layer.reduced_sigma_s_per_mm)


def fields_of(record):
    return {each.name: getattr(record, each.name) for each in dataclasses.fields(record)}


def record_of(material):
    return {"material": material.to_dict(), "material_sha256": material.sha256}


@pytest.mark.parametrize(("name", "choice"), CHOICES, ids=IDS)
def test_the_text_is_of_its_kind(of_skin1, name, choice):
    found = of_skin1(name, choice)
    text = preset_text(found)
    ending = found.preset.ending
    assert text.endswith("\n")
    if ending == ".py":
        ast.parse(text)
    elif ending in (".json", ".material", ".gltf"):
        json.loads(text)
    elif ending in (".xml", ".mtlx"):
        ElementTree.fromstring(text)
    else:
        code = re.sub(r"//.*|#.*", "", text)
        for opening, closing in ("()", "{}", "[]"):
            assert code.count(opening) == code.count(closing)


def test_engines_of_one_shape_draw_the_one_that_fits_best(skin1, of_skin1):
    best = [each["s_per_mm"] for each in fit_burley(skin1).kernel.parameters.values()]
    for name, choice in CHOICES:
        if (
            name in (*MEDIA, "iryoku", "godot", "stride")
            or choice.get("match")
            or "equal" in choice
        ):
            continue
        if name == "community-shaders" and not choice:
            continue
        look = engine_look(of_skin1(name, choice))
        again = [each["s_per_mm"] for each in fit_burley(look).kernel.parameters.values()]
        np.testing.assert_allclose(again, best, rtol=1e-6, err_msg=f"{name} {choice}")


def test_only_bright_materials_are_outside_the_range_of_burley(skin1, marble):
    for name in ("unreal", "hdrp", "o3de", "babylon"):
        (warning,) = [each for each in preset_of(name, marble).warnings if "0.7" in each]
        assert "R 0.804, G 0.767, B 0.731" in warning
        assert not [each for each in preset_of(name, skin1).warnings if "0.7" in each]
    assert not preset_of("pbrt", marble).warnings


MIXED = Layer(1.3, np.array([0.85, 0.7, 0.0]), np.array([0.02, 0.1, 0.9]), np.array([6, 5, 2.0]))


@pytest.mark.parametrize("name", MEDIA)
def test_a_medium_that_stands_in_for_channels_of_several_g_says_what_it_changes(name, skin1):
    """G returns 0.35395 by the exact solver, and 0.36363 with g = 0."""
    mixed = Source(skin1, Material("mixed", ("R", "G", "B"), (MIXED,)))
    first = preset_of(name, mixed).warnings[0]
    assert first.endswith("which changes R_d: R +0.71 %, G +2.7 %, B 0 %.")
    assert name == "gltf" or first in preset_text(preset_of(name, mixed))


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("unrael", {}, "did you mean unreal"),
        ("unreal", {"SurfaceAlbedo": "0.4,0.2,1.2"}, "three numbers from 0 to 1"),
        ("unreal", {"SurfaceAlbedo": "0.4,0.2"}, "three numbers"),
        ("unreal", {"SurfaceAlbedo": "red"}, "SurfaceAlbedo = 'red'"),
        ("unreal", {}, "SurfaceAlbedo missing"),
        ("unreal", {"SurfaceAlbedo": "1,1,1", "MeanFreePathDistance": 0}, "at most 50, in cm"),
        ("unreal", {"SurfaceAlbedo": "1,1,1", "EnableBurley": "maybe"}, "true or false"),
        ("unreal", {"SurfaceAlbedos": "1,1,1"}, "did you mean SurfaceAlbedo"),
        ("blender", {"base_color": "1,1,1", "subsurface_radius": "1,0,1"}, "above 0"),
        ("blender", {"base_color": "1,1,1", "method": "walk"}, "one of burley, eevee"),
        ("hdrp", {"baseColor": "1,1,1", "scatteringDistance": "nan,1,1"}, "above 0, at most 1"),
        ("iryoku", {"SSSS_N_SAMPLES": 13}, "missing"),
        ("openpbr", {"subsurface_color": "1,1,1", "subsurface_radius": "inf"}, "above 0"),
    ],
)  # fmt: skip
def test_bad_input_gives_one_clear_line(name, given, said):
    with pytest.raises(ArgumentError, match=re.escape(said)) as raised:
        parameters_from(name, given)
    assert "\n" not in str(raised.value)


def test_a_title_suits_a_file():
    given = {"baseColor": "1,1,1", "scatteringDistance": "1,1,1"}
    assert import_preset("hdrp", given, "my-skin").material_name == "my-skin"
    with pytest.raises(SssfitError, match="my skin/2"):
        import_preset("hdrp", given, "my skin/2")


def test_a_choice_is_not_a_parameter_of_the_material(skin1):
    with pytest.raises(ArgumentError, match="takes no 'baseColor'"):
        preset_of("hdrp", skin1, baseColor="1,1,1")


@pytest.mark.parametrize("name", PRESETS)
def test_a_fitted_kernel_is_no_preset(kernel, name):
    with pytest.raises(KernelError, match="give its profile or its material"):
        preset_of(name, kernel)


def test_taps_of_other_shapes_are_refused(of_skin1):
    look = engine_look(of_skin1("iryoku", {}))
    (stage,) = look.stages
    weights = stage.weights.copy()
    weights[1], weights[2] = stage.weights[2], stage.weights[1]
    other = dataclasses.replace(look, stages=(dataclasses.replace(stage, weights=weights),))
    with pytest.raises(KernelError, match="no strength and falloff"):
        preset_of("iryoku", other)
    star = dataclasses.replace(look, blend=np.stack((0.1 * look.energy, 0.9 * look.energy)))
    with pytest.raises(KernelError, match="not the kernel of separable-sss"):
        preset_of("iryoku", star)
    fewer = engine_look(
        of_skin1(*CHOICES[IDS.index("iryoku {'SSSS_N_SAMPLES': 11, 'meters_per_unit': 0.01}")])
    )
    with pytest.raises(KernelError, match="11 taps"):
        preset_of("stride", fewer)


@pytest.mark.parametrize("name", PRESETS)
def test_what_cannot_be_converted_is_said(name):
    grey = simulate_gaussians([0.5], [[0.3]], name="grey", channels=["grey"])
    dark = simulate_gaussians([0.5], [[0.3, 0.0, 0.2]], name="dark")
    layers = load_material("skin1").layers
    slab = Material("slab", ("R", "G", "B"), (dataclasses.replace(layers[0], thickness_mm=2.0),))
    for record, said in (
        (grey, "three: red, green and blue"),
        (dark, "channel G reflects nothing"),
        (slab, "has layers or a bottom"),
        ("skin1", "neither a material nor a profile"),
    ):
        with pytest.raises(SssfitError, match=said):
            preset_of(name, record)


@pytest.mark.parametrize("name", PRESETS)
def test_layers_are_sent_where_a_preset_takes_them(name):
    """A preset of a medium has no use for the profile of layers, either."""
    skin = load_material("skin1")
    slab = Material(
        "slab", skin.channels, (dataclasses.replace(skin.layers[0], thickness_mm=20.0),)
    )
    profile = simulate_multipole(slab)
    if name in MEDIA:
        for record in (slab, profile):
            with pytest.raises(KernelError, match=f"{name} describes one layer .* unreal or hdrp"):
                preset_of(name, record)
        return
    with pytest.raises(KernelError, match="simulate its profile and give that"):
        preset_of(name, slab)
    if name in ("unreal", "hdrp"):
        assert preset_of(name, profile).title == "slab"


@pytest.mark.parametrize("name", [name for name in PRESETS if name not in MEDIA])
def test_skin_whose_energy_is_1_but_for_rounding_is_converted(name):
    """That of the six Gaussians is 1 + 7e-16, which is no share."""
    skin = simulate_deon_skin()
    assert 1.0 < skin.diffuse_reflectance.max() < 1.0 + 1e-14
    found = preset_of(name, skin)
    look = engine_look(found)
    energy = look.diffuse_reflectance if isinstance(look, Profile) else look.energy
    most = normal_transmittance(1.4) if name == "blender" else 1.0
    np.testing.assert_allclose(energy, most, rtol=1e-6)
    said = "Below the interface of index 1.4 a white base colour returns 0.9722 of the light, and"
    assert any(said in each for each in found.warnings) == (name == "blender")


@pytest.mark.parametrize("name", MEDIA)
def test_media_need_coefficients(name):
    skin = simulate_gaussians([0.5, 2.0], [[0.2, 0.1, 0.1], [0.2, 0.1, 0.05]], name="painted")
    with pytest.raises(KernelError, match="without coefficients"):
        preset_of(name, skin)
    assert preset_of("unreal", skin).title == "painted"


def rounded(table, digits):
    """The table with outer weights of so many digits, and the middle ones such that all add up."""
    (stage,) = table.stages
    weights = np.round(stage.weights, digits)
    weights[0] = 1.0 - 2.0 * weights[1:].sum(axis=0)
    return dataclasses.replace(table, stages=(dataclasses.replace(stage, weights=weights),))


@pytest.mark.parametrize(
    ("taps", "falloff", "digits"), [(25, 0.1, 9), (25, 0.3, 9), (9, 0.1, 9), (7, 0.3, 8)]
)
def test_rounded_taps_are_known_again(taps, falloff, digits):
    kernel = Separable(1.7, np.array([0.3, 0.9, 1.0]), np.full(3, falloff))
    table = separable_taps("wax", "separable-sss", np.array([0.9, 0.5, 0.1]), kernel, taps)
    found, _ = separable_of_taps(rounded(table, digits))
    np.testing.assert_allclose(found.falloff, falloff, rtol=1e-3)
    np.testing.assert_allclose(found.strength, kernel.strength, rtol=1e-3)


def test_an_export_of_an_engines_own_taps_names_the_version_that_made_them():
    kernel = Separable(1.7, np.array([0.3, 0.9, 1.0]), np.full(3, 0.1))
    table = separable_taps("wax", "separable-sss", np.array([0.9, 0.5, 0.1]), kernel, 9)
    assert f"wax, separable-sss. sssfit {__version__}." in kernel_text(table, "glsl")[0]


@pytest.mark.parametrize(("taps", "falloff"), [(7, 0.03), (7, 0.021)])
def test_one_weight_alone_has_no_parameters(taps, falloff):
    """A falloff and a strength could be found for it, of 60 for instance."""
    kernel = Separable(1.7, np.array([0.3, 0.9, 1.0]), np.full(3, falloff))
    table = separable_taps("wax", "separable-sss", np.array([0.9, 0.5, 0.1]), kernel, taps)
    with pytest.raises(KernelError, match="no strength and falloff"):
        separable_of_taps(rounded(table, 10))


@pytest.mark.parametrize("taps", range(5, 32, 2))
def test_taps_with_the_least_and_the_largest_falloff_are_known_again(taps):
    kernel = Separable(1.7, np.array([0.3, 0.9, 1.0]), np.array([LEAST_FALLOFF, 1.0, 0.57]))
    table = separable_taps("wax", "separable-sss", np.array([0.9, 0.5, 0.1]), kernel, taps)
    found, count = separable_of_taps(table)
    assert count == taps
    assert found.unit_mm == pytest.approx(kernel.unit_mm, rel=1e-12)
    np.testing.assert_allclose(found.falloff, kernel.falloff, rtol=1e-9)
    np.testing.assert_allclose(found.strength, kernel.strength, rtol=1e-9)
