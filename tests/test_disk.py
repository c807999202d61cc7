"""Fetches on a disk: the table, its pictures, and what frames make of them."""

import io
import json
import math
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from reference_taps import disk_fetches, fetch, rendered_disk, turn_of

import sssfit
from sssfit.errors import FitError, KernelError, RenderError
from sssfit.fit.disk import fit_disk
from sssfit.kernel import Stage, Taps
from sssfit.kernel.structure import Cost
from sssfit.render.disk import averaged, turns
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import reach_pixels, render_taps, response
from sssfit.render.texture import render_texture
from sssfit.render.texture_blur import blur_texture
from sssfit.render.texture_level import Level
from sssfit.scene.camera import Camera
from sssfit.scene.made import make_scene
from sssfit.scene.mesh import Mesh
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole

SCHEMA = json.loads((Path(sssfit.__file__).parent / "taps.schema.json").read_text("utf-8"))
PITCH = 0.3


@pytest.fixture(scope="module")
def skin1():
    return simulate_dipole(sssfit.load_material("skin1"))


def disk_of(count=7, channels=2, middle=0.0, **changes):
    """A table of random radii and weights."""
    rng = np.random.default_rng(count)
    weights = rng.uniform(0.1, 1.0, (count + 1, channels))
    weights[0] = middle
    weights[1:] *= (1.0 - middle) / weights[1:].sum(axis=0)
    radii = np.cumsum(rng.uniform(0.05, 1.0, count)) * PITCH
    blend = np.stack((np.zeros(channels), rng.uniform(0.2, 0.9, channels)))
    fields = {
        "method": "disk",
        "mm_per_pixel": PITCH,
        "channels": tuple(f"c{k}" for k in range(channels)),
        "chained": False,
        "stages": (Stage(0, "disk", radii, weights),),
        "blend": blend,
        "errors": {"spectral": np.full(channels, np.nan), "energy": np.zeros(channels)},
        "meta": {"material": "wax"},
    }
    return Taps(**(fields | changes))


def bytes_of(taps):
    stream = io.BytesIO()
    taps.write(stream)
    return stream.getvalue()


# The record and its file


@pytest.mark.parametrize("count", [1, 64, 65, 256])
def test_the_file_of_a_disk_comes_back_bit_for_bit(count):
    taps = disk_of(count, channels=3)
    whole = json.loads(bytes_of(taps))
    jsonschema.validate(whole, SCHEMA)
    assert whole["structure"] == f"{count} rings"
    assert (whole["fetches"], whole["passes"], whole["all_passes"]) == (count, 1, 1)
    back = Taps.read(io.BytesIO(bytes_of(taps)))
    assert bytes_of(back) == bytes_of(taps)
    assert back.is_disk
    assert not back.is_separable


def test_a_disk_costs_its_fetches_in_one_pass():
    assert disk_of(24).cost == Cost(24.0, 1, 1, 2.0)
    assert disk_of(24, middle=0.2).cost == Cost(25.0, 1, 1, 2.0)
    shown = disk_of(24, blend=[[0.1, 0.1], [0.2, 0.3]])
    assert shown.cost == Cost(25.0, 1, 1, 2.0)


def test_a_disk_varies_as_all_of_its_turns_do():
    """The mean of (r cos a)^2 over a turn is r^2 / 2."""
    (stage,) = disk_of(5, middle=0.3).stages
    angles = np.arange(360) * math.tau / 360
    along = np.square(np.outer(stage.offsets_mm, np.cos(angles))).mean(axis=1)
    np.testing.assert_allclose(stage.variance_mm2, along @ stage.weights[1:], rtol=1e-12)


def test_a_disk_stands_alone():
    (stage,) = disk_of().stages
    blend = np.full((3, 2), 0.2)
    for changes in (
        {"chained": True},
        {"stages": (stage, stage), "blend": blend},
        {"stages": (stage, Stage(0, "pair", [0.3], [[0.5, 0.5], [0.25, 0.25]])), "blend": blend},
    ):
        with pytest.raises(KernelError, match=r"^a disk is the only stage"):
            disk_of(**changes)
    with pytest.raises(KernelError, match="have the level 0"):
        disk_of(stages=(Stage(1, "disk", stage.offsets_mm, stage.weights),))
    with pytest.raises(KernelError, match="or is a disk"):
        disk_of().separable_kernel()


EDITS = {
    "offsets_mm": ([0.5, 0.4], "expected rising ones"),
    "weights": ([[0, 0], [0.5, 0.5], [0.4, 0.5]], "add up to [0.9, 1.0]"),
    "kind": ("round", "expected pair or star or disk"),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_disk_is_one_line(name):
    value, expected = EDITS[name]
    whole = json.loads(bytes_of(disk_of(2)))
    whole["stages"][0][name] = value
    with pytest.raises(KernelError) as caught:
        Taps.read(io.BytesIO(json.dumps(whole).encode()), "mine.taps.json")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_too_many_radii_are_refused():
    with pytest.raises(KernelError, match="expected 1 to 256 offsets"):
        disk_of(257)


# Rendering


def test_turns_are_the_hash_of_pixel_and_frame():
    for frame in (0, 1, 7, 2**33 + 5):
        ours = turns(5, 300, frame)
        for row, column in ((0, 0), (4, 299), (2, 17), (3, 256)):
            assert ours[row, column] == turn_of(column, row, frame)


def test_turns_fill_the_circle_without_pattern():
    words = turns(256, 256, 0) / math.tau - 0.5  # uniform: variance 1/12, of squares 1/180
    error = 1.0 / math.sqrt(words.size)
    assert abs(words.mean()) < 5.0 * error * math.sqrt(1.0 / 12.0)
    assert abs(np.square(words).mean() - 1.0 / 12.0) < 5.0 * error * math.sqrt(1.0 / 180.0)
    for one, other in ((words[:-1], words[1:]), (words[:, :-1], words[:, 1:])):
        assert abs((one * other).mean()) < 5.0 * error / 12.0


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize("middle", [0.0, 0.2])
def test_a_picture_is_that_of_single_fetches(border, middle):
    taps = disk_of(7, middle=middle)
    picture = np.random.default_rng(3).uniform(size=(9, 7))
    for frame in (0, 3):
        scene = Scene("noise", picture[..., None], 0.25)
        ours = render_taps(scene, taps, border=border, frame=frame)
        for channel in (0, 1):
            slow = rendered_disk(picture, taps, channel, 0.25, border, frame=frame)
            np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-12)


def test_coverage_divides_the_pass():
    taps = disk_of(9)
    rng = np.random.default_rng(4)
    picture = rng.uniform(size=(8, 9))
    cover = (rng.uniform(size=(8, 9)) > 0.4) * rng.choice([0.5, 1.0], (8, 9))
    scene = Scene("noise", np.stack((picture, picture), axis=-1), PITCH)
    ours = render_taps(scene, taps, coverage=cover, frame=2)
    for channel in (0, 1):
        slow = rendered_disk(picture, taps, channel, PITCH, cover=cover, frame=2)
        np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-12)


def test_constant_light_stays_constant_and_nothing_comes_in():
    taps = disk_of(12)
    out = render_taps(Scene("grey", np.full((20, 30, 1), 2.0), PITCH), taps, frame=5)
    np.testing.assert_allclose(out, 2.0 * np.broadcast_to(taps.energy, out.shape), rtol=1e-12)
    cover = (np.random.default_rng(5).uniform(size=(20, 30)) > 0.6).astype(float)
    picture = np.where(cover > 0, 2.0, 1e6)[..., None]
    out = render_taps(Scene("shape", picture, PITCH), taps, coverage=cover)
    inside = out[cover > 0]
    np.testing.assert_allclose(inside, 2.0 * np.broadcast_to(taps.energy, inside.shape), rtol=1e-6)
    assert (out[cover == 0] == 0.0).all()


def test_the_bits_do_not_depend_on_threads():
    taps, picture = disk_of(8), np.random.default_rng(6).uniform(size=(70, 31, 2))
    scene = Scene("noise", picture, PITCH)
    one = render_taps(scene, taps, threads=1)
    for threads in (2, 3):
        assert render_taps(scene, taps, threads=threads).tobytes() == one.tobytes()
    single = render_taps(scene, taps, dtype=np.float32)
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, one, rtol=0, atol=1e-6)


def test_many_frames_come_near_the_kernel_of_all_turns():
    """By quadrature over 720 angles; frames that fill the circle evenly beat independent ones."""
    taps = disk_of(6, channels=1)
    picture = np.random.default_rng(7).uniform(size=(24, 24))
    scene = Scene("noise", picture[..., None], PITCH)
    count = 256
    frames = np.stack([render_taps(scene, taps, frame=k)[..., 0] for k in range(count)])
    error = frames.std(axis=0, ddof=1) / math.sqrt(count)
    places = [(12, 12), (0, 0), (3, 20), (23, 11), (8, 5), (17, 17), (20, 2), (10, 15)]
    off = [frames[:, r, c].mean() - of_all_turns(picture, taps, r, c) for r, c in places]
    errors = np.array([error[each] for each in places])
    assert (np.abs(off) < 5.0 * errors).all()
    assert np.sqrt(np.mean(np.square(off))) < np.sqrt(np.mean(errors**2))


def test_the_response_is_the_mean_over_all_turns():
    taps = disk_of(6, middle=0.2, blend=[[0.1, 0.2], [0.3, 0.4]])
    half = reach_pixels(taps)
    kernel = response(taps)
    np.testing.assert_allclose(kernel.sum(axis=(0, 1)), taps.energy, rtol=1e-12)
    picture = np.random.default_rng(8).uniform(size=(2 * half + 1, 2 * half + 1))
    slow = of_all_turns(picture, taps, half, half)
    assert (kernel[..., 0] * picture).sum() == pytest.approx(slow, rel=1e-4)


def of_all_turns(picture, taps, row, column, count=720):
    """The mean over turns of a pixel, fetch by fetch."""
    total = 0.0
    for turn in np.arange(count) * math.tau / count:
        for w, dy, dx in disk_fetches(taps.stages[0], 0, PITCH, turn):
            total += w * fetch(picture, row + dy, column + dx, "mirror")
    return taps.blend[0, 0] * picture[row, column] + taps.blend[1, 0] * total / count


def test_a_filter_over_time_starts_as_the_mean():
    frames = [np.full(1, float(k)) for k in range(5)]
    seen = [float(each[0]) for each in averaged(frames, 0.25)]
    assert seen[:4] == [0.0, 0.5, 1.0, 1.5]
    assert seen[4] == 1.5 + 0.25 * (4.0 - 1.5)
    for share in (0.0, 1.5, float("nan")):
        with pytest.raises(RenderError, match="expected a share above 0"):
            next(averaged(frames, share))


def test_a_disk_is_refused_where_surfaces_are_not_flat():
    flat, texture = np.ones((4, 5, 1)), Level.of_map(np.ones((4, 5)), np.ones((4, 5, 2)))
    head = make_scene("head", height=8, width=8, mm_per_pixel=20.0)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    mesh = Mesh("triangle", corners, corners[:, :2], [[0, 1, 2]])
    calls = [
        lambda taps: render_screen_taps(head, taps),
        lambda taps: blur_texture(flat, texture, taps),
        lambda taps: render_texture(mesh, [[0, 0, 0]], Camera(100.0, 4, 5, 30.0), [], taps),
    ]
    for call in calls:
        with pytest.raises(RenderError, match="a disk of fetches serves flat pictures only"):
            call(disk_of())


def test_bad_settings_of_a_picture_are_one_line():
    scene = Scene("grey", np.ones((4, 5, 1)), PITCH)
    for frame in (-1, 1.5, True, "a"):
        with pytest.raises(RenderError, match=r"^frame = .*expected a whole number from 0"):
            render_taps(scene, disk_of(), frame=frame)
    tiny = Scene("grey", np.ones((4, 5, 1)), 1e-9)
    with pytest.raises(RenderError, match="GB of memory"):
        render_taps(tiny, disk_of())
    assert reach_pixels(disk_of()) >= disk_of().stages[0].offsets_mm.max() / PITCH


# The fit


@pytest.mark.parametrize("count", [4, 17, 24, 256])
def test_each_ring_has_its_own_energy(skin1, count):
    taps = fit_disk(skin1, taps=count).kernel
    (stage,) = taps.stages
    np.testing.assert_allclose(taps.energy, skin1.diffuse_reflectance, rtol=1e-14)
    np.testing.assert_allclose(stage.weights.sum(axis=0), 1.0, rtol=1e-12)
    assert (stage.weights[0] == 0.0).all()
    assert taps.fetches == count
    # Red reaches farthest: its rings are equal, and each fetch halves its own.
    np.testing.assert_allclose(stage.weights[1:, 0], 1.0 / count, rtol=1e-6)
    within = skin1.cumulative_at(stage.offsets_mm)
    most = skin1.cumulative_at([PITCH * (reach_of(skin1) + 0.5)])[0]
    np.testing.assert_allclose(
        within[:, 0] / most[0], (np.arange(count) + 0.5) / count, rtol=0, atol=1e-5
    )
    # Every channel's fetch is within its ring: weights add up to F on both sides of each.
    inner = np.concatenate((np.zeros((1, 3)), np.cumsum(stage.weights[1:-1], axis=0)))
    assert (within / most >= inner - 1e-9).all()
    assert (within / most <= inner + stage.weights[1:] + 1e-9).all()


def reach_of(profile):
    """Pixels of the usual support: 99.9 % of every channel's energy."""
    cumulative = profile.cumulative
    kept = (cumulative >= 0.999 * cumulative[-1]).all(axis=1)
    return math.floor(profile.r_edges_mm[int(np.argmax(kept))] / PITCH + 1e-9)


def test_the_same_bits_every_time(skin1):
    assert bytes_of(fit_disk(skin1).kernel) == bytes_of(fit_disk(skin1).kernel)


@pytest.mark.parametrize("taps", [3, 257, 0, 7.5, True, "a"])
def test_a_number_out_of_range_is_one_line(skin1, taps):
    with pytest.raises(FitError, match=r"^taps = .*expected a whole number from 4 to 256\.$"):
        fit_disk(skin1, taps=taps)


def test_more_fetches_than_pixels_are_refused(skin1):
    with pytest.raises(FitError, match="taps = 50, but the support has 49 pixels"):
        fit_disk(skin1, taps=50, mm_per_pixel=PITCH, support_mm=3 * PITCH)


def test_the_door_of_all_fits_makes_a_disk(skin1):
    assert bytes_of(sssfit.fit(skin1, "disk", taps=9)) == bytes_of(fit_disk(skin1, taps=9).kernel)
    with pytest.raises(FitError, match="place = 'quadratic' is of separable kernels"):
        sssfit.fit(skin1, "disk", taps=9, place="quadratic")
