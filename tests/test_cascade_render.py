"""The quick way of a cascade: as pass by pass, and the same bits for any threads and blocks."""

import itertools

import numpy as np
import pytest
from test_taps import PITCH, stage, taps_of

from sssfit._jit.cascade import add_doubled, run_level
from sssfit.kernel import Stage
from sssfit.render import cascade
from sssfit.render.cascade import apply_cascade, is_quick
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

STRUCTURES = ["1", "3", "1-2", "2-3|1-2|1", "1|1|1|1-1"]


def pass_by_pass(picture, taps, pitch):
    """By the other way of the same renderer: all of the picture covered."""
    whole = np.ones(picture.shape[:2])
    return render_taps(Scene("noise", picture, pitch), taps, coverage=whole)


@pytest.mark.parametrize("size", [(1, 1), (1, 6), (3, 2), (8, 8), (9, 7), (300, 41), (41, 700)])
@pytest.mark.parametrize("structure", STRUCTURES)
def test_it_is_the_sum_of_passes(structure, size):
    for channels in (1, 3, 4):
        taps = taps_of(structure, channels=channels)
        picture = np.random.default_rng(21).uniform(size=(*size, channels))
        quick = apply_cascade(picture, taps, 0.25, threads=2)
        np.testing.assert_allclose(quick, pass_by_pass(picture, taps, 0.25), rtol=0, atol=1e-13)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_bits_depend_neither_on_threads_nor_on_blocks(dtype, monkeypatch):
    taps = taps_of("1-2|2-1|1-1", channels=3)
    picture = np.random.default_rng(22).uniform(size=(301, 203, 3)).astype(dtype)
    found = []
    for threads, rows in itertools.product((1, 3), (2, 64, 512)):
        monkeypatch.setattr(cascade, "_ROWS", rows)
        found.append(apply_cascade(picture, taps, PITCH, threads=threads))
    assert all(np.array_equal(each, found[0]) for each in found)
    assert found[0].dtype == dtype
    if dtype == np.float32:
        double = apply_cascade(picture.astype(float), taps, PITCH)
        np.testing.assert_allclose(found[0], double, rtol=0, atol=1e-6)


def test_it_is_compiled_once_for_pictures_that_can_be_written_to_and_others_grey_and_coloured():
    kinds = []
    for channels, is_writeable in itertools.product((1, 3), (True, False)):
        picture = np.random.default_rng(24).uniform(size=(9, 8, channels))
        picture.flags.writeable = is_writeable
        apply_cascade(picture, taps_of("1|1-1", channels=channels), PITCH)
        kinds.append([len(each.signatures) for each in (run_level, add_doubled)])
    assert kinds == [kinds[0]] * 4


def test_offsets_far_apart_and_within_a_texel():
    """Texels between two pairs have no weight; a fetch within the middle one reaches the next."""
    rng = np.random.default_rng(23)
    for offsets in ([0.02, 7.5], [1e-4], [0.3, 0.4], [2.0, 3.0]):
        own = stage(rng, 0, pairs=len(offsets), channels=3)
        far = Stage(0, "pair", np.array(offsets) * PITCH, own.weights)
        taps = taps_of("1-1", channels=3, stages=(far, stage(rng, 1, channels=3)))
        picture = rng.uniform(size=(37, 22, 3))
        np.testing.assert_allclose(
            apply_cascade(picture, taps, PITCH), pass_by_pass(picture, taps, PITCH), atol=1e-13
        )


def test_a_picture_that_must_not_be_written_is_not():
    for structure in ("1", "1|1"):
        taps = taps_of(structure, channels=3)
        picture = np.random.default_rng(24).uniform(size=(6, 9, 3))
        expected = apply_cascade(picture, taps, PITCH)
        picture.flags.writeable = False
        np.testing.assert_array_equal(apply_cascade(picture, taps, PITCH), expected)


def test_only_chains_of_pairs_are_quick():
    assert is_quick(taps_of("1-2|1"))
    assert not is_quick(taps_of("1-2", chained=False))
    assert not is_quick(taps_of("1|*"))
