"""Exported kernels: the numbers are the kernel's, the comment says what they are."""

import dataclasses
import io
import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from angled import angled
from reference_pixels import make_profile

import sssfit
from sssfit.errors import KernelError
from sssfit.export import DIALECTS, dense, exported, is_ours, json_document, kernel_text
from sssfit.export.dense import MOST_DENSE, taps_of_kernel
from sssfit.files import has_mark
from sssfit.fit import fit_preintegrated
from sssfit.kernel import SeparableKernel
from sssfit.methods import EXPORTS, Format, settings_of
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene

SCHEMA = json.loads((Path(sssfit.__file__).parent / "kernel.schema.json").read_text("utf-8"))


def hlsl_of(kernel):
    return dense(kernel, DIALECTS["hlsl"])


def small_kernel(channels=3, terms=2, pixels=5, **changes):
    """Weights that are no round numbers, signs of both kinds, other figures for every channel.

    The channels' names are in no order of letters.
    """
    rng = np.random.default_rng(5)
    half = rng.random((terms, pixels // 2 + 1, channels)) / 7.0
    each = np.arange(channels)
    fields = {
        "method": "svd",
        "mm_per_pixel": 0.1372549,
        "channels": tuple(f"c{channels - k}" for k in range(channels)),
        "signs": np.where((np.arange(terms)[:, None] + each) % 2, -1.0, 1.0),
        "weights": np.concatenate((half[:, :0:-1], half), axis=1),
        "relative_frobenius_error": 0.0251 + 0.0113 * each,
        "energy_error": 0.00317 - 0.00229 * each,
        "scale": 0.4321 * 0.57**each,
        "parameters": {},
        "meta": {
            "material": "wax",
            "material_sha256": "0123456789abcdef0123",
            "profile_method": "montecarlo",
            "photons": 10_000_000,
            "seed": 7,
            "version": "0.1.0",
            "settings": {"rank": 2, "energy": "rescale"},
        },
    }
    return SeparableKernel(**(fields | changes))


def numbers_of(text, name):
    """The numbers of a constant of HLSL, in order."""
    body = re.search(rf"{name}(?:\[\d+\])* = (.*?);", text, re.DOTALL).group(1)
    return [
        float(each)
        for each in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", re.sub(r"float\d|(?<=\d)u", "", body))
    ]


def is_shortest(literal):
    """Whether no decimal of fewer digits has the same bits in single precision."""
    digits = literal.partition("e")[0].strip("-").replace(".", "").strip("0")
    value = np.float32(literal)
    shorter = f"{value:.{max(len(digits) - 2, 0)}e}"
    return len(digits) < 2 or np.float32(shorter) != value


def comment_of(text):
    """The comment of HLSL as one line, without its marks."""
    lines = text.split("static const")[0].splitlines()
    assert all(line.startswith("// ") for line in lines)
    return " ".join(line.removeprefix("// ") for line in lines)


def said(comment, what):
    """The numbers that a comment says of something, in the order of the channels."""
    return [float(each) for each in re.search(rf"{what}: ([^;]*?)[.;]( |$)", comment)[1].split(",")]


@pytest.mark.parametrize("channels", [1, 2, 3, 4, 5])
def test_hlsl_holds_every_constant_in_single_precision(channels):
    kernel = small_kernel(channels)
    text = hlsl_of(kernel)
    shape = kernel.weights.shape
    for name, values in (
        ("SSS_WEIGHT", kernel.weights),
        ("SSS_SIGN", kernel.signs),
        ("SSS_SCALE", kernel.scale),
        ("SSS_MM_PER_PIXEL", np.array(kernel.mm_per_pixel)),
        ("SSS_TERMS", np.array(2.0)),
        ("SSS_PIXELS", np.array(5.0)),
    ):
        found = np.array(numbers_of(text, name)).reshape(values.shape)
        np.testing.assert_array_equal(found.astype(np.float32), values.astype(np.float32), name)
    assert len(set(numbers_of(text, "SSS_SCALE"))) == channels
    kind, rows = ("float", channels) if channels > 4 else (f"float{channels}", 1)
    kind = "float" if channels == 1 else kind
    scale = "SSS_SCALE[5]" if channels > 4 else "SSS_SCALE"
    assert f"static const {kind} {scale} = " in text
    assert f"static const {kind} SSS_SIGN[{2 * rows}] = {{" in text
    assert f"static const {kind} SSS_WEIGHT[{2 * shape[1] * rows}] = {{" in text
    assert text.count("{") == text.count("}")
    assert text.count("static const") == 6


@pytest.mark.parametrize("channels", [1, 4, 5, 7])
def test_c_has_a_row_for_each_pixel_and_any_number_of_channels(channels):
    kernel = small_kernel(channels)
    text = dense(kernel, DIALECTS["c"])
    dims = f"[{channels}]" if channels > 1 else ""
    (body,) = re.findall(rf"SSS_WEIGHT\[10\]{re.escape(dims)} = \{{(.*?)\}};", text, re.DOTALL)
    found = [float(each) for each in re.findall(r"-?\d[\d.e+-]*(?=f)", body)]
    wanted = kernel.weights.astype(np.float32).ravel()
    np.testing.assert_array_equal(np.array(found, np.float32), wanted)


def test_hlsl_has_the_fewest_digits_that_read_back():
    text = hlsl_of(small_kernel(weights=small_kernel().weights * [1e-9, 1.0, 1e6]))
    literals = re.findall(r"(?<!float)-?\b\d[\d.]*(?:e[+-]?\d+)?", text.split("static const", 1)[1])
    assert len(literals) > 2 * 5 * 3
    assert [each for each in literals if not is_shortest(each)] == []
    assert not is_shortest("0.1372549057")


@pytest.mark.parametrize("channels", [1, 3, 5])
@pytest.mark.parametrize("form", ["hlsl", "json"])
def test_the_comment_has_every_figure_of_every_channel(channels, form):
    kernel = small_kernel(channels)
    comment = (
        comment_of(hlsl_of(kernel))
        if form == "hlsl"
        else " ".join(json.loads(json_document(kernel))["comment"])
    )
    for what, values in (
        ("Energy of the 2D kernel", kernel.energy),
        ("Multiply by", kernel.scale),
        ("Relative Frobenius error", kernel.relative_frobenius_error),
        ("energy error", kernel.energy_error),
    ):
        assert len(set(values)) == channels
        np.testing.assert_allclose(said(comment, what), values, rtol=5e-6)
    for part in (
        "kernel: wax, sha256 0123456789abcdef.",
        "Profile: montecarlo, 10,000,000 photons, seed 7.",
        "Fit: svd, 2 separable terms (rank 2, energy rescale). sssfit 0.1.0.",
        f"5 pixels of 0.1372549 mm, the middle one on the axis; channels "
        f"{', '.join(kernel.channels)}.",
    ):
        assert part in comment


def test_what_is_not_known_is_said_to_be_unknown():
    unknown = {"relative_frobenius_error": [0.1, np.nan, 0.3], "energy_error": [np.nan] * 3}
    comment = comment_of(hlsl_of(small_kernel(**unknown, meta={})))
    assert (
        "kernel: unknown material. Profile: unknown. Fit: svd, 2 separable terms. sssf" in comment
    )
    assert "Relative Frobenius error: 0.1, unknown, 0.3; energy error: unknown, unknown" in comment


def test_a_seed_of_0_is_a_seed():
    small = small_kernel()
    comment = comment_of(hlsl_of(small_kernel(meta={**small.meta, "seed": 0})))
    assert "Profile: montecarlo, 10,000,000 photons, seed 0." in comment


def test_faint_channels_are_not_rounded_away():
    faint = small_kernel()
    faint = small_kernel(weights=faint.weights * 1e-8, scale=[1.0, 1e-14, 1e-30])
    comment = comment_of(hlsl_of(faint))
    np.testing.assert_allclose(said(comment, "Energy of the 2D kernel"), faint.energy, rtol=5e-6)
    assert said(comment, "Multiply by") == [1.0, 1e-14, 1e-30]


def test_no_text_can_leave_the_comment():
    settings = {"note": "a\n#error b\u2028c\x1b[0m\\", "list\r": ["x\ny"]}
    text = hlsl_of(small_kernel(meta={"settings": settings}))
    for line in text.splitlines():
        assert re.match(r"// |static const |    |\};$", line), line
        assert line.isprintable()
        assert not line.endswith("\\")  # would join the next line to the comment
    assert "#error" not in text.split("static const", 1)[1]


def test_numbers_at_the_ends_of_single_precision_are_written():
    ends = np.array([[1e18, 1.2e-38, 1e-46], [-1e18, 0.1, -0.0]])
    kernel = small_kernel(weights=np.stack([ends] * 3).transpose(1, 0, 2), scale=[1, 0, 0.5])
    found = np.array(numbers_of(hlsl_of(kernel), "SSS_WEIGHT")).reshape(2, 3, 3)
    expected = kernel.weights.astype(np.float32)
    expected[:, :, 2][expected[:, :, 2] < 1e-38] = 0.0
    np.testing.assert_array_equal(found.astype(np.float32), expected)
    assert np.isfinite(found.astype(np.float32)).all()


def test_json_document_is_the_kernel_and_a_comment_and_obeys_the_schema():
    kernel = small_kernel(signs=np.ones((2, 3)))
    text = json_document(kernel)
    whole = json.loads(text)
    jsonschema.validate(whole, SCHEMA)
    again = SeparableKernel.read(io.BytesIO(text.encode()))
    np.testing.assert_array_equal(again.scale, kernel.scale)
    assert next(iter(whole)) == "comment"
    assert whole.pop("comment")[0].startswith("Subsurface scattering kernel: wax")
    assert whole == kernel.to_dict()
    # By the record's own fields too, so that no name stands for another's numbers.
    np.testing.assert_array_equal(whole["scale"], kernel.scale)
    np.testing.assert_array_equal(whole["errors"]["energy"], kernel.energy_error)
    np.testing.assert_array_equal(
        whole["errors"]["relative_frobenius"], kernel.relative_frobenius_error
    )
    np.testing.assert_allclose(whole["energy"], [kernel.full(c).sum() for c in range(3)])
    assert whole["mm_per_pixel"] == 0.1372549
    assert whole["support_mm"] == 2 * 0.1372549
    for term, signs, weights in zip(whole["terms"], kernel.signs, kernel.weights, strict=True):
        assert term["sign"] == signs.tolist()
        assert term["weights"] == weights.tolist()


def test_names_in_any_letters_are_legible_in_every_form():
    words = ("gemäß", "Müllers Haut", "Maß", "größer", "rötlich", "緑", "μ")
    meta = {"material": words[1], "settings": {words[2]: words[3]}}
    kernel = dataclasses.replace(small_kernel(method=words[0], meta=meta), channels=words[4:])
    file = io.BytesIO()
    kernel.write(file)
    for text in (hlsl_of(kernel), json_document(kernel), file.getvalue().decode()):
        assert not [each for each in words if each not in text]


def test_the_same_kernel_gives_the_same_text():
    assert hlsl_of(small_kernel()) == hlsl_of(small_kernel())
    assert json_document(small_kernel()) == json_document(small_kernel())


def test_a_fitted_kernel_is_exported():
    profile = make_profile(np.linspace(0.0, 2.0, 21), np.full((20, 2), 0.01))
    text = hlsl_of(fit_preintegrated(profile, mm_per_pixel="profile").kernel)
    assert "float2 SSS_WEIGHT[" in text


def test_only_dense_writes_passes_of_more_than_65_weights():
    kernel = small_kernel(pixels=143)
    with pytest.raises(
        KernelError, match=r"has 143 weights, and 65 are the most .* `dense` is set"
    ):
        kernel_text(kernel, "hlsl", with_shader=True)
    assert "SSS_Blur" in kernel_text(kernel, "hlsl", dense=True)[0]
    assert "SSS_Blur" in kernel_text(small_kernel(pixels=65), "hlsl", with_shader=True)[0]


def test_what_dense_cannot_write_is_said_of_the_kernel():
    assert f"up to {MOST_DENSE} weights" in dict(settings_of(EXPORTS))["dense"][0].help
    assert "SSS_Blur" in kernel_text(small_kernel(pixels=MOST_DENSE), "hlsl", dense=True)[0]
    for asked in ("dense", "with_shader"):
        with pytest.raises(KernelError, match=r"has 515 weights, and \d+ .* as fetches; thin"):
            kernel_text(small_kernel(pixels=MOST_DENSE + 2), "hlsl", **{asked: True})
        with pytest.raises(KernelError, match=r"kernel has 25 terms, and 24 are the most"):
            kernel_text(small_kernel(terms=25), "hlsl", **{asked: True})


@pytest.mark.parametrize("asked", ["dense", "with_shader"])
def test_a_kernel_of_one_pixel_has_passes(asked):
    kernel = small_kernel(pixels=1)
    text, _ = kernel_text(kernel, "hlsl", keep_energy=True, **{asked: True})
    assert "SSS_Terms0" in text
    scene = Scene("light", np.random.default_rng(2).random((7, 9, 3)), kernel.mm_per_pixel)
    found = render_taps(scene, taps_of_kernel(kernel, None))
    wanted = scene.irradiance * kernel.energy * kernel.scale
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_what_half_floats_cost_is_that_of_weights_and_scale(caplog):
    caplog.set_level("INFO", "sssfit")
    kernel = small_kernel(channels=1, signs=np.ones((2, 1)))
    text, _ = kernel_text(kernel, "c", half=True)
    text = re.sub(r"(?<=\d)f\b", "", text)
    (scale,) = numbers_of(text, "SSS_SCALE")
    weights = np.array(numbers_of(text, "SSS_WEIGHT")).reshape(2, 5)
    change = scale * (weights.sum(axis=1) ** 2).sum() / (kernel.energy * kernel.scale)[0] - 1.0
    assert 1e-5 < abs(scale / kernel.scale[0] - 1.0) < 1e-3
    assert caplog.messages == [f"Half floats change the energy of wax: c1 {100 * change:+.2g} %."]


def test_settings_of_other_forms_are_refused_from_python_too():
    kernel, profile = small_kernel(), make_profile(np.linspace(0.0, 2.0, 21), np.full((20, 2), 0.1))
    for name in ("coverage", "depth", "jitter", "tilt", "compute", "transmittance", "nope"):
        with pytest.raises(KernelError, match=f"^{name} is no setting of c; expected prefix, keep"):
            kernel_text(kernel, "c", **{name: True})
    for form, record in (("frequency", profile), ("angles", profile), ("json", kernel)):
        with pytest.raises(KernelError, match=f"^half is no setting of {form}; expected none"):
            exported([record], form, half=True)
    # What is off stays away, and a setting may have the option's name or the function's.
    assert kernel_text(kernel, "c", coverage=False) == kernel_text(kernel, "c")
    named = [exported([profile], "lut", **{each: 1.5}) for each in ("radius", "radius_mm")]
    assert named[0] == named[1]
    with pytest.raises(KernelError, match=r"^nope is no setting of csv"):
        exported([kernel], "csv", nope=None)


def test_records_that_a_form_is_not_made_of_are_refused():
    profile = make_profile(np.linspace(0.0, 2.0, 21), np.full((20, 2), 0.1))
    for form in ("hlsl", "c", "json"):
        with pytest.raises(KernelError, match=rf"^{form} is written of kernels, .* fit a kernel"):
            exported([small_kernel(), profile], form)
    for form, wanted in (("csv", "a profile or a kernel"), ("wgsl", "a kernel")):
        with pytest.raises(KernelError, match=f"^nothing to write as {form}; give {wanted}"):
            exported([], form)
        with pytest.raises(KernelError, match=f"^'skin1' cannot be written as {form}; expected a"):
            exported(["skin1"], form)


@pytest.mark.parametrize("form", EXPORTS)
def test_a_format_knows_its_own_files_and_no_other_does(form, tmp_path):
    profile = angled(make_profile(np.linspace(0.0, 2.0, 21), np.full((20, 3), 0.01)))
    made = exported([profile if EXPORTS[form].of_profiles else small_kernel()], form)
    path = tmp_path / f"x{made.tag}{made.ending}"
    path.write_bytes(made.content)
    assert [each for each in EXPORTS if is_ours(path, each)] == [form]


def test_one_file_and_one_entry_are_a_format(monkeypatch, tmp_path):
    """The file is written, known when it is there already, and told by its word."""
    lines = SimpleNamespace(
        lines_text=lambda kernels: f"# sssfit.lines/1\n{kernels[0].pixels}\n",
        is_our_lines=lambda path: has_mark(path, {b"# sssfit.lines/1": b""}),
    )
    monkeypatch.setitem(sys.modules, "sssfit.export.lines", lines)
    entry = Format(
        "sssfit.export.lines:lines_text",
        "a line a kernel",
        what="a list",
        knows="sssfit.export.lines:is_our_lines",
    )
    monkeypatch.setitem(EXPORTS, "lines", entry)
    made = exported([small_kernel()], "lines")
    assert (made.stdout, made.tag, made.ending) == ("the list", "", ".lines")
    path = tmp_path / "x.lines"
    path.write_bytes(made.content)
    assert is_ours(path, "lines")
    path.write_text("mine")
    assert not is_ours(path, "lines")
