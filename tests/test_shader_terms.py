"""Exported passes of several separable terms, on a software driver against the renderer."""

import itertools

import numpy as np
import pytest
from shader_runs import run
from test_shaders import PITCH, RUN, TABLES, apart, disk_mask, light_of, rendered
from turns import in_turn

from sssfit.export import DIALECTS, Style, kernel_text, source
from sssfit.export.dense import taps_of_kernel
from sssfit.export.passes import pass_list
from sssfit.fit.gaussians import fit_gaussians
from sssfit.fit.on_taps import on_taps
from sssfit.fit.svd import fit_svd
from sssfit.material import load_material
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole
from sssfit.simulate.gaussians import simulate_deon_skin


@pytest.fixture(scope="module")
def skin1():
    return simulate_dipole(load_material("skin1"))


@pytest.mark.parametrize(
    ("rank", "thinned", "dialect"), in_turn(itertools.product([2, 3], [False, True]), RUN)
)
def test_ranks_of_svd_show_what_the_renderer_shows(skin1, rank, thinned, dialect):
    """Terms of a fit share their first pass; dense, 31 weights a pass, and on 9 taps."""
    kernel = fit_svd(skin1, rank=rank, mm_per_pixel=PITCH, support_mm=4.5).kernel
    light = light_of((37, 50), 3)
    if thinned:
        found = taps = on_taps(kernel, 9)
        wanted = rendered(light, taps)
    else:
        found, taps = kernel, taps_of_kernel(kernel, 65)
        wanted = render_separable(Scene("light", light, PITCH), kernel, border="clamp")
    assert [len(each.stages) for each in pass_list(taps)] == [rank, *[1] * rank]
    text, _ = kernel_text(found, dialect, keep_energy=True, with_shader=not thinned)
    assert apart(run(text, dialect, taps, light, PITCH), wanted) < 1e-5


def test_a_channel_without_a_term_keeps_its_light_in_that_pass():
    """Blue of this skin is fitted with fewer Gaussians than red."""
    profile = simulate_deon_skin()
    kernel = fit_gaussians(profile, mm_per_pixel=0.5, support_mm=4.0).kernel
    assert (kernel.weights.sum(axis=1) == 0.0).any()
    scene = Scene("light", light_of((37, 50), 3), 0.5)
    found = render_taps(scene, taps_of_kernel(kernel, None))
    np.testing.assert_allclose(found, render_separable(scene, kernel), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "feature", "dialect"),
    in_turn(itertools.product(["*|1-*|*", "three terms"], ["COVERAGE", "DEPTH"]), RUN),
)
def test_alpha_of_the_result_is_the_coverage(name, feature, dialect):
    """Terms are added to a target that holds the coverage since the first."""
    taps = dict(TABLES)[name]
    text = source([taps], DIALECTS[dialect], Style(features=(feature,), normalized=False))
    cover, light, mm = disk_mask(), light_of((45, 50), 3), PITCH
    view = {"cover": cover, "whole": True}
    if feature == "DEPTH":
        view["depth"], mm = np.full(cover.shape, 300.0), PITCH / 300.0
    found = run(text, dialect, taps, light, mm, **view)
    # The middle of a texel in texture coordinates rounds by up to 50 x 6e-8 of a texel.
    np.testing.assert_allclose(found[..., 3], cover, atol=1e-5)
