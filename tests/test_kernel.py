"""Kernel records and their files: the same bits back, a schema, one line for what is no kernel."""

import copy
import io
import itertools
import json
import pickle
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from reference_pixels import one_over_r_profile

import sssfit
from sssfit.errors import FileError, KernelError
from sssfit.fit import fit_preintegrated, fit_svd
from sssfit.kernel import FORMAT, SeparableKernel, is_kernel_file
from sssfit.kernel.record import PROVENANCE

SCHEMA = json.loads((Path(sssfit.__file__).parent / "kernel.schema.json").read_text("utf-8"))
ARRAYS = ("signs", "weights", "relative_frobenius_error", "energy_error", "scale")


def kernel_of(half, signs=None, **changes):
    """A kernel with the given half passes (T, h+1, C); ``changes`` replace fields."""
    half = np.asarray(half, dtype=float)
    terms, _, channels = half.shape
    fields = {
        "method": "test",
        "mm_per_pixel": 0.1,
        "channels": tuple(f"c{k}" for k in range(channels)),
        "signs": np.ones((terms, channels)) if signs is None else signs,
        "weights": np.concatenate((half[:, :0:-1], half), axis=1),
        "relative_frobenius_error": np.full(channels, np.nan),
        "energy_error": np.zeros(channels),
        "scale": np.ones(channels),
        "parameters": {},
        "meta": {"material": "test"},
    }
    return SeparableKernel(**(fields | changes))


def bytes_of(kernel):
    stream = io.BytesIO()
    kernel.write(stream)
    return stream.getvalue()


def assert_same_bits(ours, theirs):
    for name in ARRAYS:
        assert getattr(ours, name).tobytes() == getattr(theirs, name).tobytes(), name
    for name in ("method", "mm_per_pixel", "channels"):
        assert getattr(ours, name) == getattr(theirs, name), name
    assert dict(ours.parameters) == dict(theirs.parameters)
    assert dict(ours.meta) == dict(theirs.meta)


numbers = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e150, max_value=1e150)
shares = st.floats(-1e15, 1e15)
labels = st.text(min_size=1, max_size=12).filter(lambda t: t.isprintable() and t.strip() == t)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | numbers | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=6,
)
json_objects = st.dictionaries(st.text(max_size=5), json_values, max_size=2)


# What has a meaning of its own is checked.
others = st.text(max_size=5).filter(
    lambda key: key not in (*PROVENANCE, "settings", "material_sha256", "method")
)


@st.composite
def kernels(draw):
    terms, half, channels = (draw(st.integers(1, most)) for most in (3, 4, 3))
    shape = (terms, half, channels)
    errors = arrays(float, channels, elements=st.floats(0.0, 1e9) | st.just(np.nan))
    return kernel_of(
        draw(arrays(float, shape, elements=shares)),
        draw(arrays(float, (terms, channels), elements=st.sampled_from((-1.0, 1.0)))),
        method=draw(labels),
        mm_per_pixel=draw(st.floats(1e-12, 1e12)),
        channels=tuple(draw(st.lists(labels, min_size=channels, max_size=channels, unique=True))),
        relative_frobenius_error=draw(errors),
        energy_error=draw(errors),
        scale=draw(arrays(float, channels, elements=st.floats(0.0, 1e6))),
        parameters=draw(st.dictionaries(st.text(max_size=5), json_objects, max_size=3)),
        meta=draw(st.dictionaries(others, json_values, max_size=3)),
    )


def check_round_trip(kernel):
    written = bytes_of(kernel)
    read = SeparableKernel.read(io.BytesIO(written))
    assert_same_bits(read, kernel)
    assert bytes_of(read) == written
    jsonschema.validate(json.loads(written), SCHEMA)


@settings(max_examples=40, deadline=None)
@given(kernels())
def test_a_file_gives_the_same_bits_back_and_obeys_the_schema(kernel):
    check_round_trip(kernel)


@pytest.mark.slow
@settings(max_examples=1000, deadline=None)
@given(kernels())
def test_any_file_gives_the_same_bits_back_and_obeys_the_schema(kernel):
    check_round_trip(kernel)


# What sssfit.kernel.json looks at; the rest are words for people.
KNOWN_KEYWORDS = {
    *("$schema", "title", "description", "const", "enum", "type", "pattern", "minimum", "maximum"),
    *("minItems", "maxItems", "uniqueItems", "items", "required", "properties"),
    "additionalProperties",
}


def keywords_of(rules):
    """Every keyword of a schema and of those within."""
    inner = [*rules.get("properties", {}).values()]
    inner += [rules[name] for name in ("items", "additionalProperties") if rules.get(name)]
    return set(rules).union(*map(keywords_of, inner))


def test_the_schema_is_one_and_refuses_what_is_no_kernel():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["title"] == FORMAT
    good = kernel_of(np.ones((2, 3, 1))).to_dict()
    jsonschema.validate(good, SCHEMA)
    for key in SCHEMA["required"]:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({name: good[name] for name in good if name != key}, SCHEMA)
    assert keywords_of(SCHEMA) <= KNOWN_KEYWORDS
    wrong = ({"mm_per_pixel": 0}, {"terms": []}, {"rank": 0}, {"format": "sssfit.kernel/2"})
    for changes in (*wrong, {"ranks": 1}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(good | changes, SCHEMA)


@pytest.mark.parametrize("name", ["fit_svd", "fit_preintegrated"])
def test_kernels_of_fits_come_back_and_obey_the_schema(tmp_path, name):
    fit = {"fit_svd": fit_svd, "fit_preintegrated": fit_preintegrated}[name]
    kernel = fit(one_over_r_profile(20, 0.1, [0.3, 0.9]), normalize=True).kernel
    path = tmp_path / "test.kernel.json"
    kernel.save(path)
    assert is_kernel_file(path)
    assert_same_bits(SeparableKernel.load(path), kernel)
    jsonschema.validate(json.loads(path.read_bytes()), SCHEMA)


def test_subnormal_weights_and_the_sign_of_zero_come_back():
    tiny = kernel_of(np.full((1, 2, 1), 5e-324))
    assert_same_bits(SeparableKernel.read(io.BytesIO(bytes_of(tiny))), tiny)
    assert np.signbit(
        SeparableKernel.read(io.BytesIO(bytes_of(kernel_of(np.full((1, 2, 1), -0.0))))).weights
    ).all()


def test_a_file_has_a_line_a_term():
    lines = bytes_of(kernel_of(np.ones((3, 4, 2)))).decode().splitlines()
    assert sum(line.startswith('  {"sign"') for line in lines) == 3
    assert json.loads(lines[1].removesuffix(",").join("{}"))["format"] == FORMAT


@settings(max_examples=60, deadline=None)
@given(
    arrays(float, (3, 4, 2), elements=st.floats(-3.0, 3.0)),
    arrays(float, (3, 2), elements=st.sampled_from((-1.0, 1.0))),
)
def test_passes_and_the_2d_kernel_agree(half, signs):
    kernel = kernel_of(half, signs)
    assert (kernel.rank, kernel.pixels, kernel.half_pixels) == (3, 7, 3)
    assert kernel.support_mm == pytest.approx(0.3)
    rng = np.random.default_rng(1)
    image = rng.uniform(size=(7, 7))
    for c in range(2):
        full = kernel.full(c)
        literal = np.zeros((7, 7))
        for t, i, j in itertools.product(range(3), range(7), range(7)):
            literal[i, j] += signs[t, c] * kernel.weights[t, i, c] * kernel.weights[t, j, c]
        np.testing.assert_allclose(full, literal, atol=1e-12)
        np.testing.assert_allclose(kernel.quadrant(c), full[3:, 3:], atol=1e-12)
        np.testing.assert_array_equal(kernel.quadrant(c), kernel.quadrant(c).T)
        np.testing.assert_allclose(kernel.line[:, c], full.sum(axis=0), atol=1e-11)
        assert kernel.energy[c] == pytest.approx(full.sum(), abs=1e-10)
        passes = kernel.weights[:, :, c]
        in_passes = sum(signs[t, c] * (passes[t] @ image @ passes[t]) for t in range(3))
        assert in_passes == pytest.approx((full * image).sum(), abs=1e-10)


def test_copies_and_pickles_hold_the_same():
    kernel = kernel_of(np.ones((2, 3, 1)), parameters={"c0": {"v": [1.0]}})
    for twin in (pickle.loads(pickle.dumps(kernel)), copy.deepcopy(kernel)):
        np.testing.assert_array_equal(twin.weights, kernel.weights)
        assert dict(twin.parameters) == {"c0": {"v": [1.0]}}
        assert not twin.weights.flags.writeable
        assert bytes_of(twin) == bytes_of(kernel)


def test_a_kernel_cannot_be_changed():
    kernel = kernel_of(np.ones((1, 2, 1)))
    with pytest.raises(ValueError, match="read-only"):
        kernel.weights[0] = 2.0
    with pytest.raises(TypeError):
        kernel.meta["material"] = "other"
    with pytest.raises(AttributeError):
        kernel.scale = np.ones(1)


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"mm_per_pixel": 0.0}, "mm_per_pixel = 0.0; expected a length above 0"),
        ({"mm_per_pixel": np.nan}, "mm_per_pixel = nan"),
        ({"weights": np.ones((1, 4, 1))}, "an odd number of pixels"),
        ({"weights": np.ones((0, 3, 1))}, "weights have shape (0, 3, 1)"),
        ({"weights": np.ones((1, 3))}, "weights have shape (1, 3)"),
        ({"weights": np.array([[[1.0], [2.0], [3.0]]])}, "not symmetric"),
        ({"weights": np.full((1, 3, 1), np.nan)}, "weights holds nan at [0, 0, 0]; expected"),
        ({"weights": np.full((1, 3, 1), 1e200)}, "weights holds 1e+200 at [0, 0, 0]; expected"),
        ({"weights": np.full((2, 31, 1), 9e17), "signs": [[1], [-1]]}, "beyond single precision"),
        ({"weights": np.full((1, 3, 1), 1e10), "scale": [1e18]}, "weights add up to 9e+38"),
        ({"weights": [[["1"], ["2"], ["1"]]]}, "weights is not an array of numbers"),
        ({"weights": [[[1], [True], [1]]]}, "weights is not an array of numbers"),
        ({"weights": [[[1], [2, 3], [1]]]}, "weights is not an array of numbers"),
        ({"weights": [[[1], [10**400], [1]]]}, "weights is not an array of numbers"),
        ({"weights": None}, "weights is not an array of numbers"),
        ({"scale": [np.inf]}, "scale holds inf at [0]; expected numbers from 0 to 1e+18"),
        ({"scale": [-1.0]}, "scale holds -1.0 at [0]"),
        ({"scale": "one"}, "scale is not an array of numbers"),
        ({"signs": [[True]]}, "signs is not an array of numbers"),
        ({"relative_frobenius_error": [-0.1]}, "relative_frobenius_error holds -0.1 at [0]"),
        ({"relative_frobenius_error": [np.inf]}, "relative_frobenius_error holds inf at [0]"),
        ({"energy_error": [-np.inf]}, "energy_error holds -inf at [0]"),
        ({"mm_per_pixel": "wide"}, "mm_per_pixel is not an array of numbers"),
        ({"mm_per_pixel": "0.1"}, "mm_per_pixel is not an array of numbers"),
        ({"mm_per_pixel": True}, "mm_per_pixel is not an array of numbers"),
        ({"mm_per_pixel": [0.1]}, "mm_per_pixel = [0.1]; expected a length above 0"),
        ({"mm_per_pixel": 1e-60}, "mm_per_pixel = 1e-60; expected a length above 0, from 1e-12"),
        ({"method": "svd\n#error"}, r"method = 'svd\n#error'; expected a text that prints on one"),
        ({"method": None}, "method = None; expected a text"),
        ({"channels": ("R\n",)}, r"channels[0] = 'R\n'; expected a name"),
        ({"channels": (7,)}, "channels[0] = 7; expected a name"),
        ({"channels": 7}, "channels = 7; expected a list of names"),
        ({"channels": "R"}, "channels = 'R'; expected a list of names"),
        ({"meta": None}, "meta = None; expected a mapping"),
        ({"meta": {"version": "1\n2"}}, r"meta.version = '1\n2'; expected a text that prints"),
        ({"meta": {"material": "a\u2028b"}}, r"meta.material = 'a\u2028b'; expected a text"),
        ({"meta": {"material": {}}}, "meta.material = {}; expected a text"),
        ({"meta": {"photons": "many"}}, "meta.photons = 'many'; expected a whole number"),
        ({"meta": {"settings": 3}}, "meta.settings = 3; expected a mapping"),
        ({"meta": {"settings": {"k": np.nan}}}, "meta.settings.k = nan is not a finite number"),
        ({"meta": {"profile_sha256": "xyz"}}, "meta.profile_sha256 = 'xyz'; expected hexadecimal"),
        ({"parameters": [1]}, "parameters = [1]; expected a mapping"),
        ({"parameters": {"c0": 3}}, "parameters.c0 = 3; expected a mapping"),
        ({"parameters": {"c0": {"v": "\udcff"}}}, "parameters.c0.v holds half of a character"),
        ({"parameters": {"c0": {"variances_mm2": [1, -1]}}}, "expected variances above 0"),
        ({"parameters": {"c0": {"variances_mm2": 1}}}, "variances_mm2 = 1; expected a list of num"),
        ({"parameters": {"c0": {"weights": ["1"]}}}, "parameters.c0.weights is not an array"),
        ({"parameters": {"c0": {"near_mm2": [1]}}}, "near_mm2 = [1]; expected a number"),
        (
            {"parameters": {"c0": {"variances_mm2": [1], "weights": [1, 2]}}},
            "parameters.c0: variances_mm2 and weights differ in number",
        ),
        ({"scale": [1.0, 1.0]}, "scale has shape (2,); expected (1,)"),
        ({"signs": [[0.5]]}, "signs must be +1 or -1"),
        ({"channels": ("R", "G")}, "2 channel names for 1 channel"),
        (
            {"weights": np.ones((1, 3, 2)), "signs": [[1, 1]], "scale": [1, 1]}
            | {"relative_frobenius_error": [0, 0], "energy_error": [0, 0], "channels": ("R", "R")},
            "channels[1] = 'R' is there twice",
        ),
    ],
)
def test_what_is_no_kernel_is_one_clear_line(changes, fragment):
    with pytest.raises(KernelError) as caught:
        kernel_of(np.ones((1, 2, 1)), **changes)
    assert fragment in str(caught.value)
    assert "\n" not in str(caught.value)


def damaged():
    """Bytes that are no kernel, with what is to be said of them."""
    whole = json.loads(bytes_of(kernel_of(np.ones((2, 3, 2)))))

    def changed(**changes):
        return json.dumps(whole | changes).encode()

    term = whole["terms"][0]
    foreign = ": not a kernel; name a .kernel.json file, as sssfit writes it."
    yield "empty", b"", foreign
    yield (
        "cut",
        bytes_of(kernel_of(np.ones((2, 3, 2))))[:-200],
        "is damaged (not valid JSON, or cut",
    )
    latin = changed(method="x").replace(b'"x"', b'"\xfc"')
    yield "latin", latin, "is damaged (not valid JSON; save it as UTF-8)"
    yield "binary", bytes(range(256)), foreign
    yield "a picture", b"\x89PNG\r\n\x1a\n" + bytes(99), foreign
    yield "deep", b"[" * 100_000, foreign
    yield "an npz", b"PK\x03\x04", foreign
    yield "a list", b"[1, 2]", foreign
    yield "foreign", b'{"asset": {"version": "2.0"}}', foreign
    yield "another", b'{"format": "glTF"}', ": not a kernel: it has format 'glTF'; name a"
    yield "newer", changed(format="sssfit.kernel/2"), "format 'sssfit.kernel/2'; expected"
    for key in ("method", "mm_per_pixel", "channels", "terms", "errors", "scale", "meta"):
        without = {name: whole[name] for name in whole if name != key}
        yield f"no {key}", json.dumps(without).encode(), f"the kernel has no {key}"
    for name, terms in {
        "no terms": [],
        "terms are numbers": [1, 2],
        "no weights": [{"sign": [1, 1]}],
        "ragged": [term, {"sign": [1, 1], "weights": [[1.0, 1.0]]}],
        "words": [term | {"weights": [["a", "b"]] * 5}],
        "null weights": [term | {"weights": [[None, 1.0]] * 5}],
        "one channel": [term | {"weights": [[1.0]] * 5}],
        "signs": [term | {"sign": [1, 3]}],
        "terms are null": None,
    }.items():
        yield name, changed(terms=terms), ""
    yield "errors are null", changed(errors=None), "errors = null; expected an object"
    yield "errors lack one", changed(errors={"energy": [0, 0]}), "errors has no relative_frobenius"
    yield "pitch", changed(mm_per_pixel="wide"), "mm_per_pixel = 'wide'; expected a finite number"
    yield "no pitch", changed(mm_per_pixel=True), "mm_per_pixel = true; expected a finite number"
    yield "huge pitch", changed(mm_per_pixel=10**400), "mm_per_pixel = 1000"
    yield "negative pitch", changed(mm_per_pixel=-1.0), "mm_per_pixel = -1.0"
    yield "parameters", changed(parameters=3), "parameters = 3; expected an object"
    yield "a parameter", changed(parameters={"c0": [1]}), "parameters.c0 = [1]; expected an object"
    yield "meta", changed(meta=["a"]), "meta = ['a']; expected an object"
    yield "meta NaN", changed(meta={"gain": np.nan}), "it holds NaN, which is not a number of JSON"
    yield "meta inf", changed(meta={"gain": -np.inf}), "it holds -Infinity"
    yield "photons", changed(meta={"photons": "1e7"}), "meta.photons = '1e7'; expected a whole"
    yield "no photons", changed(meta={"photons": 0}), "meta.photons = 0; expected 1 to 1e+18"
    yield "digits", changed(meta={"photons": 10**400}), "meta.photons = 1000"
    yield "version", changed(meta={"version": "0\n#error"}), r"meta.version = '0\n#error'; expected"
    yield "material", changed(meta={"material": "\u2029"}), "meta.material = '\\u2029'; expected"
    yield "surrogate", changed(meta={"material": "\ud800"}), "half of a character"
    yield "settings", changed(meta={"settings": "all"}), "meta.settings = 'all'; expected an object"
    yield "channels", changed(channels=7), "channels = 7; expected a list"
    yield "channel names", changed(channels=[1, 2]), "channels[0] = 1; expected a text"
    yield "lines", changed(channels=["R", "G\n"]), r"channels[1] = 'G\n'; expected a text that prin"
    yield "twice", changed(channels=["R", "R"]), "channels = ['R', 'R'] has an entry twice"
    yield "too few", changed(channels=["R"]), "energy has 2 entries; expected 1, one for each chan"
    yield (
        "65 channels",
        changed(channels=[str(k) for k in range(65)]),
        "65 entries; expected 1 to 6",
    )
    yield "method", changed(method=5), "method = 5; expected a text"
    yield (
        "lines of method",
        changed(method="svd\r"),
        r"method = 'svd\r'; expected a text that print",
    )
    yield "rank", changed(rank=3), "rank = 3, but the terms have 2"
    yield "no rank", changed(rank=2.5), "rank = 2.5; expected a whole number"
    yield "pixels", changed(pixels=7), "pixels = 7, but the terms have 5"
    yield (
        "support",
        changed(support_mm=1.0),
        "support_mm = 1.0, but 5 pixels of 0.1 mm reach 0.2 mm",
    )
    yield (
        "a smaller support",
        changed(support_mm=0.1),
        "support_mm = 0.1, but 5 pixels of 0.1 mm reach 0.2 mm",
    )
    yield "a lower rank", changed(rank=1), "rank = 1, but the terms have 2"
    yield "fewer pixels", changed(pixels=3), "pixels = 3, but the terms have 5"
    yield (
        "less energy",
        changed(energy=[49.0, 50.0]),
        "energy[0] = 49.0, but the terms add up to 50",
    )
    yield "energy", changed(energy=[50.0, 51.0]), "energy[1] = 51.0, but the terms add up to 50"
    yield "no energy", changed(energy=[50.0, "50"]), "energy[1] = '50'; expected a finite number"
    yield "scale", changed(scale=[1, -1]), "scale[1] = -1; expected 0 to 1e+18"
    yield "scales", changed(scale=[1, 1, 1]), "scale has 3 entries; expected 2"
    yield (
        "two keys",
        b'{"format": "sssfit.kernel/1", "rank": 1, "rank": 2}',
        "'rank' is there twice",
    )
    many = [row[:] for row in term["weights"]]
    many[3][1] = 1e200
    yield "1e200", changed(terms=[term | {"weights": many}]), "terms[0].weights[3][1] = 1e+200; exp"
    many = [row[:] for row in term["weights"]]
    many[3][1] = True
    yield (
        "true",
        changed(terms=[term | {"weights": many}]),
        "terms[0].weights[3][1] = true; expecte",
    )
    many[3] = [1.0]
    yield "a row", changed(terms=[term | {"weights": many}]), "terms[0].weights[3] has 1 entry"
    yield (
        "a term",
        changed(terms=[term, term | {"weights": many[:3]}]),
        "terms[1].weights has 3 pix",
    )
    yield "a sign", changed(terms=[term | {"sign": [1, True]}]), "terms[0].sign[1] = true; expected"
    yield "NaN", bytes_of(kernel_of(np.ones((1, 2, 1)))).replace(b"1.0", b"NaN"), "it holds NaN"


@pytest.mark.parametrize(
    ("content", "fragment"), [pytest.param(*rest, id=name) for name, *rest in damaged()]
)
def test_damaged_and_foreign_files_are_one_clear_line(tmp_path, content, fragment):
    path = tmp_path / "bad.kernel.json"
    path.write_bytes(content)
    for source in (path, io.BytesIO(content)):
        with pytest.raises(KernelError) as caught:
            SeparableKernel.read(source, "bad.kernel.json")
        assert str(caught.value).startswith("bad.kernel.json: ")
        assert fragment in str(caught.value)
        assert "\n" not in str(caught.value)


def test_cut_files_never_make_a_kernel():
    content = bytes_of(kernel_of(np.ones((2, 3, 1))))
    for length in range(len(content) - 2):  # the last two are the brace and the line's end
        is_marked = b'"sssfit.kernel/' in content[:length]
        said = r"^the kernel: .*cut short" if is_marked else "^the kernel: not a kernel; name"
        with pytest.raises(KernelError, match=said):
            SeparableKernel.read(io.BytesIO(content[:length]))


def test_files_that_cannot_be_read_or_written_are_named(tmp_path):
    with pytest.raises(KernelError, match=r"there\.kernel\.json"):
        SeparableKernel.load(tmp_path / "there.kernel.json")
    with pytest.raises(KernelError, match=str(tmp_path)):
        SeparableKernel.load(tmp_path)
    with pytest.raises(FileError):
        kernel_of(np.ones((1, 2, 1))).save(tmp_path / "no" / "a.kernel.json")
    other = tmp_path / "other.json"
    other.write_text("{}")
    assert not is_kernel_file(other)
