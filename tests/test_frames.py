"""Error and noise over frames: of made noise, whose figures are known, and of a disk."""

import numpy as np
import pytest

import sssfit
from sssfit.compare.frames import over_frames
from sssfit.errors import RenderError
from sssfit.fit.disk import fit_disk
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_dipole


def test_noise_falls_as_the_shares_of_frames_say():
    """Independent noise falls with the square root of the sum of squared shares."""
    rng = np.random.default_rng(1)
    grey = np.full((64, 64, 3), 0.5)
    made = [grey + rng.normal(0.0, 0.01, grey.shape[:2])[..., None] for _ in range(64)]
    one, eight, sixteen = over_frames(made.__getitem__, grey)
    assert [each.frames for each in (one, eight, sixteen)] == [1, 8, 16]
    shares = np.full(8, 1.0 / 8.0)
    for _ in range(8):
        shares = np.append(shares * (1.0 - 1.0 / 8.0), 1.0 / 8.0)
    expected = np.sqrt((shares**2).sum())
    # 4096 pixels: a mean of |noise| is known to .75 / sqrt(4096) of itself.
    assert eight.error_mean / one.error_mean == pytest.approx(8**-0.5, rel=5 * 0.75 / 64)
    assert sixteen.error_mean / one.error_mean == pytest.approx(expected, rel=5 * 0.75 / 64)
    # The mean of 64 has a part of each frame: 1 - 1/64 of the variance is left of one.
    assert one.noise_mean / one.error_mean == pytest.approx((63 / 64) ** 0.5, rel=0.03)


def test_a_constant_offset_is_error_and_no_noise():
    grey = np.full((8, 8, 3), 0.5)
    for each in over_frames(lambda _: 1.1 * grey, grey):
        assert each.error_mean > 1.0
        assert each.noise_p99 < 1e-6


def test_a_disk_gains_by_frames_and_by_fetches():
    profile = simulate_dipole(sssfit.load_material("skin1"))
    scene = make_scene("edge", height=64, width=64, mm_per_pixel=0.3)
    truth = render_reference(scene, profile)
    found = {}
    for taps in (16, 40):
        table = fit_disk(profile, taps=taps).kernel
        found[taps] = over_frames(lambda k, t=table: render_taps(scene, t, frame=k), truth)
        one, eight, sixteen = found[taps]
        assert one.error_p99 == measure(render_taps(scene, table), truth).delta_e_2000_p99
        assert one.noise_p99 > 2.0 * eight.noise_p99 > 2.0 * sixteen.noise_p99
        assert one.error_p99 > eight.error_p99
    assert all(b.error_p99 < a.error_p99 for a, b in zip(found[16], found[40], strict=True))


def test_a_share_out_of_range_is_one_line():
    with pytest.raises(RenderError, match="expected a share above 0"):
        over_frames(lambda _: np.ones((2, 2, 3)), np.ones((2, 2, 3)), newest=0.0)
