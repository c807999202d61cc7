"""Pictures by name or file: their pixels, sizes and notes."""

import numpy as np
import pytest

from sssfit.errors import RenderError
from sssfit.formats.pictures import save_image
from sssfit.scene.head import FACE_HEIGHT_MM
from sssfit.scene.load import load_scene, load_scenes
from sssfit.scene.made import COMPARED, EDGE_DEGREES, make_scene

LIGHT = np.linspace(0.0, 1.0, 60).reshape(5, 12, 1)


@pytest.fixture
def notes(caplog):
    """What is noted, in a logger that Python shows only when it is asked to."""
    caplog.set_level("INFO", "sssfit")
    return caplog


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A picture whose header says 2 mm, and one that does not say."""
    monkeypatch.chdir(tmp_path)
    save_image("told.exr", LIGHT, mm_per_pixel=2.0)
    save_image("bare.exr", LIGHT)


def test_a_made_picture_has_the_pixels_and_options_that_were_asked_for(notes):
    scene = load_scene("edge", 0.5, size=(20, 30), angle_degrees=12.0)
    wanted = make_scene("edge", height=20, width=30, mm_per_pixel=0.5, angle_degrees=12.0)
    np.testing.assert_array_equal(scene.irradiance, wanted.irradiance)
    assert (scene.mm_per_pixel, notes.messages) == (0.5, [])
    assert load_scene("disk", otherwise=0.5).irradiance.shape == (512, 512, 1)


def test_a_random_picture_has_the_seed():
    one, two, other = (
        load_scene("noise", 0.5, size=(16, 16), seed=seed).irradiance for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(one, two)
    assert (one != other).any()


def test_the_head_has_as_many_rows_as_the_face_takes(notes):
    scene = load_scene("head", 4.0)
    assert scene.height == scene.width == np.ceil(FACE_HEIGHT_MM / 4.0)
    assert notes.messages == []


def test_a_head_that_is_cut_says_so(monkeypatch, notes):
    monkeypatch.setattr("sssfit.scene.load._MOST_ROWS", 50)
    scene, (note,) = load_scene("head", 4.0), notes.messages
    assert scene.height == 50
    assert f"{int(np.ceil(FACE_HEIGHT_MM / 4.0))} rows of 4 mm; 50 show its middle" in note


@pytest.mark.usefixtures("files")
def test_the_pixels_of_a_file_are_those_given_else_its_own_else_the_default():
    assert load_scene("told.exr", 3.0, otherwise=1.0).mm_per_pixel == 3.0
    assert load_scene("told.exr", otherwise=1.0).mm_per_pixel == 2.0
    assert load_scene("bare.exr", otherwise=1.0).mm_per_pixel == 1.0
    with pytest.raises(RenderError, match=r"bare\.exr does not say.*give `mm_per_pixel`"):
        load_scene("bare.exr")
    with pytest.raises(RenderError, match="give `mm_per_pixel`"):
        load_scene("disk")


@pytest.mark.usefixtures("files")
def test_made_pictures_have_the_pixels_of_the_first_file():
    scenes = load_scenes(["disk", "told.exr", "edge"], otherwise=0.3, size=(16, 24))
    assert [each.mm_per_pixel for each in scenes] == [2.0, 2.0, 2.0]
    assert [each.irradiance.shape[:2] for each in scenes] == [(16, 24), (5, 12), (16, 24)]
    scenes = load_scenes(["disk", "bare.exr"], 0.7, otherwise=0.3, size=(16, 24))
    assert [each.mm_per_pixel for each in scenes] == [0.7, 0.7]


def test_pictures_to_compare_on_are_oblique_where_an_axis_helps_a_kernel(notes):
    scenes = load_scenes(COMPARED, 2.0, size=(32, 32))
    assert [each.name for each in scenes] == list(COMPARED)
    tilted = make_scene("edge", height=32, width=32, mm_per_pixel=2.0, angle_degrees=EDGE_DEGREES)
    np.testing.assert_array_equal(scenes[1].irradiance, tilted.irradiance)
    assert notes.messages == []
