"""The default size of a pixel: that of a head 0.6 m away, everywhere; or the profile's own."""

import numpy as np
import pytest
from reference_pixels import one_over_r_profile

from sssfit.choose.choice import mm_per_pixel_at
from sssfit.compare import compute_guide, compute_spectrum, pictures
from sssfit.compare.sheet import compute_sheet
from sssfit.errors import FitError
from sssfit.fit import METHODS, MM_PER_PIXEL, make_target, pitch_of
from sssfit.scene.head import FACE_HEIGHT_MM
from sssfit.scene.made import make_scene

DR_MM = 0.25
PROFILE = one_over_r_profile(40, DR_MM, [0.5, 0.3, 0.1])


def test_it_is_that_of_a_head_in_a_common_view():
    assert mm_per_pixel_at(600.0, 30.0, 1080) == pytest.approx(MM_PER_PIXEL, rel=0.01)


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("method", METHODS)
def test_every_fit_takes_it(method):
    fit = METHODS[method].fit
    for given, expected in ({}, MM_PER_PIXEL), ({"mm_per_pixel": "profile"}, DR_MM):
        assert fit(PROFILE, support_mm=3.0, **given).kernel.mm_per_pixel == expected


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize("view", [make_target, compute_spectrum, compute_guide])
def test_every_view_of_a_kernel_takes_it(view):
    assert view(PROFILE).mm_per_pixel == MM_PER_PIXEL
    assert view(PROFILE, mm_per_pixel="profile").mm_per_pixel == DR_MM


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
def test_sheets_take_it(monkeypatch):
    monkeypatch.setattr(pictures, "PIXELS", 13)  # of those that the artist's kernel is fitted to
    small = {"pixels": 16, "scenes": ["disk"], "most_terms": 1}
    assert compute_sheet(PROFILE, **small).mm_per_pixel == MM_PER_PIXEL
    assert compute_sheet(PROFILE, mm_per_pixel="profile", **small).mm_per_pixel == DR_MM


def test_another_word_is_refused():
    with pytest.raises(FitError, match="mm_per_pixel = 'own'; expected a length in mm, or 'profi"):
        pitch_of(PROFILE, "own")


def test_a_picture_of_the_face_on_it_holds_the_whole_face():
    rows = int(np.ceil(FACE_HEIGHT_MM / MM_PER_PIXEL))
    # A tenth of the rows and columns, ten times as wide: the same part of the head.
    size = round(rows / 10)
    head = make_scene("head", height=size, width=size, mm_per_pixel=10.0 * MM_PER_PIXEL)
    assert head.mask is not None
    assert (head.mask[:, [0, -1]] == 0).all(), "background left and right of the cheeks"
    assert (head.mask == 2).any(), "the eyes"
