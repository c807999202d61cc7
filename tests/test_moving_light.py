"""Sequences under light that changes: what control variates save, beside other renderers."""

import dataclasses
import errno
import json
import math
import os

import numpy as np
import pytest

from sssfit.errors import ArgumentError, FileError, RenderError
from sssfit.formats.pictures import load_image, save_image
from sssfit.methods import LIGHTS, RENDERERS
from sssfit.motion.curve import SampleCurves, sample_curves
from sssfit.motion.files import FrameFiles
from sssfit.motion.record import cold_frames
from sssfit.motion.run import make_frames, moving_light
from sssfit.motion.runner import run_sequence
from sssfit.render.adaptive import make_sampler, render_samples
from sssfit.render.reference import render_reference
from sssfit.scene.load import load_scenes
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole, simulate_exact

PITCH = 0.3
# Of CI; 512 x 512 x 100 run under ``slow``. In the first 20 frames histories are still beginning.
SIDE, LENGTH = 48, 40
SAMPLERS = ("without", "variates", "ahead")


@pytest.fixture(scope="module")
def skin1():
    import sssfit

    return simulate_dipole(sssfit.load_material("skin1"))


@pytest.fixture(scope="module")
def scenes():
    found = load_scenes(["head", "edge"], PITCH, size=(SIDE, SIDE))
    return dict(zip(("head", "edge"), found, strict=True))


@pytest.fixture(scope="module")
def runs(skin1, scenes):
    """Adaptive samplers: on the head under every light, on the edge under two."""
    asked = [("head", light) for light in LIGHTS] + [("edge", "still"), ("edge", "strobe")]
    return {
        (name, light): moving_light(skin1, scenes[name], light=light, length=LENGTH, ways=SAMPLERS)
        for name, light in asked
    }


# Lights


def test_lights_never_go_below_zero_and_change():
    for name, method in LIGHTS.items():
        values = np.array([method.load()(k) for k in range(200)])
        assert (values > 0.0).all()
        assert (values.std() > 0.1) == (name != "still")


def test_the_lights_are_what_their_summaries_say():
    strobe, sinusoidal, gunshot = (
        LIGHTS[each].load() for each in ("strobe", "sinusoidal", "gunshot")
    )
    assert [strobe(k) for k in range(9)] == [1.0] * 4 + [0.05] * 4 + [1.0]
    assert max(sinusoidal(k) for k in range(100)) == pytest.approx(1.9, abs=0.01)
    assert sinusoidal(30) == pytest.approx(1.0 + 0.9 * math.sin(3.0))
    flashes = [k for k in range(1, 80) if gunshot(k) > gunshot(k - 1)]
    assert flashes == [5, 11, 17, 45, 51, 57]


# What control variates are for


@pytest.mark.parametrize("scene", ["head", "edge"])
def test_still_light_takes_the_same_samples(runs, scene):
    """The supplement's criterion: variates must not starve what stands still; within 5 %."""
    found = runs[scene, "still"]
    for name in ("variates", "ahead"):
        assert abs(found.saving(name)) < 0.05
        np.testing.assert_array_equal(found.track(name).mse, found.track("without").mse)


@pytest.mark.parametrize("scene", ["head", "edge"])
def test_strobe_light_takes_40_percent_fewer_at_the_same_target(runs, scene):
    for name in ("variates", "ahead"):
        assert runs[scene, "strobe"].saving(name) > 0.4


@pytest.mark.parametrize("light", ["sinusoidal", "gunshot"])
def test_other_lights_take_fewer_too(runs, light):
    for name in ("variates", "ahead"):
        assert runs["head", light].saving(name) > 0.2


@pytest.fixture(scope="module")
def curves(skin1, scenes):
    targets = (3e-4, 1.2e-3, 4.8e-3)
    return sample_curves(skin1, scenes["head"], length=40, targets=targets)


def test_strobe_light_takes_25_percent_fewer_at_the_same_error(curves):
    """Where the sampler without variates is not at 64 samples everywhere."""
    errors, saved = curves.savings("ahead")
    assert errors.size == 25
    assert saved.min() > 0.25
    errors, saved = curves.savings("variates")
    assert saved[errors > 1.3 * errors[0]].min() > 0.25


def test_the_error_falls_as_the_root_of_fixed_samples(skin1, scenes):
    sampler, scene = make_sampler(skin1, PITCH), scenes["edge"]
    truth = render_reference(scene, skin1)
    errors = [
        np.mean(
            [np.square(render_samples(scene, sampler, n, frame=k) - truth).mean() for k in range(8)]
        )
        for n in (4, 16)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_curves_are_read_between_their_targets():
    curve = SampleCurves(
        scene="s",
        light="strobe",
        targets=np.array([1e-3, 4e-3]),
        samples={"without": np.array([40.0, 10.0]), "variates": np.array([20.0, 5.0])},
        rmse={"without": np.array([0.1, 0.2]), "variates": np.array([0.1, 0.2])},
        fixed_rmse=0.4,
    )
    middle = math.sqrt(0.1 * 0.2)
    assert curve.samples_at("without", np.array([middle]))[0] == pytest.approx(20.0)
    assert np.isnan(curve.samples_at("without", np.array([0.3]))[0])
    assert curve.samples_at("fixed", np.array([0.1]))[0] == pytest.approx(16.0)
    np.testing.assert_allclose(curve.savings("variates")[1], 0.5)
    np.testing.assert_allclose(curve.savings("variates", "fixed")[1][[0, -1]], [-0.25, -0.25])
    apart = dataclasses.replace(curve, rmse={**curve.rmse, "variates": np.array([0.5, 0.6])})
    assert apart.savings("variates")[0].size == 0
    assert json.loads(json.dumps(curve.to_dict()))["variates"]["samples"] == [20.0, 5.0]
    assert "0.004" in curve.text()


# The record


def test_every_renderer_runs_at_the_fetches_of_the_sampler(skin1, scenes):
    """In the registry's order; a cascade takes seconds to fit, hence so few fetches."""
    found = moving_light(skin1, scenes["edge"], length=8, target_variance=0.05)
    assert [each.name for each in found.tracks] == list(RENDERERS)
    fetches = {each.name: each.mean_fetches for each in found.tracks}
    assert fetches["fixed"] == max(round(fetches["variates"]), 1)
    assert fetches["separable"] == 6.0
    assert fetches["cascade"] == 7.0
    assert found.track("cascade").rmse < found.track("separable").rmse < found.track("fixed").rmse
    assert found.track("cascade").variance is None
    assert found.track("ahead").counts.shape == (SIDE, SIDE)
    told = json.loads(json.dumps(found.to_dict()))
    assert [each["name"] for each in told["tracks"]] == list(RENDERERS)
    assert len(told["intensity"]) == told["frames"] == 8
    text = found.text()
    assert text.count("fewer samples than without control variates") == 2
    assert all(each.summary in text for each in RENDERERS.values())


def test_means_leave_the_first_frames_out(runs):
    found = runs["edge", "strobe"]
    assert (cold_frames(40), cold_frames(100), cold_frames(2)) == (20, 25, 1)
    track = found.track("variates")
    assert track.mean_fetches == pytest.approx(track.fetches[20:].mean())
    assert track.rmse == pytest.approx(math.sqrt(track.mse[20:].mean()))


def test_errors_are_those_against_the_true_kernel(skin1, scenes):
    seen = {}
    found = moving_light(
        skin1,
        scenes["head"],
        light="sinusoidal",
        length=4,
        ways=["separable"],
        watch=lambda name, k, picture: seen.__setitem__((name, k), picture),
    )
    assert [each.name for each in found.tracks] == ["variates", "separable"]
    truth = render_reference(scenes["head"], skin1)
    for track in found.tracks:
        for k, h in enumerate(found.intensity):
            error = np.square(seen[track.name, k] - h * truth).mean()
            assert track.mse[k] == pytest.approx(error, rel=1e-12)
    assert found.level == pytest.approx(
        math.sqrt(np.mean(np.square(found.intensity[2:])) * np.square(truth).mean())
    )


def test_a_picture_that_moves_is_rendered_where_it_is(skin1, scenes):
    frames = make_frames(skin1, scenes["edge"], light="sinusoidal", length=3, shift=(2, -3))
    moved = np.roll(scenes["edge"].irradiance, (4, -6), axis=(0, 1))
    now = dataclasses.replace(scenes["edge"], irradiance=frames.intensity[2] * moved)
    np.testing.assert_array_equal(frames.at(2).irradiance, now.irradiance)
    np.testing.assert_array_equal(frames.truths()(2), render_reference(now, skin1))
    found = moving_light(skin1, scenes["edge"], length=3, shift=(2, -3), ways=["separable"])
    assert found.shift == (2, -3)
    still = moving_light(skin1, scenes["edge"], length=3, ways=["separable"])
    assert found.track("separable").mse[0] == pytest.approx(still.track("separable").mse[0])
    assert found.track("separable").mse[2] != still.track("separable").mse[2]


def test_black_scenes_have_no_error_and_no_share(skin1):
    dark = Scene("dark", np.zeros((8, 8, 1)), PITCH)
    found = moving_light(skin1, dark, length=6, ways=["fixed", "without"])
    assert {each.rmse for each in found.tracks} == {0.0}
    assert found.relative(found.tracks[0]) is None
    assert "-" in found.text()


def test_results_do_not_depend_on_threads(skin1, scenes):
    small = scenes["edge"].corner(16)
    one, two = (
        moving_light(skin1, small, length=8, threads=n, ways=SAMPLERS).to_dict() for n in (1, 2)
    )
    assert one == two


def test_progress_counts_the_frames_of_all_renderers(skin1, scenes):
    told = []
    moving_light(
        skin1,
        scenes["edge"].corner(8),
        length=3,
        ways=["without"],
        progress=lambda *step: told.append(step),
    )
    assert [each[:2] for each in told] == [(k, 6) for k in range(1, 7)]
    assert told[0][2] == "adaptive, no control variates"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"light": "strob"}, "light 'strob': did you mean strobe? expected one of still, "),
        ({"length": 1}, "length = 1; expected 2 to 100000 frames."),
        ({"length": 2.5}, "length = 2.5; expected"),
        ({"length": True}, "length = True; expected"),
        ({"ways": ["cascad"]}, "renderer 'cascad': did you mean cascade? expected some of "),
        ({"shift": (1, 0.5)}, "shift = (1, 0.5); expected two whole numbers of pixels."),
        ({"shift": 3}, "shift = 3; expected two whole numbers of pixels."),
    ],
)
def test_bad_settings_get_one_line(skin1, scenes, given, words):
    with pytest.raises(ArgumentError) as caught:
        moving_light(skin1, scenes["edge"], **given)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bad_targets_get_one_line(skin1, scenes):
    with pytest.raises(RenderError, match=r"target_variance = 0; expected a number above 0"):
        moving_light(skin1, scenes["edge"], target_variance=0)
    with pytest.raises(ArgumentError, match="expected two different ones"):
        sample_curves(skin1, scenes["edge"], targets=[1e-3, 1e-3])


# Files of frames


def test_frames_are_numbered_and_share_an_exposure(skin1, scenes, tmp_path):
    frames = make_frames(skin1, scenes["edge"], light="strobe", length=6)
    for form in ("png", "exr"):
        files = FrameFiles(tmp_path / form, "variates", frames, form=form)
        pictures = []

        def watch(name, k, picture, files=files, pictures=pictures):
            files.write(name, k, picture)
            if name == "variates":
                pictures.append(picture)

        with files.held():
            moving_light(skin1, scenes["edge"], length=6, ways=["without"], watch=watch)
        assert [each.name for each in files.paths] == [f"frame-{k:04}.{form}" for k in range(6)]
        assert sorted((tmp_path / form).iterdir()) == files.paths
        read = [load_image(each).pixels for each in files.paths]
        if form == "exr":
            np.testing.assert_allclose(read, pictures, rtol=1e-6)
            assert load_image(files.paths[0]).mm_per_pixel == PITCH
        else:
            lit, dark = (read[k].mean() for k in (0, 5))
            assert dark == pytest.approx(0.05 * lit, rel=0.2)
            assert 0.7 < np.percentile(read[0].max(axis=-1), 99.0) <= 1.0


def test_frames_do_not_replace_foreign_files(skin1, scenes, tmp_path):
    frames = make_frames(skin1, scenes["edge"], length=3)
    (tmp_path / "frame-0002.png").write_bytes(b"mine")

    def write(folder, **how):
        files = FrameFiles(folder, "variates", frames, **how)
        with files.held():
            for k in frames:
                files.write("variates", k, np.full((4, 4, 3), 0.5))

    with pytest.raises(FileError, match=r"frame-0002\.png exists and was not written by sssfit"):
        write(tmp_path)
    assert (tmp_path / "frame-0002.png").read_bytes() == b"mine"
    write(tmp_path, force=True)
    assert load_image(tmp_path / "frame-0002.png").pixels.shape == (4, 4, 3)
    with pytest.raises(FileError, match="the folder cannot be made"):
        write(tmp_path / "no" / "folder")
    with pytest.raises(FileError, match="the folder cannot be made"):
        write(tmp_path / "frame-0002.png")


def test_frames_of_a_longer_sequence_are_removed(skin1, scenes, tmp_path):
    """Up to the first that is not ours, and not where the new ones do not come."""

    def write(length, stops=False):
        frames = make_frames(skin1, scenes["edge"], length=length)
        files = FrameFiles(tmp_path, "variates", frames)
        with files.held():
            for k in frames:
                files.write("variates", k, np.full((4, 4, 3), 0.5))
            if stops:
                raise KeyboardInterrupt

    def numbers():
        return [int(each.stem[-4:]) for each in sorted(tmp_path.glob("frame-*.png"))]

    write(7)
    (tmp_path / "frame-0005.png").write_bytes(b"mine")
    with pytest.raises(KeyboardInterrupt):
        write(3, stops=True)
    assert numbers() == [0, 1, 2, 3, 4, 5, 6]
    write(3)
    assert numbers() == [0, 1, 2, 5, 6]


def test_frames_in_the_other_format_stay_and_are_told_of(skin1, scenes, tmp_path, caplog):
    frames = make_frames(skin1, scenes["edge"], length=2)
    for form in ("exr", "png"):
        files = FrameFiles(tmp_path, "variates", frames, form=form)
        with caplog.at_level("INFO", logger="sssfit"), files.held():
            for k in frames:
                files.write("variates", k, np.full((4, 4, 3), 0.5))
    assert caplog.messages == [
        f"{tmp_path / 'frame-0000.exr'} and what follows it stay, of an earlier run; delete them "
        "unless they are of the same sequence."
    ]
    assert len([*tmp_path.iterdir()]) == 4


@pytest.mark.parametrize("name", ["", "-"])
def test_frames_go_into_a_folder_with_a_name(skin1, name):
    with pytest.raises(ArgumentError, match=f"`frames` is '{name}'; expected the name of a folder"):
        run_sequence(skin1, "dot", frames=name)


def test_a_full_disk_is_told_by_the_name_of_the_frame(skin1, scenes, tmp_path, monkeypatch):
    def full(_handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    files = FrameFiles(tmp_path / "new", "variates", make_frames(skin1, scenes["edge"], length=2))
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError) as caught, files.held():
        files.write("variates", 1, np.zeros((4, 4, 3)))
    path = tmp_path / "new" / "frame-0001.png"
    assert str(caught.value) == f"{path} cannot be written: no space left on device."
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("stops", [KeyboardInterrupt, FileError])
def test_frames_come_all_or_none(skin1, scenes, tmp_path, stops):
    frames = make_frames(skin1, scenes["edge"], length=3)
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    save_image(old / "frame-0001.png", np.full((4, 4, 3), 0.5))
    before = (old / "frame-0001.png").read_bytes()

    def stopped(folder):
        files = FrameFiles(folder, "variates", frames)
        with files.held():
            for k in range(2):
                files.write("variates", k, np.zeros((4, 4, 3)))
            raise stops

    for folder in (old, new):
        with pytest.raises(stops):
            stopped(folder)
    assert [each.name for each in old.iterdir()] == ["frame-0001.png"]
    assert (old / "frame-0001.png").read_bytes() == before
    assert not new.exists()


def test_two_runs_do_not_write_the_same_frames(skin1, scenes, tmp_path):
    frames = make_frames(skin1, scenes["edge"], length=3)
    one, two = (FrameFiles(tmp_path, "variates", frames, form="exr") for _ in range(2))
    with (
        pytest.raises(FileError, match=r"frame-0000\.exr is being written by another run"),
        one.held(),
        two.held(),
    ):
        pass


def test_a_png_holds_one_or_three_channels(tmp_path):
    import sssfit

    material = sssfit.load_material("skin1")
    two = dataclasses.replace(
        material,
        channels=("far", "near"),
        layers=tuple(
            dataclasses.replace(
                each, sigma_a_per_mm=[0.1, 0.2], sigma_s_per_mm=[1.0, 2.0], g=[0.0, 0.0]
            )
            for each in material.layers
        ),
    )
    profile = simulate_dipole(two)
    frames = make_frames(profile, Scene("dot", np.ones((4, 4, 1)), PITCH), length=2)
    with pytest.raises(RenderError, match=r"and the material has 2 channels; write EXR"):
        FrameFiles(tmp_path / "png", "variates", frames)
    files = FrameFiles(tmp_path / "exr", "variates", frames, form="exr")
    with files.held():
        for k in frames:
            files.write("variates", k, np.ones((4, 4, 2)))
    assert load_image(files.paths[1]).channels == ("far", "near")


# Full size


@pytest.mark.slow
@pytest.mark.parametrize("name", ["head", "edge"])
def test_the_promises_at_full_size(name):
    """512 x 512: 40 % at equal target, 5 % where nothing moves, 25 % at equal error."""
    import sssfit

    profile = simulate_exact(sssfit.load_material("skin1"))
    (scene,) = load_scenes([name], PITCH)
    strobe = moving_light(profile, scene, ways=SAMPLERS)
    still = moving_light(profile, scene, light="still", ways=SAMPLERS)
    targets = (6e-4, 2.4e-3, 9.6e-3)
    curve = sample_curves(profile, scene, targets=targets, length=60)
    for way in ("variates", "ahead"):
        assert strobe.saving(way) > 0.4
        assert abs(still.saving(way)) < 0.05
        assert np.median(curve.savings(way)[1]) > 0.25
    assert curve.savings("ahead")[1].min() > 0.25
