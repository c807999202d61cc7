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
from sssfit.errors import FitError, SssfitError
from sssfit.fit import fit_preintegrated
from sssfit.fit.disk import fit_disk
from sssfit.formats.pictures import Image
from sssfit.grid import RadialGrid
from sssfit.kernel import Taps
from sssfit.kernel.taps import Stage
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render.jitter import Jitter
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.mesh import Mesh
from sssfit.simulate import read_checkpoint
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


@pytest.mark.parametrize("seed", [1.5, -1, "1", True])
def test_seeds_of_fits(seed):
    with pytest.raises(FitError, match="seed = "):
        sssfit.fit(PROFILE, "cascade", stages="1-1", mm_per_pixel=0.5, seed=seed)
