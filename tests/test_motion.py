"""How errors change under motion: positions drawn another way, whole pixels, the bound."""

import dataclasses

import numpy as np
import pytest
from test_taps import taps_of

from sssfit.compare.motion import NEAR_PIXELS, PIXELS, motion
from sssfit.errors import RenderError
from sssfit.fit import fit_taps
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.fixture(scope="module")
def cascade(skin1):
    return fit_taps(skin1, stages="1-1|2-2|2-2").kernel


def p99(image, truth):
    y, x = np.mgrid[:PIXELS, :PIXELS] - PIXELS // 2
    return measure(image, truth, mask=np.hypot(x, y) <= NEAR_PIXELS).delta_e_2000_p99


def drawn(down, right, fine=10):
    """A square of a pixel's size, drawn on pixels of a tenth and averaged."""
    light = np.zeros((PIXELS * fine, PIXELS * fine))
    top, left = (fine * (PIXELS // 2) + round(fine * each) for each in (down, right))
    light[top : top + fine, left : left + fine] = 1.0
    return light.reshape(PIXELS, fine, PIXELS, fine).mean(axis=(1, 3))


def test_points_and_edges_are_drawn_between_pixels(skin1, cascade):
    ours = motion(cascade, skin1, positions=2)
    errors = []
    for down, right in np.ndindex(2, 2):
        scene = Scene("point", drawn(down / 2, right / 2)[..., None], 0.3)
        errors.append(p99(render_taps(scene, cascade), render_reference(scene, skin1)))
    np.testing.assert_allclose(ours.point, (min(errors), max(errors)), rtol=1e-9)
    assert ours.point_change == ours.point[1] - ours.point[0] > 0.0
    assert ours.edge_change == ours.edge[1] - ours.edge[0] > 0.0
    # At half a pixel down and right the edge's light is where the half plane says.
    y, x = (np.mgrid[: PIXELS * 20, : PIXELS * 20] + 0.5) / 20 - PIXELS / 2
    errors = []
    for down, right in np.ndindex(2, 2):
        turn = np.radians(30.0)
        lit = (x - right / 2) * np.cos(turn) - (y - down / 2) * np.sin(turn) > 0.0
        edge = lit.reshape(PIXELS, 20, PIXELS, 20).mean(axis=(1, 3))
        scene = Scene("edge", edge[..., None], 0.3)
        errors.append(p99(render_taps(scene, cascade), render_reference(scene, skin1)))
    np.testing.assert_allclose(ours.edge, (min(errors), max(errors)), rtol=0.02)
    assert list(ours.to_dict()) == ["point", "point_change", "edge", "edge_change", "moved"]


def test_a_point_moved_by_a_pixel_and_back_is_within_what_is_asked(skin1, cascade):
    moved = motion(cascade, skin1, positions=1).moved
    assert 0.1 < moved < 0.85  # .80
    picture = [render_taps(Scene("p", drawn(*each)[..., None], 0.3), cascade)
               for each in ((0, 0), (1, 1))]  # fmt: skip
    assert moved >= p99(np.roll(picture[1], (-1, -1), (0, 1)), picture[0])


def test_without_halvings_whole_pixels_change_nothing(skin1):
    table = dataclasses.replace(taps_of("1-2", channels=3), channels=skin1.channels)
    assert motion(table, skin1, positions=1).moved < 1e-6


def test_bad_settings_are_one_line(skin1, cascade):
    with pytest.raises(RenderError, match="positions = 0; expected at least 1"):
        motion(cascade, skin1, positions=0)
    with pytest.raises(RenderError, match="the kernel's channels are not the profile's"):
        motion(taps_of("1"), skin1)
