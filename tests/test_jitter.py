"""Jittered taps: where each pixel's fetches lie, and that light is neither lost nor changed."""

import dataclasses
import math

import numpy as np
import pytest
from reference_taps import fetch, turn_of
from test_taps import PITCH, taps_of

from sssfit.errors import RenderError
from sssfit.render.jitter import Jitter
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

LIGHT = np.random.default_rng(3).random((12, 15, 1))


def rendered(taps, jitter, frame=0, light=LIGHT):
    return render_taps(Scene("light", light, PITCH), taps, jitter=jitter, frame=frame)


@pytest.mark.parametrize("structure", ["3", "1-2|2"])
@pytest.mark.parametrize("jitter", [Jitter(share=0.0), Jitter(1.0, 0.0, 0.0)])
def test_taps_that_do_not_move_make_the_usual_picture(structure, jitter):
    taps = taps_of(structure)
    usual = render_taps(Scene("light", LIGHT, PITCH), taps)
    np.testing.assert_allclose(rendered(taps, jitter), usual, rtol=0, atol=1e-12)


def test_each_pixel_moves_its_outer_taps_for_itself():
    """One line of three pairs, fetch by fetch: the outermost is turned and scaled by the pixel."""
    taps = taps_of("3", blend=[[0.0, 0.0], [1.0, 1.0]])
    line = dataclasses.replace(taps.stages[0], kind="line")
    taps, jitter = dataclasses.replace(taps, stages=(line,)), Jitter(0.3, 0.4, 50.0)
    ours = rendered(taps, jitter, frame=5)
    for y, x in np.ndindex(12, 15):
        angle = math.radians(50.0) * (turn_of(x, y, 5) / math.pi - 1.0)
        scale = 1.0 + 0.4 * (turn_of(x + 613, y + 977, 5) / math.pi - 1.0)
        total = line.weights[0, 0] * LIGHT[y, x, 0]
        for k, (offset, weights) in enumerate(zip(line.offsets_mm, line.weights[1:], strict=True)):
            r, a = (offset / PITCH, 0.0) if k < 2 else (scale * offset / PITCH, angle)
            for side in (-r, r):
                place = y + side * math.sin(a), x + side * math.cos(a)
                total += weights[0] * fetch(LIGHT[..., 0], *place, "mirror")
        assert ours[y, x, 0] == pytest.approx(total, abs=1e-12)


def test_constant_light_stays_and_frames_differ():
    taps, jitter = taps_of("3|2"), Jitter(1.0, 0.5, 90.0)
    constant = rendered(taps, jitter, light=np.ones((9, 8, 1)))
    np.testing.assert_allclose(constant, np.broadcast_to(taps.energy, (9, 8, 2)), rtol=1e-12)
    first, again, next_one = (rendered(taps, jitter, frame) for frame in (0, 0, 1))
    assert first.tobytes() == again.tobytes()
    assert np.abs(first - next_one).max() > 1e-3


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"share": 1.1}, "share = 1.1 of a jitter; expected 0 to 1"),
        ({"scale": 1.0}, "scale = 1 of a jitter; expected 0 to 1"),
        ({"degrees": -1.0}, "degrees = -1 of a jitter; expected 0 to 90"),
    ],
)
def test_bad_settings_are_one_line(settings, said):
    with pytest.raises(RenderError, match=said):
        Jitter(**settings)


def test_a_frame_is_a_whole_number():
    with pytest.raises(RenderError, match="frame = -1; expected a whole number"):
        rendered(taps_of("3"), Jitter(), frame=-1)
