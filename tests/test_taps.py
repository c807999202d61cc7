"""Tables of taps: the record, its file, its cost, and what a shader would render with it."""

import copy
import functools
import io
import json
import pickle
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from reference_taps import as_half, as_light, as_small_float, rendered, stored_as

import sssfit
from sssfit.errors import KernelError, RenderError
from sssfit.kernel import Stage, Taps, is_taps_file, read_kernel
from sssfit.kernel.structure import cost_of_chain, cost_of_terms, parse, text_of
from sssfit.render.separable import render_separable
from sssfit.render.taps import render_taps
from sssfit.render.texels import store_of
from sssfit.scene.record import Scene
from sssfit.shapes import SKIN_WEIGHTS

SCHEMA = json.loads((Path(sssfit.__file__).parent / "taps.schema.json").read_text("utf-8"))
PITCH = 0.3


def stage(rng, level, kind="pair", pairs=1, channels=2):
    """A stage of random numbers, whose fetches add up to 1."""
    many = 2 if kind == "star" else pairs
    offsets = np.cumsum(rng.uniform(0.4, 1.3, many)) * PITCH * 2**level
    weights = rng.uniform(0.1, 1.0, (many + 1, channels))
    copies = 4.0 if kind == "star" else 2.0
    weights /= weights[0] + copies * weights[1:].sum(axis=0)
    return Stage(level, kind, offsets, weights)


def taps_of(structure="1-2|1|1", chained=True, channels=2, seed=1, **changes):
    rng = np.random.default_rng(seed)
    stages = tuple(
        stage(rng, each.level, each.kind, each.pairs, channels) for each in parse(structure)
    )
    fields = {
        "method": "test",
        "mm_per_pixel": PITCH,
        "channels": tuple(f"c{k}" for k in range(channels)),
        "chained": chained,
        "stages": stages,
        "blend": rng.uniform(0.05, 0.4, (len(stages) + 1, channels)),
        "errors": {"spectral": np.full(channels, 0.01), "energy": np.full(channels, np.nan)},
        "meta": {"material": "wax", "settings": {"fetches": 9}},
    }
    return Taps(**(fields | changes))


def bytes_of(taps):
    stream = io.BytesIO()
    taps.write(stream)
    return stream.getvalue()


# Structures and their cost


# Fetches and passes of the trial's tables (physics, section 11).
@pytest.mark.parametrize(
    ("text", "fetches", "passes"),
    [
        ("1-2-3", 33, 6),
        ("1-1-2-2", 36, 8),
        ("3-4-4", 53, 6),
        ("1|1-1|1-1", 13.875, 10),
        ("1|1-2-2", 16.25, 8),
        ("1-1|1-1|1-1", 20.875, 12),
        ("1-1|2-2|2", 22.6875, 10),
        ("1-1|2-2|2-2", 23.375, 12),
        ("1-2|2-2|2-2", 27.375, 12),
        ("1-1|2-2|2-2|2-2", 23.84375, 16),
        ("*|*|*|*", 15.90625, 4),
        ("*|*-*|*-*", 18.75, 5),
        ("*|*-*|*-*|*", 19.03125, 6),
    ],
)
def test_fetches_are_counted_by_the_rule(text, fetches, passes):
    cost = cost_of_chain(parse(text))
    assert (cost.fetches, cost.passes) == (fetches, passes)
    assert cost.all_passes == passes + 2 * text.count("|")
    assert text_of(parse(text)) == text


def test_pictures_of_a_chain_by_hand():
    """1|1: a pair reads and writes twice, at both sizes; halving 5 small texels; adding up."""
    full = 2 * 2 + 2 + 1 / 4 + 1  # the pair; irradiance and its picture; the small sum; written
    small = 2 * 2 + 5  # the pair, whose last picture is at hand; the halving
    assert cost_of_chain(parse("1|1")).pictures == full + small / 4


def test_a_stage_that_is_not_shown_costs_no_fetch_to_add():
    shapes = parse("1-1-1")
    shown = cost_of_chain(shapes).fetches
    assert cost_of_chain(shapes, [False, True, True, True]).fetches == shown - 1
    assert cost_of_chain(shapes, [True, False, True, True]).fetches == shown - 1


def test_terms_share_their_first_pass_where_they_share_offsets():
    one, other = (1.0, 2.0), (1.0, 2.5)
    assert cost_of_terms([one], shows_irradiance=False).fetches == 10
    assert cost_of_terms([one, one], shows_irradiance=False).fetches == 15
    assert cost_of_terms([one, other], shows_irradiance=False).fetches == 20
    assert cost_of_terms([one, one], shows_irradiance=True).fetches == 16


@pytest.mark.parametrize(
    "text", ["", "1-x", "0", "65", "1--1", "1||2", "|1", "1.5", "-1", "1-1|", "²", None, 3]
)
def test_no_structure_is_one_line(text):
    with pytest.raises(KernelError, match=r"^stages = .*expected numbers of tap pairs") as caught:
        parse(text)
    assert "\n" not in str(caught.value)


def test_too_many_stages_or_levels_are_refused():
    with pytest.raises(KernelError, match="25 stages on 1 level"):
        parse("-".join("1" * 25))
    with pytest.raises(KernelError, match="11 stages on 11 levels"):
        parse("|".join("1" * 11))


# The file


@pytest.mark.parametrize("structure", ["1", "1-2|1|1", "*|1-*"])
@pytest.mark.parametrize("channels", [1, 3])
def test_the_file_comes_back_bit_for_bit(tmp_path, structure, channels):
    taps = taps_of(structure, channels=channels)
    taps.save(tmp_path / "a.taps.json")
    back = Taps.load(tmp_path / "a.taps.json")
    assert bytes_of(back) == bytes_of(taps)
    for ours, theirs in zip(back.stages, taps.stages, strict=True):
        assert ours.offsets_mm.tobytes() == theirs.offsets_mm.tobytes()
        assert ours.weights.tobytes() == theirs.weights.tobytes()
    assert back.blend.tobytes() == taps.blend.tobytes()
    jsonschema.validate(json.loads(bytes_of(taps)), SCHEMA)
    assert is_taps_file(tmp_path / "a.taps.json")
    assert isinstance(sssfit.load(tmp_path / "a.taps.json"), Taps)
    assert isinstance(read_kernel(tmp_path / "a.taps.json"), Taps)
    assert isinstance(read_kernel(io.BytesIO(bytes_of(taps))), Taps)


EDITS = {
    "format": ("sssfit.taps/2", "format 'sssfit.taps/2'; expected 'sssfit.taps/1'"),
    "fetches": (9.0, "fetches = 9.0, but the stages take 22.6875"),
    "passes": (9, "passes = 9, but the stages have 8"),
    "all_passes": (13, "all_passes = 13, but the stages have 12"),
    "structure": ("1-1|1|1", "structure = 1-1|1|1, but the stages have 1-2|1|1"),
    "energy": ([0.1, 0.2], "energy[0] = 0.1, but the blend adds up to"),
    "chained": (1, "chained = 1; expected true or false"),
    "channels": (["c0", "c0"], "has an entry twice"),
    "mm_per_pixel": (0, "mm_per_pixel = 0; expected 1e-12 to 1e+12"),
    "blend": ([[0.1, 0.2]], "blend has 1 entry; expected 2 to 25"),
    "method": ("a\nb", "expected a text that prints on one line"),
    "chain": (True, "chain is unknown; did you mean chained? expected format, comment, method"),
    "a\nb": (True, r"'a\nb' is unknown; expected format, comment"),
    "errors": ({"spectral": [0, 0], "energy": [0, 0], "rms": [0, 0]}, "errors.rms is unknown"),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edited_file_is_one_line_that_names_the_place(name):
    value, expected = EDITS[name]
    whole = json.loads(bytes_of(taps_of())) | {name: value}
    with pytest.raises(KernelError) as caught:
        Taps.read(io.BytesIO(json.dumps(whole).encode()), "mine.taps.json")
    said = str(caught.value)
    assert said.startswith("mine.taps.json: ")
    assert expected in said
    assert "\n" not in said


STAGE_EDITS = {
    "level": (2, "the stages have the levels [0, 2, 1, 2]"),
    "kind": ("round", "stages[1].kind = 'round'; expected pair or star or disk"),
    "offsets_mm": ([0.5, 0.4], "stages[1].offsets_mm = [0.5, 0.4]; expected rising ones"),
    "weights": ([[1, 1], [0.1, 0], [0, 0]], "stages[1].weights add up to [1.2, 1.0]"),
    "angles_degrees": (
        45.0,
        "stages[1].angles_degrees is unknown; did you mean angle_degrees? expected level,",
    ),
}


@pytest.mark.parametrize("name", STAGE_EDITS)
def test_an_edited_stage_is_one_line_that_names_it(name):
    value, expected = STAGE_EDITS[name]
    whole = json.loads(bytes_of(taps_of()))
    whole["stages"][1][name] = value
    with pytest.raises(KernelError) as caught:
        Taps.read(io.BytesIO(json.dumps(whole).encode()), "mine.taps.json")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_kernel_is_no_table_of_taps(tmp_path):
    (tmp_path / "a.json").write_text('{"format": "sssfit.kernel/1"}')
    with pytest.raises(KernelError, match=r"not a table of taps.*\.taps\.json"):
        Taps.load(tmp_path / "a.json")


def test_stages_of_terms_are_pairs_on_the_full_picture():
    with pytest.raises(KernelError, match="have the level 0"):
        taps_of("1|1", chained=False)
    with pytest.raises(KernelError, match="are pairs of passes"):
        taps_of("*", chained=False)


def test_it_survives_pickling_and_copying():
    taps = taps_of("1|*")
    for other in (pickle.loads(pickle.dumps(taps)), copy.deepcopy(taps)):
        assert bytes_of(other) == bytes_of(taps)
    with pytest.raises(TypeError):
        taps.errors["energy"] = np.zeros(2)


PYTHON = {
    "errors": ({"energy": np.zeros(2)}, "expected spectral and energy"),
    "stages": (None, "stages = None; expected a list of stages"),
    "chained": (3, "chained = 3; expected True or False"),
    "mm_per_pixel": ("a", "mm_per_pixel is not an array of numbers"),
    "blend": ([[1.0, 1.0]], r"blend has shape (1, 2); expected (5, 2)"),
}


@pytest.mark.parametrize("name", PYTHON)
def test_a_record_made_wrongly_is_one_line(name):
    value, expected = PYTHON[name]
    with pytest.raises(KernelError) as caught:
        taps_of(**{name: value})
    assert expected in str(caught.value)
    with pytest.raises(KernelError, match=r"stages\[0\] = 1; expected a Stage"):
        taps_of(stages=(1,))


def test_a_name_of_two_lines_stays_on_one():
    for read in (Taps.load, read_kernel):
        with pytest.raises(KernelError) as caught:
            read("no\nthing.taps.json")
        assert "\n" not in str(caught.value)
    with pytest.raises(KernelError, match=r"^two\\nlines: not a kernel"):
        read_kernel(io.BytesIO(b"x"), "two\nlines")


@pytest.mark.parametrize("separators", [(",", ":"), (", ", ": ")])
def test_another_programs_json_is_read_alike(tmp_path, separators):
    """The format may come last, and without a space before it."""
    taps = taps_of("1|2")
    whole = json.loads(bytes_of(taps))
    whole["format"] = whole.pop("format")
    text = json.dumps(whole, separators=separators)
    (tmp_path / "a.taps.json").write_text(text, "utf-8")
    for source in (tmp_path / "a.taps.json", io.BytesIO(text.encode())):
        assert bytes_of(read_kernel(source)) == bytes_of(taps)
    assert is_taps_file(tmp_path / "a.taps.json")


def test_what_is_neither_kind_of_kernel_names_both(tmp_path):
    for text, said in (("hi", ""), ('{"format": "x"}', r": it has format 'x'"), ("[]", "")):
        (tmp_path / "a.json").write_text(text, "utf-8")
        with pytest.raises(KernelError, match=f"not a kernel{said}; name a .kernel.json or .taps"):
            read_kernel(tmp_path / "a.json")


def test_a_stream_that_cannot_be_read_is_one_line():
    class Broken(io.RawIOBase):
        def read(self, _size=-1):
            raise OSError(5, "Input/output error")

    with pytest.raises(KernelError, match="the kernel: input/output error"):
        read_kernel(Broken())


def test_its_words():
    taps = taps_of()
    assert repr(taps) == (
        "<Taps of wax by test, 1-2|1|1, 22.69 fetches of 0.3 mm pixels: error c0 1 %, c1 1 %>"
    )
    assert taps.figures()["fetches"] == 22.6875
    with pytest.raises(
        KernelError, match="texel = 'byte'; expected float32, half, half-truncated, r11g11b10"
    ):
        taps.bytes_per_pixel("byte")
    assert taps.bytes_per_pixel("float32") == 2 * taps.bytes_per_pixel("half")


# Rendering


@pytest.mark.parametrize("border", ["mirror", "clamp", "zero"])
@pytest.mark.parametrize(
    ("structure", "chained"),
    [("2", True), ("1-2", True), ("1-2", False), ("1|1|2", True), ("*", True), ("1|*-1", True)],
)
def test_a_picture_is_that_of_single_fetches(structure, chained, border):
    taps = taps_of(structure, chained=chained)
    picture = np.random.default_rng(3).uniform(size=(9, 7))
    ours = render_taps(Scene("noise", picture[..., None], 0.25), taps, border=border)
    for channel in (0, 1):
        slow = rendered(picture, taps, channel, 0.25, border)
        np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-14)


@pytest.mark.parametrize("structure", ["1-2", "1|1|2", "*|*"])
def test_coverage_divides_every_pass(structure):
    taps = taps_of(structure)
    rng = np.random.default_rng(4)
    picture = rng.uniform(size=(8, 9))
    cover = (rng.uniform(size=(8, 9)) > 0.4) * rng.choice([0.5, 1.0], (8, 9))
    ours = render_taps(Scene("noise", picture[..., None], PITCH), taps, coverage=cover)
    for channel in (0, 1):
        slow = rendered(picture, taps, channel, PITCH, "mirror", cover)
        np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-13)


@pytest.mark.parametrize("structure", ["1-2", "1|1|2-2|1", "*|*-*"])
def test_constant_light_on_any_shape_is_a_constant_and_nothing_comes_in(structure):
    taps = taps_of(structure)
    rng = np.random.default_rng(5)
    for _ in range(5):
        cover = (rng.uniform(size=(33, 26)) > 0.6).astype(float)
        picture = np.where(cover > 0, 2.0, 1e6)  # a bright background
        out = render_taps(Scene("shape", picture[..., None], PITCH), taps, coverage=cover)
        inside = out[cover > 0]
        np.testing.assert_allclose(inside, 2.0 * np.broadcast_to(taps.energy, inside.shape), 1e-6)
        assert (out[cover == 0] == 0.0).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (2, 2), (3, 8), (5, 1)])
def test_pictures_smaller_than_the_coarsest_level_keep_constant_light(size):
    taps = taps_of("1|2|1-1|1")
    out = render_taps(Scene("small", np.full((*size, 1), 3.0), PITCH), taps)
    np.testing.assert_allclose(out, 3.0 * np.broadcast_to(taps.energy, out.shape), 1e-12)


@pytest.mark.parametrize("chained", [True, False])
def test_pairs_on_the_full_picture_are_a_separable_kernel(chained):
    blend = np.array([[0.1, 0.2], [0.3, -0.1], [0, 0.2], [0.2, 0.1]])
    taps = taps_of("1-2-2", chained=chained, blend=blend)
    kernel = taps.separable_kernel()
    np.testing.assert_allclose(kernel.energy, taps.energy, rtol=1e-12)
    picture = np.random.default_rng(6).uniform(size=(40, 31, 2))
    scene = Scene("noise", picture, PITCH)
    np.testing.assert_allclose(
        render_taps(scene, taps), render_separable(scene, kernel), rtol=0, atol=1e-14
    )
    with pytest.raises(KernelError, match="turned stages or halved pictures"):
        taps_of("1|1").separable_kernel()


def test_a_chain_of_gaussians_is_the_sum_of_six():
    """d'Eon and Luebke 2007: blurs of v_k - v_(k-1), one on the other, have the variances v_k.

    Samples of Gaussians of 2.2 pixels^2 or more are Gaussians under convolution to e^-43 (Poisson).
    """
    half, x = 64, np.arange(-64, 65)
    steps = np.array([2.2, 4.0, 8.0, 16.0, 30.0, 60.0])
    stages = []
    for step in steps:
        line = np.exp(-(x**2) / (2 * step))[half:]
        weights = np.repeat((line / (line[0] + 2 * line[1:].sum()))[:, None], 3, axis=1)
        stages.append(Stage(0, "pair", np.arange(1.0, half + 1), weights))
    blend = np.concatenate((np.zeros((1, 3)), SKIN_WEIGHTS))
    taps = taps_of(channels=3, mm_per_pixel=1.0, stages=tuple(stages), blend=blend)
    kernel = taps.separable_kernel()
    far = np.arange(-kernel.half_pixels, kernel.half_pixels + 1.0)
    lines = np.array([np.exp(-(far**2) / (2 * each)) for each in np.cumsum(steps)])
    lines /= lines.sum(axis=1, keepdims=True)
    for c in range(3):
        six = np.einsum("t,ti,tj->ij", np.asarray(SKIN_WEIGHTS)[:, c], lines, lines)
        np.testing.assert_allclose(kernel.full(c), six, rtol=0, atol=1e-12)


def test_bad_settings_are_one_line():
    taps, scene = taps_of(), Scene("grey", np.ones((4, 5, 1)), PITCH)
    with pytest.raises(RenderError, match=r"border = 'round'; expected mirror, clamp, zero"):
        render_taps(scene, taps, border="round")
    with pytest.raises(RenderError, match=r"coverage of shape \(5, 4\); expected \(4, 5\)"):
        render_taps(scene, taps, coverage=np.ones((5, 4)))
    with pytest.raises(RenderError, match="numbers from 0 to 1"):
        render_taps(scene, taps, coverage=np.full((4, 5), np.nan))
    with pytest.raises(RenderError, match="the picture has 3 channels and the kernel 2"):
        render_taps(Scene("rgb", np.ones((4, 5, 3)), PITCH), taps)
    with pytest.raises(RenderError, match="dtype = int32"):
        render_taps(scene, taps, dtype=np.int32)
    bright = Scene("sun", np.full((4, 4, 1), 1e39), scene.mm_per_pixel)
    with pytest.raises(RenderError, match=r"sun: light of 1e\+39 is above"):
        render_taps(bright, taps, dtype=np.float32)


# The formats of the pictures between passes


def numbers_of_all_sizes(count=4000):
    """Light from the denormals of a half to its largest, and ties between neighbours."""
    rng = np.random.default_rng(8)
    spread = 2.0 ** rng.uniform(-22, 15.9, count)
    coarse = np.ldexp(rng.integers(0, 2**13, count) / 2.0**13, rng.integers(-16, 16, count))
    return np.concatenate((spread, coarse, [0.0, 2.0**-20, 2.0**-21, 64511.9, 1.0]))


def test_half_is_that_of_the_standard_library():
    values = numbers_of_all_sizes()
    ours = store_of("half", taps_of(channels=1))(values[:, None])[:, 0]
    np.testing.assert_array_equal(ours, [as_half(each) for each in values])


@functools.cache  # of two channels they are the same
def small_floats(mantissa, dtype):
    values = numbers_of_all_sizes().astype(dtype).tolist()
    return [as_small_float(each, mantissa) for each in values]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(("channel", "mantissa"), [(0, 6), (1, 6), (2, 5)])
def test_r11g11b10_is_the_nearest_of_all_its_numbers(channel, mantissa, dtype):
    values = numbers_of_all_sizes().astype(dtype)
    pixels = np.zeros((len(values), 3), dtype)
    pixels[:, channel] = values
    ours = store_of("r11g11b10", taps_of(channels=3))(pixels)
    assert ours.dtype == dtype
    expected = small_floats(mantissa, dtype)
    np.testing.assert_array_equal(ours[:, channel], expected)
    assert (ours[:, [c for c in range(3) if c != channel]] == 0.0).all()


# About a step of each format near 1, with room for sums in another order.
STEPS = {
    "float32": 1e-7,
    "half": 1e-3,
    "half-truncated": 2e-3,
    "r11g11b10": 3e-2,
    "rgba8": 3e-2,
    "srgb8": 6e-2,
}


@pytest.mark.parametrize("name", ["float32", "half", "half-truncated", "r11g11b10"])
def test_numbers_that_a_format_holds_stay_as_they_are(name):
    held = np.array([0.0, 2.0**-14, 0.375, 1.0, 1.5, 63.0, 2.0**15])[:, None] * np.ones(3)
    store = store_of(name, taps_of(channels=3))
    np.testing.assert_array_equal(store(held), held)
    noise = store(np.random.default_rng(9).uniform(0.0, 9.0, (50, 3)))
    np.testing.assert_array_equal(store(noise), noise)


@pytest.mark.parametrize("name", ["rgba8", "srgb8"])
def test_codes_of_8_bits_stay_as_they_are_and_others_go_to_the_nearest(name):
    codes = np.arange(256) / 255.0
    held = np.array([as_light(each) if name == "srgb8" else each for each in codes])
    store = store_of(name, taps_of(channels=3))
    pixels = held[:, None] * np.ones(3)
    np.testing.assert_allclose(store(pixels), pixels, rtol=0.0, atol=1e-15)
    noise = np.random.default_rng(9).uniform(0.0, 1.0, 500)
    slow = stored_as(name, 0)(noise)
    ours = store(noise[:, None] * np.ones(3))[:, 1]
    np.testing.assert_allclose(ours, slow, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    "name", ["float32", "half", "half-truncated", "r11g11b10", "rgba8", "srgb8"]
)
@pytest.mark.parametrize("covered", [False, True])
@pytest.mark.parametrize(
    ("structure", "chained"), [("1-2", True), ("1-2", False), ("1|1|2", True), ("*|1-*", True)]
)
def test_every_picture_between_passes_is_in_the_format(structure, chained, covered, name):
    taps = taps_of(structure, chained=chained, channels=3)
    rng = np.random.default_rng(3)
    picture = rng.uniform(size=(9, 7))
    cover = rng.choice([0.0, 0.5, 1.0], (9, 7)) if covered else None
    scene = Scene("noise", picture[..., None], 0.25)
    ours = render_taps(scene, taps, coverage=cover, intermediate=name)
    exact = render_taps(scene, taps, coverage=cover)
    assert (ours != exact).any()
    for channel in range(3):
        slow = rendered(picture, taps, channel, 0.25, "mirror", cover, name)
        # Sums in another order may round to the neighbour: a step, of few texels.
        apart = np.abs(ours[..., channel] - slow)
        assert np.median(apart) < 1e-14
        assert apart.max() < 0.2 * STEPS[name]


def test_light_beyond_a_formats_range_is_one_line():
    taps = taps_of("1|1", channels=3)
    bright = Scene("sun", np.full((4, 4, 1), 7e4), PITCH)
    for name, most in (("half", "65504"), ("r11g11b10", "65024"), ("srgb8", "1;")):
        with pytest.raises(RenderError, match=f"reaches 7e.04, and {name} holds up to {most}"):
            render_taps(bright, taps, intermediate=name)
    assert np.isfinite(render_taps(bright, taps, intermediate="float32")).all()


def test_formats_that_do_not_fit_a_table_are_one_line():
    scene = Scene("grey", np.ones((4, 5, 1)), PITCH)
    with pytest.raises(RenderError, match="intermediate = 'byte'; expected float32, half, half-tr"):
        render_taps(scene, taps_of(), intermediate="byte")
    with pytest.raises(RenderError, match="r11g11b10 holds 1 or 3 channels, and the table has 2"):
        render_taps(scene, taps_of(), intermediate="r11g11b10")
    signed = taps_of("1-1", chained=False, channels=3, blend=[[0.2] * 3, [0.3] * 3, [-0.1] * 3])
    with pytest.raises(RenderError, match="no sign, and the table has weights below 0"):
        render_taps(scene, signed, intermediate="r11g11b10")
    render_taps(scene, signed, intermediate="half")


# Weights below 0


def signed_taps():
    """Terms whose fetches have both signs, as a decomposition's; the whole kernel is positive."""
    taps = taps_of("2-2", chained=False)
    wide = Stage(
        0, "pair", taps.stages[0].offsets_mm, np.array([[0.7, 0.5], [0.2, 0.3], [-0.05] * 2])
    )
    return taps_of(
        "2-2", chained=False, stages=(wide, taps.stages[1]), blend=[[0.1] * 2, [0.5] * 2, [0.2] * 2]
    )


def test_light_and_coverage_are_divided_once_where_weights_are_below_0():
    taps = signed_taps()
    rng = np.random.default_rng(4)
    picture = rng.uniform(size=(8, 9))
    cover = (rng.uniform(size=(8, 9)) > 0.4) * rng.choice([0.5, 1.0], (8, 9))
    ours = render_taps(Scene("noise", picture[..., None], PITCH), taps, coverage=cover)
    for channel in (0, 1):
        light = rendered(picture * cover, taps, channel, PITCH)
        part = rendered(cover, taps, channel, PITCH)
        slow = np.where(cover > 0.0, taps.energy[channel] * light / part, 0.0)
        np.testing.assert_allclose(ours[..., channel], slow, rtol=0, atol=1e-13)


def test_weights_below_0_keep_constant_light_on_any_shape():
    taps = signed_taps()
    cover = (np.random.default_rng(5).uniform(size=(33, 26)) > 0.6).astype(float)
    picture = np.where(cover > 0, 2.0, 1e6)
    out = render_taps(Scene("shape", picture[..., None], PITCH), taps, coverage=cover)
    inside = out[cover > 0]
    np.testing.assert_allclose(inside, 2.0 * np.broadcast_to(taps.energy, inside.shape), 1e-6)
    assert (out[cover == 0] == 0.0).all()
