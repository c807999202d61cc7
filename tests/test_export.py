"""Exported kernels: the numbers are the kernel's, the comment says what they are."""

import json
import re

import numpy as np
import pytest
from reference_pixels import make_profile

from sssfit.export import hlsl, json_document
from sssfit.fit import fit_preintegrated
from sssfit.kernel import SeparableKernel


def small_kernel(channels=3, terms=2, pixels=5):
    """Weights that are no round numbers, signs of both kinds."""
    rng = np.random.default_rng(5)
    half = rng.random((terms, pixels // 2 + 1, channels)) / 7.0
    return SeparableKernel(
        method="svd",
        mm_per_pixel=0.1,
        channels=tuple(f"c{k}" for k in range(channels)),
        signs=np.where(np.arange(terms)[:, None] % 2, -1.0, 1.0) * np.ones(channels),
        weights=np.concatenate((half[:, :0:-1], half), axis=1),
        relative_frobenius_error=np.full(channels, 0.25),
        energy_error=np.full(channels, np.nan),
        scale=np.ones(channels),
        parameters={},
        meta={
            "material": "wax",
            "material_sha256": "0123456789abcdef0123",
            "profile_method": "montecarlo",
            "photons": 10_000_000,
            "version": "0.1.0",
        },
    )


def numbers_of(text, name):
    """The numbers of a constant of HLSL, in order."""
    body = re.search(rf"{name}(?:\[\d+\])* = (.*?);", text, re.DOTALL).group(1)
    return [
        float(each)
        for each in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", re.sub(r"float\d", "", body))
    ]


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 5])
def test_hlsl_holds_the_kernel_in_single_precision(channels):
    kernel = small_kernel(channels)
    text = hlsl(kernel)
    shape = kernel.weights.shape
    weights = np.array(numbers_of(text, "SSS_WEIGHTS")).reshape(shape)
    np.testing.assert_array_equal(weights.astype(np.float32), kernel.weights.astype(np.float32))
    signs = np.array(numbers_of(text, "SSS_SIGN")).reshape(shape[0], channels)
    np.testing.assert_array_equal(signs, kernel.signs)
    assert f"SSS_TERMS = {shape[0]};" in text
    assert f"SSS_PIXELS = {shape[1]};" in text
    assert text.count("{") == text.count("}")


def test_comment_says_what_the_numbers_are():
    text = hlsl(small_kernel())
    for part in ("wax", "0123456789abcdef", "svd", "0.1 mm", "10,000,000 photons", "energy error"):
        assert part in text.split("static const")[0]
    assert "unknown" in text  # an energy error that is NaN


def test_json_document_is_the_kernel_and_a_comment():
    kernel = small_kernel()
    whole = json.loads(json_document(kernel))
    assert whole.pop("comment")[0].startswith("Subsurface scattering kernel: wax")
    assert whole == kernel.to_dict()


def test_the_same_kernel_gives_the_same_text():
    assert hlsl(small_kernel()) == hlsl(small_kernel())
    assert json_document(small_kernel()) == json_document(small_kernel())


def test_a_fitted_kernel_is_exported():
    profile = make_profile(np.linspace(0.0, 2.0, 21), np.full((20, 2), 0.01))
    text = hlsl(fit_preintegrated(profile).kernel)
    assert "float2 SSS_WEIGHTS[1]" in text
