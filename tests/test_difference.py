"""What a picture lost, magnified and in false colours."""

import itertools

import matplotlib
import numpy as np
import pytest

from sssfit.errors import RenderError
from sssfit.formats.colours import srgb_encode
from sssfit.measure.difference import MAPS, difference_map, magnified_difference

RNG = np.random.default_rng(4)
TRUTH = RNG.random((6, 9, 3))
PICTURE = TRUTH + 0.01 * RNG.standard_normal((6, 9, 3))
DRAWN_BY = {"signed": "RdBu_r", "absolute": "viridis"}
# Machado, Oliveira and Fernandes 2009, severity 1: what protanopes and deuteranopes see, in linear
# R, G, B.
BLIND = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
}


def test_a_magnified_difference_is_absolute():
    np.testing.assert_allclose(
        magnified_difference(PICTURE, TRUTH, gain=4.0), 4.0 * np.abs(PICTURE - TRUTH), rtol=1e-12
    )


def test_a_signed_map_is_of_luminance():
    found = difference_map(PICTURE, TRUTH)
    luminance = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in (PICTURE - TRUTH)[2]]
    largest = np.abs((PICTURE - TRUTH) @ [0.2126, 0.7152, 0.0722]).max()
    assert found.end == pytest.approx(largest)
    assert (found.kind, found.what) == ("signed", "luminance")
    colours = matplotlib.colormaps["RdBu_r"](0.5 + 0.5 * np.array(luminance) / largest)[:, :3]
    np.testing.assert_allclose(srgb_encode(found.pixels[2]), colours, atol=4 / 255)


def test_an_absolute_map_is_of_the_largest_channel():
    found = difference_map(PICTURE, TRUTH, kind="absolute")
    values = np.abs(PICTURE - TRUTH).max(axis=2)
    assert found.end == values.max()
    assert found.what == "largest of the channels"
    colours = matplotlib.colormaps["viridis"](values / values.max())[..., :3]
    np.testing.assert_allclose(srgb_encode(found.pixels), colours, atol=7 / 255)


@pytest.mark.parametrize("kind", MAPS)
def test_a_gain_ends_the_scale_sooner_and_nothing_lies_beyond_it(kind):
    whole, part = (difference_map(PICTURE, TRUTH, kind=kind, gain=each) for each in (1.0, 4.0))
    assert part.end == whole.end / 4.0
    cut = np.clip(PICTURE - TRUTH, -1.0, 1.0)
    assert np.abs(cut).max() > part.end
    ends = matplotlib.colormaps[DRAWN_BY[kind]]([0.0, 1.0])[:, :3]
    codes = srgb_encode(part.pixels).reshape(-1, 3)
    assert np.abs(codes - ends[1]).sum(axis=1).min() < 0.02
    assert codes.min() >= 0.0
    assert codes.max() <= 1.0


@pytest.mark.parametrize("kind", MAPS)
def test_nothing_lost_is_the_colour_of_0(kind):
    found = difference_map(TRUTH, TRUTH, kind=kind)
    assert found.end == 0.0
    zero = {"signed": 0.5, "absolute": 0.0}[kind]
    colour = matplotlib.colormaps[DRAWN_BY[kind]](zero)[:3]
    np.testing.assert_allclose(
        srgb_encode(found.pixels), np.broadcast_to(colour, (6, 9, 3)), atol=0.01
    )


@pytest.mark.parametrize("kind", MAPS)
@pytest.mark.parametrize("blindness", BLIND)
def test_colour_blind_eyes_tell_the_colours_apart(kind, blindness):
    """Nine steps of the scale; CIE Delta E 1976 of 2.3 is just noticeable (Mahy et al. 1994)."""
    steps = np.linspace(-1.0 if kind == "signed" else 0.0, 1.0, 9)[None, :, None]
    seen = difference_map(steps, np.zeros_like(steps), kind=kind).pixels[0] @ np.transpose(
        BLIND[blindness]
    )
    lab = [_lab(np.clip(each, 0.0, 1.0)) for each in seen]
    apart = [np.linalg.norm(a - b) for a, b in itertools.combinations(lab, 2)]
    assert min(apart) > 3 * 2.3


def _lab(linear):
    """CIE 1976 L*a*b* of linear sRGB under D65."""
    xyz = (
        np.array(
            [
                [0.4124564, 0.3575761, 0.1804375],
                [0.2126729, 0.7151522, 0.0721750],
                [0.0193339, 0.1191920, 0.9503041],
            ]
        )
        @ linear
        / [0.95047, 1.0, 1.08883]
    )
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize(("channels", "what"), [(1, "difference"), (5, "mean of the channels")])
def test_pictures_of_other_channels(channels, what):
    truth, picture = np.zeros((2, 3, channels)), RNG.random((2, 3, channels))
    found = difference_map(picture, truth)
    assert found.what == what
    assert found.end == pytest.approx(picture.mean(axis=2).max())
    assert found.pixels.shape == (2, 3, 3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": "red"}, "kind = 'red'; expected signed or absolute"),
        ({"gain": 0.0}, "gain = 0; expected a factor above 0"),
        ({"gain": np.nan}, "gain = nan; expected a factor above 0"),
        ({"truth": TRUTH[:3]}, r"shape \(6, 9, 3\) and \(3, 9, 3\); expected the same rows"),
    ],
)
def test_what_is_refused(changes, words):
    with pytest.raises(RenderError, match=words):
        difference_map(**({"picture": PICTURE, "truth": TRUTH} | changes))
