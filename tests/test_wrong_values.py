"""Values of a wrong kind, by any argument: one line of the library's own, or a right result."""

import dataclasses
import io
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from reference_pixels import one_over_r_profile

import sssfit
from sssfit.choose.choice import choose
from sssfit.compare.comparison import pareto_front
from sssfit.compare.guide import compute_guide
from sssfit.compare.kernel_view import view_kernel
from sssfit.compare.models import material_of_walk
from sssfit.compare.motion import motion
from sssfit.compare.taps_view import view_taps
from sssfit.errors import FitError, ProfileError, RenderError, SssfitError
from sssfit.export.lut import lut_bytes
from sssfit.export.presets import preset
from sssfit.fit import fit_guided, fit_preintegrated, fit_svd
from sssfit.fit.artist import fit_artist
from sssfit.fit.cascade import fit_cascade
from sssfit.fit.disk import fit_disk
from sssfit.fit.gaussian_chain import fit_gaussian_chain
from sssfit.fit.on_taps import on_taps
from sssfit.fit.pyramid import fit_pyramid
from sssfit.formats.csv import csv_text
from sssfit.formats.pictures import Image
from sssfit.grid import RadialGrid, make_grid
from sssfit.kernel import Taps
from sssfit.kernel.between import taps_between
from sssfit.kernel.taps import Stage
from sssfit.material import load_material
from sssfit.measure.asymmetry import radial_asymmetry
from sssfit.measure.cost import cost_of
from sssfit.measure.delta_e import auto_exposure
from sssfit.measure.score import measure
from sssfit.motion.run import make_frames
from sssfit.profile.beam import parse_beam, under_beam
from sssfit.profile.frequency import frequency_response
from sssfit.profile.smooth import smoothed
from sssfit.render.adaptive import make_sampler, render_samples, samples_for
from sssfit.render.bloom import bloomed
from sssfit.render.jitter import Jitter
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.taps import render_taps
from sssfit.render.transmittance import beyond, through, transmittance
from sssfit.scene.made import make_scene
from sssfit.scene.mesh import Mesh
from sssfit.simulate import read_checkpoint, simulate_burley, simulate_montecarlo
from sssfit.sweep import load_plan, sweep_to_store

WRONG = [
    *(None, "a", "", b"x", "a\0b", "\ud800", True, -1, 0, 1.5, 10**400, float("nan"), 1j),
    *(Decimal("1.5"), Fraction(3, 2), np.float32(1.5), np.int64(2), np.bool_(True)),
    *([], {}, (), [1, 2], ["a"], [[1], [1, 2]], object(), Path("nowhere"), io.StringIO("x")),
    *(np.array([]), np.zeros((2, 2)), np.ones((2, 3), complex), np.array([None], object)),
    *(np.full((3, 3, 3), np.nan), np.ones((2, 2, 3), bool), np.array("x"), range(3)),
    np.ma.masked_array([1.0, 2.0], [True, False]),
]
PROFILE = one_over_r_profile(40, 0.1, [0.3, 0.5, 0.8])
KERNEL = fit_preintegrated(PROFILE, mm_per_pixel=0.5).kernel
TAPS = fit_disk(PROFILE, taps=4, mm_per_pixel=0.5).kernel
PAIR = Stage(0, "pair", np.array([0.5]), np.full((2, 3), 0.25))
LIGHT = np.ones((12, 12, 3))
SCENE = make_scene("edge", height=4, width=4, mm_per_pixel=0.5)
MATERIAL = load_material("skin1")
RECORDS = [
    *(MATERIAL, MATERIAL.layers[0], PROFILE, KERNEL, TAPS, TAPS.stages[0], SCENE, Jitter()),
    Image(LIGHT, ("R", "G", "B"), alpha=LIGHT[..., 0]),
    Mesh("m", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.eye(3)[:, :2], np.array([[0, 1, 2]])),
    RadialGrid(0.1, 10),
]
DEEP = dataclasses.replace(SCENE, distance_mm=300.0, depth_mm=np.full((4, 4), 300.0))
SAMPLER = make_sampler(PROFILE, 0.5)
SIZES = {"dr_mm": 0.5, "radius_mm": 5.0}
CALLS = {
    "load": (sssfit.load, {"source": "skin1", "origin": "x"}),
    "load_material": (load_material, {"name_or_path": "skin1"}),
    "material_names": (sssfit.material_names, {"paper": False, "layered": False}),
    "load_image": (sssfit.load_image, {"path": "a.exr", "layer": None, "largest_bytes": 1e9}),
    "save_image": (
        lambda target="a.exr", pixels=LIGHT, **options: sssfit.save_image(
            target, pixels, **options
        ),
        {"target": "a.exr", "pixels": LIGHT, "channels": "RGB", "format": "exr", "exposure": 1.0}
        | {"mm_per_pixel": 1.0, "alpha": LIGHT[..., 0], "alpha_is_multiplied": False},
    ),
    "Profile.read": (sssfit.Profile.read, {"source": "a", "origin": "x"}),
    "SeparableKernel.read": (sssfit.SeparableKernel.read, {"source": "a", "origin": "x"}),
    "Taps.read": (Taps.read, {"source": "a", "origin": "x"}),
    "read_checkpoint": (read_checkpoint, {"source": "a"}),
    "Profile.save": (PROFILE.save, {"path": "a"}),
    "Taps.save": (TAPS.save, {"path": "a"}),
    "cumulative_at": (PROFILE.cumulative_at, {"r_mm": 1.0}),
    "energy_radii_mm": (PROFILE.energy_radii_mm, {"shares": [0.5]}),
    "quadrant_kernel": (PROFILE.quadrant_kernel, {"mm_per_pixel": 1.0, "channel": 0}),
    "line_kernel": (PROFILE.line_kernel, {"mm_per_pixel": 1.0, "half_pixels": 3}),
    "full": (KERNEL.full, {"channel": 0}),
    "line": (
        TAPS.stages[0].line,
        {"offsets_mm": [0.5, 1.2], "weights": np.ones((2, 3)), "mm_per_texel": 0.5},
    ),
    "pass_weights": (PAIR.pass_weights, {"mm_per_texel": 0.5}),
    "bytes_per_pixel": (TAPS.bytes_per_pixel, {"texel": "half"}),
    "from_dict": (sssfit.Material.from_dict, {"content": MATERIAL.to_dict()}),
    "corner": (SCENE.corner, {"pixels": 2}),
    "render": (
        sssfit.render,
        {"image": LIGHT, "kernel": KERNEL, "border": "mirror", "threads": 1, "dtype": "f4"},
    ),
    "render taps": (
        sssfit.render,
        {"image": LIGHT, "kernel": TAPS, "border": "mirror", "threads": 1, "dtype": "f8"}
        | {"jitter": None, "intermediate": None, "frame": 0},
    ),
    "fit": (
        sssfit.fit,
        {"profile": PROFILE, "method": "preintegrated", "mm_per_pixel": 0.5, "support_mm": 3.0}
        | {"normalize": False, "smooth": False, "place": None},
    ),
    "fit svd": (sssfit.fit, {"profile": PROFILE, "method": "svd", "rank": 1}),
    "fit_svd": (fit_svd, {"profile": PROFILE, "normalize": False, "energy": "keep"}),
    "fit_guided": (
        fit_guided,
        {"profile": PROFILE, "mm_per_pixel": 1.0, "k": 1.0, "b": 50.0, "centre_bound": 0.2},
    ),
    "settings of fit_cascade": (
        lambda **given: fit_cascade(PROFILE, **({"stages": "1", "mm_per_pixel": 2.0} | given)),
        {"fetches": 8.0, "passes": 2, "still": False, "full_resolution": False}
        | {"spectrum": "white"},
    ),
    "simulate_burley": (
        simulate_burley,
        {"material": MATERIAL, "reflectance": 0.5, "mapping": "diffuse", **SIZES},
    ),
    "simulate_montecarlo": (
        lambda **given: simulate_montecarlo(MATERIAL, photons=50, **(SIZES | given)),
        {"numerical_aperture": 0.2, "target_error": None, "angles": None},
    ),
    "simulate": (sssfit.simulate, {"material": "skin1", "method": "burley", **SIZES}),
    "simulate walk": (
        lambda **given: sssfit.simulate("skin1", "montecarlo", **(SIZES | given)),
        {"photons": 50, "seed": 1, "threads": 1, "target_error": None, "angles": None},
    ),
    "make_scene": (
        make_scene,
        {"name": "edge", "height": 4, "width": 4, "mm_per_pixel": 0.5, "angle_degrees": 1.0},
    ),
    "measure": (
        measure,
        {"image": LIGHT, "truth": LIGHT, "exposure": None, "mask": None, "structure": False},
    ),
    "render_reference": (render_reference, {"scene": SCENE, "profile": PROFILE}),
    "render_taps": (render_taps, {"scene": SCENE, "taps": TAPS, "coverage": None}),
    "render_screen": (
        render_screen,
        {"scene": DEEP, "kernel": KERNEL, "scale": 1.0, "depth_variance_mm2": 1.0},
    ),
    "render_samples": (
        render_samples,
        {"scene": SCENE, "sampler": SAMPLER, "counts": 2, "scale": 1.0},
    ),
    "make_sampler": (make_sampler, {"profile": PROFILE, "mm_per_pixel": 0.5}),
    "samples_for": (samples_for, {"variance": 0.1, "target_variance": 0.01, "start": 1}),
    "through": (through, {"kernel": KERNEL, "thickness_mm": 1.0}),
    "beyond": (beyond, {"kernel": KERNEL, "thickness_mm": 1.0}),
    "transmittance": (
        transmittance,
        {"thickness_mm": 1.0, "variances_mm2": [[1.0]], "weights": [[1.0]], "widths": 2.0},
    ),
    "bloomed": (bloomed, {"picture": LIGHT, "share": 0.1}),
    "auto_exposure": (auto_exposure, {"truth": LIGHT, "mask": None}),
    "radial_asymmetry": (radial_asymmetry, {"response": np.eye(5), "from_pixels": 1}),
    "pareto_front": (pareto_front, {"cost": [1.0, 2.0], "error": [2.0, 1.0]}),
    "frequency_response": (frequency_response, {"profile": PROFILE, "k_per_mm": [0.0, 1.0]}),
    "under_beam": (under_beam, {"profile": PROFILE, "beam": parse_beam("flat:0.5")}),
    "parse_beam": (parse_beam, {"text": "flat:0.5"}),
    "smoothed": (smoothed, {"profile": PROFILE}),
    "csv_text": (csv_text, {"profile": PROFILE}),
    "view_kernel": (view_kernel, {"kernel": KERNEL, "profile": None, "channels": None}),
    "view_taps": (view_taps, {"taps": TAPS, "profile": None}),
    "motion": (motion, {"kernel": KERNEL, "profile": PROFILE, "positions": 1}),
    "cost_of": (cost_of, {"kernel": KERNEL}),
    "make_frames": (make_frames, {"profile": PROFILE, "scene": SCENE, "shift": (0, 0)}),
    "taps_between": (taps_between, {"first": TAPS, "second": TAPS, "mm_per_pixel": 0.5}),
    "on_taps": (on_taps, {"kernel": KERNEL, "taps": 3, "place": "cumulative"}),
    "fit_cascade": (fit_cascade, {"profile": PROFILE}),
    "fit_pyramid": (fit_pyramid, {"profile": PROFILE}),
    "fit_gaussian_chain": (fit_gaussian_chain, {"profile": PROFILE}),
    "make_grid": (make_grid, {"material": MATERIAL, **SIZES}),
    "material_of_walk": (material_of_walk, {"profile": PROFILE}),
    "choose": (lambda **given: choose(mm_per_pixel=-1.0, **given), {"source": PROFILE}),
    "preset": (preset, {"name": "unreal"}),
    "load_plan": (load_plan, {"path": "a"}),
    "sweep_to_store": (sweep_to_store, {"plan": "p.toml", "path": "x.zarr"}),
}


def refused(call, **given):
    """Whether a call is refused, in one line of the library's own; other errors are raised."""
    try:
        call(**given)
    except SssfitError as error:
        said = str(error)
    else:
        return False
    assert said
    assert "\n" not in said
    return True


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CALLS)
def test_wrong_arguments(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sssfit.simulate._finished.DEFAULT_PHOTONS", 1000)  # 1e7 take 4 s
    call, good = CALLS[name]
    for key in good:
        answers = [refused(call, **(good | {key: wrong})) for wrong in WRONG]
        assert any(answers) or key == "origin", key


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("record", RECORDS, ids=lambda each: type(each).__name__)
def test_wrong_fields(record):
    for field in dataclasses.fields(record):
        for wrong in WRONG:
            refused(lambda **given: dataclasses.replace(record, **given), **{field.name: wrong})


def test_passes_beyond_memory_are_refused():
    """Texels of 1e-12 mm would make one of 8 TB."""
    with pytest.raises(SssfitError, match="at most 1e\\+07 texels"):
        PAIR.pass_weights(1e-12)


def test_light_near_the_largest_number_is_summed_or_refused():
    """Mirrored pixels are added first, and 3e38 twice is infinite in float32; a disk has none."""
    near = 3.0e38 * LIGHT
    assert np.isfinite(sssfit.render(1e-2 * near, KERNEL, dtype=np.float32)).all()
    assert np.isfinite(sssfit.render(near, TAPS, dtype=np.float32)).all()
    with pytest.raises(SssfitError, match=r"are above .* of float32; render it as float64"):
        sssfit.render(near, KERNEL, dtype=np.float32)


@pytest.mark.parametrize("border", ["mirror", "zero"])
def test_sums_of_the_true_picture_are_finite_or_refused(border):
    """Its transforms add up all pixels."""
    bright = dataclasses.replace(SCENE, irradiance=np.full((4, 4, 1), 1e308))
    with pytest.raises(RenderError, match=r"are above .* of float64; scale it down"):
        render_reference(bright, PROFILE, border=border)
    bright = dataclasses.replace(SCENE, irradiance=np.full((4, 4, 1), 1e300))
    assert np.isfinite(render_reference(bright, PROFILE, border=border)).all()


@pytest.mark.parametrize("seed", [1.5, -1, "1", True])
def test_seeds_of_fits(seed):
    with pytest.raises(FitError, match="seed = "):
        sssfit.fit(PROFILE, "cascade", stages="1-1", mm_per_pixel=0.5, seed=seed)


def test_numbers_under_a_mask_are_not_used():
    hidden = np.ma.masked_array(PROFILE.annulus_energy, PROFILE.annulus_energy > 0.01)
    with pytest.raises(ProfileError, match=r"^annulus_energy is a masked array; fill it first"):
        dataclasses.replace(PROFILE, annulus_energy=hidden)
    with pytest.raises(RenderError, match=r"^truth is a masked array; fill it first"):
        auto_exposure(np.ma.masked_array(LIGHT, LIGHT > 0.5))
    shown = np.ma.masked_array(PROFILE.annulus_energy)
    assert dataclasses.replace(PROFILE, annulus_energy=shown).sha256 == PROFILE.sha256


@pytest.mark.parametrize(
    ("call", "given"),
    [
        (lut_bytes, {"sources": [PROFILE], "ending": "a\nb"}),
        (compute_guide, {"profile": PROFILE, "channel": "a\nb", "mm_per_pixel": 1.0}),
        (fit_artist, {"profile": PROFILE, "target": "a\nb"}),
        (view_kernel, {"kernel": KERNEL, "channels": ["a\nb"]}),
    ],
)
def test_a_name_on_two_lines_is_told_on_one(call, given):
    assert refused(call, **given)
