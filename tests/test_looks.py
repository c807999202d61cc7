"""Looks of methods: each its own, dark enough on white, and the same whatever a label adds."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from sssfit.chart.looks import METHODS, MODELS, RENDERERS, look, method_of, series, variants
from sssfit.methods import FITS
from sssfit.methods import RENDERERS as NAMES


def contrast(colour):
    """WCAG 2.2's contrast of a colour on white."""
    encoded = np.array(to_rgb(colour))
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return 1.05 / (linear @ [0.2126, 0.7152, 0.0722] + 0.05)


def test_no_two_methods_have_the_same_colour_or_marker():
    assert set(METHODS) == set(FITS)
    for of in ("name", "colour", "marker"):
        assert len({getattr(each, of) for each in METHODS.values()}) == len(METHODS)
    every = {**METHODS, **{f"{name} of light": each for name, each in MODELS.items()}}
    kinds = {(each.colour, each.marker) for each in every.values()}
    assert len(kinds) == len(every) - 1  # Burley's profile and its kernel look the same


def test_every_renderer_has_a_look_and_can_be_seen():
    assert {name: each.name for name, each in RENDERERS.items()} == {
        name: each.summary for name, each in NAMES.items()
    }
    for each in (*METHODS.values(), *MODELS.values(), *RENDERERS.values(), look("new")):
        assert contrast(each.colour) > 2.2


@pytest.mark.parametrize(
    ("label", "method"),
    [
        ("svd 3 on taps", "svd"),
        ("SVD", "svd"),
        ("pre-integrated, smoothed", "preintegrated"),
        ("gaussians 6", "gaussians"),
        ("gaussian-chain 3", "gaussian-chain"),
        ("cascade", "cascade"),
        ("dipole-grosjean", "dipole-grosjean"),
        ("index 1.3", None),
        ("svdx", None),
    ],
)
def test_a_label_names_its_method(label, method):
    assert method_of(label) == method


def test_settings_of_a_method_share_its_colour_and_differ_in_their_marker():
    labels = [f"{name}{more}" for name in FITS for more in ("", " 1", " 2, smoothed", " 3")]
    found = variants(labels, 4.0)
    for name, own in itertools.groupby(labels, key=method_of):
        styles = [found[each] for each in own]
        assert {each["color"] for each in styles} == {METHODS[name].colour}
        assert styles[0]["marker"] == METHODS[name].marker
    first, second = found["svd"], found["svd 1"]
    assert second["markersize"] > 1.3 * first["markersize"]  # a ring around it
    seen = {(f["color"], str(f["marker"]), f["markerfacecolor"]) for f in found.values()}
    assert len(seen) == len(labels)


def test_seven_series_differ_in_colour_and_marker():
    found = [series(k) for k in range(7)]
    for of in ("color", "marker"):
        assert len({each[of] for each in found}) == 7
