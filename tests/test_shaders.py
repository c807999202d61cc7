"""Exported passes, compiled and run on a software driver, against the renderer pixel by pixel."""

import re
import shutil
import subprocess
import tempfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference_taps import fetch, gathered, passes_of, turn_of
from shader_runs import NUMBERS, device_of, glsl_program, hlsl_source, needs, run, spirv_of
from test_disk import disk_of
from test_export import small_kernel
from test_taps import signed_taps, taps_of
from test_turned import turned
from turns import in_turn

from sssfit.errors import KernelError
from sssfit.export import DIALECTS, Style, kernel_text, source
from sssfit.export.passes import fetches_of, pass_list
from sssfit.export.through import through_table
from sssfit.render.jitter import Jitter
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import render_taps
from sssfit.render.transmittance import beyond
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

PITCH = 0.3
RUN = ("hlsl", "glsl", "wgsl")
PLAIN = Style(normalized=False)
STRUCTURES = ("1", "3", "1-2|3|2", "*|1-*|*", "1-1|1-2|2-2")
SIZES = ((37, 50), (64, 64), (1, 9), (3, 2))


TABLES = [  # one of each kind
    *((each, taps_of(each, channels=3)) for each in STRUCTURES),
    ("two terms", taps_of("2-1", channels=3, chained=False)),
    ("three terms", taps_of("2-1-3", channels=3, chained=False)),
    ("a disk", disk_of(9)),
    ("lines", turned("2-2-2", ["@0", "@60", "@120"], channels=3)),
    ("turned", turned("1-1|1-2", ["@45", "@135", "x30", ""], channels=3)),
]


def light_of(size, channels, seed=1):
    return np.random.default_rng(seed).random((*size, channels))


def of_two_materials():
    return [
        taps_of("1-1|2", channels=3, seed=seed, meta={"material": name})
        for seed, name in ((3, "wax"), (4, "leaf"))
    ]


def rendered(light, taps, **more):
    return render_taps(Scene("light", light, PITCH), taps, border="clamp", **more)


def apart(found, wanted):
    """The largest difference, as a share of the largest value."""
    return np.abs(found - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize(("name", "taps"), TABLES)
def test_the_passes_have_the_fetches_of_the_table(name, taps):
    passes = pass_list(taps)
    assert fetches_of(passes) == pytest.approx(taps.fetches, rel=1e-12)
    assert len(passes) == taps.cost.all_passes
    held = {"E"}
    for each in passes:
        assert {each.reads, *(picture for picture, _ in each.adds)} <= held, name
        held |= set(each.writes)
    assert passes[-1].writes == ("M0",)


@pytest.mark.parametrize(("name", "taps", "dialect"), in_turn(TABLES, RUN))
def test_they_show_what_the_renderer_shows(name, taps, dialect):
    light = light_of((37, 50), len(taps.channels))
    found = run(source([taps], DIALECTS[dialect], PLAIN), dialect, taps, light, PITCH)
    assert apart(found, rendered(light, taps)) < 1e-5, name


@pytest.mark.parametrize(("size", "dialect"), in_turn([(each,) for each in SIZES], RUN))
def test_pictures_of_any_size_are_halved_alike(size, dialect):
    taps, light = taps_of("1-2|3|2", channels=3), light_of(size, 3)
    found = run(source([taps], DIALECTS[dialect], PLAIN), dialect, taps, light, PITCH)
    assert apart(found, rendered(light, taps)) < 1e-5


@pytest.mark.parametrize(("name", "dialect"), in_turn(["disk", "edge", "head"], RUN))
def test_scenes(name, dialect):
    scene = make_scene(name, height=96, width=96, mm_per_pixel=PITCH)
    taps = taps_of("1-1|2-2|2-2", channels=3)
    text = source([taps], DIALECTS[dialect], PLAIN)
    light = np.repeat(scene.irradiance, 3, axis=2)
    assert apart(run(text, dialect, taps, light, PITCH), rendered(light, taps)) < 1e-5
    found = run(text, dialect, taps, light, PITCH, half=True)
    assert apart(found, rendered(light, taps, intermediate="half-truncated")) < 2e-3


def disk_mask():
    y, x = np.mgrid[:45, :50]
    return (np.hypot(y - 20, x - 27) < 14).astype(float)


def terms_of_one_pass():
    """Two terms with the same offsets, which share their first pass."""
    taps = taps_of("2-2", channels=3, chained=False)
    one, other = taps.stages
    return replace(taps, stages=(one, replace(other, offsets_mm=one.offsets_mm)))


@pytest.mark.parametrize(
    ("taps", "dialect"),
    in_turn(
        [
            *(taps_of(each, channels=3) for each in ("1", "1-2|3|2", "*|1-*|*")),
            taps_of("2-1", channels=3, chained=False),
            terms_of_one_pass(),
        ],
        RUN,
    ),
)
def test_light_stays_within_a_mask(taps, dialect):
    light = light_of((45, 50), 3)
    cover = disk_mask()
    style = Style(normalized=False, features=("COVERAGE",))
    text = source([taps], DIALECTS[dialect], style)
    found = run(text, dialect, taps, light, PITCH, cover=cover)
    assert apart(found * cover[..., None], rendered(light, taps, coverage=cover)) < 1e-5
    bright = np.where(cover[..., None] > 0.0, light, 1e4)
    again = run(text, dialect, taps, bright, PITCH, cover=cover)
    np.testing.assert_array_equal(again, found)
    ones = run(text, dialect, taps, np.ones((45, 50, 3)), PITCH, cover=cover)
    inside = cover > 0.0
    np.testing.assert_allclose(ones[inside], np.ones((inside.sum(), 1)) * taps.energy, rtol=1e-5)


DEEP = Style(normalized=False, features=("DEPTH",))
FOLLOWED = [  # one of each kind
    *((each, taps_of(each, channels=3)) for each in ("1", "*|1-*|*", "1-1|2-2|2-2")),
    ("terms", taps_of("2-1-1", channels=3, chained=False)),
    ("turned", turned("1-1|1-2", ["@45", "@135", "x30", ""], channels=3)),
]


def on_screen(scene, taps, dialect):
    """A scene of one object by its shader and by the renderer, on the object's pixels."""
    inside = scene.mask == 1
    depth = np.where(inside, scene.depth_mm, 1.0).astype(np.float32).astype(float)
    light = np.repeat(scene.irradiance, 3, axis=2)
    found = run(
        source([taps], DIALECTS[dialect], DEEP),
        dialect,
        taps,
        light,
        scene.mm_per_pixel / scene.distance_mm,
        cover=inside.astype(float),
        depth=depth,
    )
    own = {"depth_mm": depth, "irradiance": light, "mask": inside.astype(np.int32)}
    scene = replace(scene, specular=None, **own)
    wanted = render_screen_taps(scene, taps, border="clamp")
    return found[inside], wanted[inside]


def step_of():
    """A rough slope with a step of 6 mm along a slanted line and pits as deep, seen from 300 mm.

    The object reaches two sides of a picture whose odd sizes are halved twice.
    """
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:45, :50]
    depth = 300.0 + 0.05 * x - 0.1 * y + 0.02 * rng.normal(size=x.shape)
    depth += 6.0 * ((x > 18 + 0.3 * y) | (rng.random(x.shape) < 0.02))
    mask = (np.hypot(y - 27, x - 32) < 20).astype(np.int32)
    more = {"distance_mm": 300.0, "depth_mm": depth, "mask": mask}
    return Scene("step", rng.random((45, 50, 1)), PITCH, **more)


@pytest.mark.parametrize(("name", "taps", "dialect"), in_turn(FOLLOWED, RUN))
def test_depth_is_followed_as_in_the_renderer(name, taps, dialect):
    assert apart(*on_screen(step_of(), taps, dialect)) < 1e-5, name
    head = make_scene("head", height=96, width=96, mm_per_pixel=PITCH)
    assert apart(*on_screen(head, taps, dialect)) < 1e-5, name


def widened(taps, by):
    """The same table for larger pixels."""
    stages = (replace(each, offsets_mm=by * each.offsets_mm) for each in taps.stages)
    return replace(taps, mm_per_pixel=by * taps.mm_per_pixel, stages=tuple(stages))


@pytest.mark.parametrize(("name", "taps", "dialect"), in_turn(FOLLOWED, RUN))
def test_depth_of_a_whole_head(name, taps, dialect):
    """At 96 x 96 pixels a silhouette falls by 10 mm a pixel, many deviations of a stage.

    Half a step of the last bit of depth, 3e-5 mm at 600 mm, then moves the renderer itself by up
    to 1.1e-5 at the worst pixel, and the shader rounds the depth of each level: measured 2.6e-5
    there, and 5e-7 at the 99th percentile.
    """
    head = make_scene("head", height=96, width=96, mm_per_pixel=2.0)
    found, wanted = on_screen(head, widened(taps, 2.0 / PITCH), dialect)
    errors = np.abs(found - wanted).max(axis=1) / wanted.max()
    assert np.quantile(errors, 0.99) < 2e-6, name
    assert errors.max() < 5e-5, name


@pytest.mark.parametrize("dialect", RUN)
def test_constant_light_stays_constant_on_every_surface(dialect):
    scene, taps = step_of(), FOLLOWED[2][1]
    found, _ = on_screen(replace(scene, irradiance=np.full((45, 50, 1), 2.0)), taps, dialect)
    np.testing.assert_allclose(found, 2.0 * np.broadcast_to(taps.energy, found.shape), rtol=1e-5)


@pytest.mark.parametrize("dialect", ["hlsl", "glsl"])  # the third has no preprocessor
@pytest.mark.parametrize(("name", "taps"), FOLLOWED)
def test_depth_can_be_switched_off(name, taps, dialect):
    text, light = source([taps], DIALECTS[dialect], DEEP), light_of((37, 50), 3)
    off, depth = f"#define SSS_DEPTH 0\n{text}", np.full((37, 50), 7.0)
    found = run(off, dialect, taps, light, PITCH, depth=depth)
    assert apart(found, rendered(light, taps)) < 1e-5, name


@pytest.mark.parametrize("dialect", RUN)
def test_depth_of_several_materials(dialect):
    every = of_two_materials()
    text, _ = kernel_text(every, dialect, depth=True, keep_energy=True)
    scene = step_of()
    light, cover = np.repeat(scene.irradiance, 3, axis=2), (scene.mask > 0).astype(float)
    depth = scene.depth_mm.astype(np.float32).astype(float)
    scene = replace(scene, irradiance=light, depth_mm=depth)
    for k, taps in enumerate(every):
        view = {"cover": cover, "depth": depth, "profile": k}
        found = run(text, dialect, taps, light, PITCH / 300.0, **view)
        wanted = render_screen_taps(scene, taps, border="clamp")
        assert apart(found[cover > 0.0], wanted[cover > 0.0]) < 1e-5


@pytest.mark.parametrize(("name", "taps"), FOLLOWED)
def test_passes_with_depth_read_what_was_written(name, taps):
    held = {"E", "D0"}
    for each in pass_list(taps, depth=True):
        assert set(each.pictures) <= held, name
        held |= set(each.writes)
    text, _ = kernel_text(taps, "hlsl", depth=True)
    assert f"{fetches_of(pass_list(taps, depth=True)):.6g} fetches a pixel with those of" in text


@pytest.mark.parametrize("depth", [False, True])
@pytest.mark.parametrize(("name", "taps"), FOLLOWED)
def test_the_list_names_the_stage_of_every_function_that_takes_one(name, taps, depth):
    text, _ = kernel_text(taps, "hlsl", depth=depth)
    taking = set(re.findall(r"(SSS_\w+)\(uint stage", text)) - {"SSS_Near", "SSS_Larger"}
    rows = re.findall(r"^// (SSS_\w+)(?:\((\d+).*?\))? {2}.* 1(?:/(\d+))? ", text, re.MULTILINE)
    assert {call for call, stage, _ in rows if stage} == taking, name
    for call, stage, size in rows:
        if call == "SSS_Halve" and depth:
            sizes = [2**each.level for each in taps.stages]
            assert sizes.index(int(size)) == int(stage), name


def test_the_comment_says_what_fetching_depth_needs():
    taps = FOLLOWED[2][1]
    for dialect, needed in {"wgsl": "float32-filterable", "glsl": "OES_texture_float_lin"}.items():
        assert needed in kernel_text(taps, dialect, depth=True)[0]
        assert needed not in kernel_text(taps, dialect)[0]


@pytest.mark.parametrize("dialect", RUN)
def test_the_switch_of_depth_is_in_no_source_that_did_not_ask(dialect):
    for _, taps in TABLES:
        assert "DEPTH" not in kernel_text(taps, dialect, coverage=True)[0]


def test_depth_needs_sums_that_do_not_vanish():
    with pytest.raises(KernelError, match="disk of fetches serves flat pictures only"):
        kernel_text(disk_of(9), "hlsl", depth=True)
    with pytest.raises(KernelError, match="weights below 0 could make the sum of a pass vanish"):
        kernel_text(signed_taps(), "hlsl", depth=True)


@pytest.mark.parametrize("dialect", RUN)
@pytest.mark.parametrize("depth", [False, True])
def test_a_size_that_adds_nothing_of_its_own(dialect, depth):
    blend = np.array([[0.0] * 3, [0.0] * 3, [0.0] * 3, [0.7, 0.5, 0.4]])
    taps = taps_of("1|2|1", channels=3, blend=blend)
    if depth:
        assert apart(*on_screen(step_of(), taps, dialect)) < 1e-5
        return
    light = light_of((37, 50), 3)
    found = run(source([taps], DIALECTS[dialect], PLAIN), dialect, taps, light, PITCH)
    assert apart(found, rendered(light, taps)) < 1e-5


def test_coverage_needs_sums_that_do_not_vanish():
    with pytest.raises(KernelError, match="could make the sum of a pass vanish at a mask's border"):
        kernel_text(signed_taps(), "hlsl", coverage=True)
    assert "keep coverage for other tables" in kernel_text(signed_taps(), "hlsl")[0]


@pytest.mark.parametrize("dialect", RUN)
@pytest.mark.parametrize("frame", [0, 3])
def test_a_disk_turns_as_in_the_renderer(frame, dialect):
    taps = disk_of(9)
    light = light_of((37, 50), len(taps.channels))
    text = source([taps], DIALECTS[dialect], PLAIN)
    found = run(text, dialect, taps, light, PITCH, frame=frame)
    assert apart(found, rendered(light, taps, frame=frame)) < 1e-5


JITTERED = Style(normalized=False, features=("JITTER",))
MOVED = [  # one of each kind of pass, with stars beside them
    *((each, taps_of(each, channels=3)) for each in ("3", "1-4|3", "*|1-*|2")),
    ("terms", taps_of("2-1-4", channels=3, chained=False)),
    ("terms of one pass", terms_of_one_pass()),
    ("lines", turned("2-2-2", ["@0", "@60", "@120"], channels=3)),
    ("turned", turned("1-1|1-2", ["@45", "@135", "x30", ""], channels=3)),
]


@pytest.mark.parametrize(("name", "taps", "dialect"), in_turn(MOVED, RUN))
def test_jittered_taps_lie_where_the_renderer_puts_them(name, taps, dialect):
    light, text = light_of((37, 50), 3), source([taps], DIALECTS[dialect], JITTERED)
    seen = []
    for frame in (0, 3):
        found = run(text, dialect, taps, light, PITCH, frame=frame, jitter=True)
        wanted = rendered(light, taps, frame=frame, jitter=Jitter())
        assert apart(found, wanted) < 1e-5, name
        seen.append(wanted)
    assert apart(*seen) > 1e-3
    assert apart(seen[0], rendered(light, taps)) > 1e-3


@pytest.mark.parametrize("dialect", RUN)
def test_jittered_taps_stay_within_a_mask_and_follow_depth(dialect):
    taps, light, cover = taps_of("1-4|3", channels=3), light_of((45, 50), 3), disk_mask()
    style = Style(normalized=False, features=("COVERAGE", "JITTER"))
    wanted = rendered(light, taps, coverage=cover, frame=2, jitter=Jitter())
    view = {"cover": cover, "frame": 2, "jitter": True}
    text = source([taps], DIALECTS[dialect], style)
    found = run(text, dialect, taps, light, PITCH, **view)
    assert apart(found * cover[..., None], wanted) < 1e-5
    text = source([taps], DIALECTS[dialect], Style(normalized=False, features=("DEPTH", "JITTER")))
    level = np.full(cover.shape, 300.0)
    found = run(text, dialect, taps, light, PITCH / 300.0, depth=level, **view)
    assert apart(found, wanted) < 1e-5


@pytest.mark.parametrize("dialect", RUN)
def test_jittered_taps_turn_on_a_tilted_surface(dialect):
    """The outer pair turns in mm of the surface, where a pixel is twice as wide as it is high."""
    line = replace(taps_of("3", channels=3).stages[0], kind="line")
    taps = replace(taps_of("3", channels=3), stages=(line,))
    style = Style(normalized=False, features=("JITTER",), tilted=True)
    light = light_of((37, 25), 3)
    text = source([taps], DIALECTS[dialect], style)
    found = run(text, dialect, taps, light, (2.0 * PITCH, PITCH), frame=1, jitter=True)
    at = turned_fetches(line, 7, 12, frame=1)
    wanted = taps.blend[0] * light[12, 7]
    for weights, down, right in at:
        place = 12 + down / PITCH, 7 + right / (2.0 * PITCH)
        wanted = wanted + taps.blend[1] * weights * [
            fetch(light[..., c], *place, "clamp") for c in range(3)
        ]
    np.testing.assert_allclose(found[12, 7], wanted, rtol=1e-5)


def turned_fetches(line, x, y, frame):
    """Weights and places [mm], down and right, of the fetches of a jittered line of one pixel."""
    jitter, pairs = Jitter(), len(line.offsets_mm)
    angle = np.radians(jitter.degrees) * (turn_of(x, y, frame) / np.pi - 1.0)
    longer = 1.0 + jitter.scale * (turn_of(x + 613, y + 977, frame) / np.pi - 1.0)
    yield line.weights[0], 0.0, 0.0
    for k, (offset, weights) in enumerate(zip(line.offsets_mm, line.weights[1:], strict=True)):
        r, a = (offset, 0.0) if k < jitter.still(pairs) else (longer * offset, angle)
        for side in (-r, r):
            yield weights, side * np.sin(a), side * np.cos(a)


@pytest.mark.parametrize("dialect", ["hlsl", "glsl"])  # the third has no preprocessor
@pytest.mark.parametrize(("name", "taps"), MOVED)
def test_jitter_can_be_switched_off(name, taps, dialect):
    off = f"#define SSS_JITTER 0\n{source([taps], DIALECTS[dialect], JITTERED)}"
    light = light_of((37, 50), 3)
    found = run(off, dialect, taps, light, PITCH, frame=3, jitter=True)
    assert apart(found, rendered(light, taps)) < 1e-5, name


def test_jitter_is_in_no_source_that_did_not_ask_and_needs_taps_that_can_move():
    for _, taps in TABLES:
        assert "JITTER" not in kernel_text(taps, "hlsl")[0]
    with pytest.raises(KernelError, match="a disk turns its fetches for each pixel already"):
        kernel_text(disk_of(9), "hlsl", jitter=True)
    with pytest.raises(KernelError, match=r"\*\|\* has stars alone, and jitter moves the outer"):
        kernel_text(taps_of("*|*", channels=3), "hlsl", jitter=True)


STEEP = PITCH / np.cos(np.radians(60.0))  # mm that a pixel covers of a plane tilted by so much


def along_axes(taps, right_mm, down_mm):
    """The same blur on square pixels: a pass each, with offsets in mm of a pixel's own side."""
    stages, blend = [], [taps.blend[0]]
    for stage, share in zip(taps.stages, taps.blend[1:], strict=True):
        for down, right in stage.directions:
            steps = down / down_mm, right / right_mm
            angle, longer = np.degrees(np.arctan2(*steps)), PITCH * np.hypot(*steps)
            own = {"kind": "line", "angle_degrees": float(angle % 180.0)}
            stages.append(replace(stage, offsets_mm=longer * stage.offsets_mm, **own))
            blend.append(0.0 * share)
        blend[-1] = share
    return replace(taps, stages=tuple(stages), blend=np.array(blend))


@pytest.mark.parametrize("mm", [(STEEP, PITCH), (PITCH, STEEP)])
@pytest.mark.parametrize(
    ("taps", "dialect"),
    in_turn(
        [
            *(taps_of(each, channels=3) for each in ("3", "1-1|1-2|2-2")),
            turned("1-1|1-2", ["@45", "@135", "x30", ""], channels=3),
        ],
        RUN,
    ),
)
def test_a_plane_tilted_by_60_degrees(taps, mm, dialect):
    """Offsets along either axis in mm of the surface, as passes of their own in the renderer."""
    text = source([taps], DIALECTS[dialect], Style(normalized=False, tilted=True))
    light = light_of((37, 50), 3)
    found = run(text, dialect, taps, light, mm)
    wanted = rendered(light, along_axes(taps, *mm))
    assert apart(found, wanted) < 1e-5
    facing = run(text, dialect, taps, light, (PITCH, PITCH))
    assert apart(facing, rendered(light, taps)) < 1e-5
    assert apart(facing, wanted) > 1e-2


@pytest.mark.parametrize("dialect", RUN)
def test_stars_on_a_tilted_plane(dialect):
    taps, light = taps_of("*", channels=3), light_of((9, 11), 3)
    text = source([taps], DIALECTS[dialect], Style(normalized=False, tilted=True))
    found = run(text, dialect, taps, light, (STEEP, PITCH))
    for c in range(3):
        (fetches,) = passes_of(taps.stages[0], c, 1.0)
        places = [(w, y / PITCH, x / STEEP) for w, y, x in fetches]
        blurred = gathered(light[..., c], places, "clamp")
        wanted = taps.blend[0, c] * light[..., c] + taps.blend[1, c] * blurred
        assert apart(found[..., c], wanted) < 1e-5


def test_a_slope_is_not_followed_twice():
    with pytest.raises(KernelError, match="depth are narrower on a slope already; export with"):
        kernel_text(taps_of("1", channels=3), "hlsl", depth=True, tilt=True)


@pytest.mark.parametrize("dialect", RUN)
def test_several_materials_in_one_table(dialect):
    every = of_two_materials()
    text, _ = kernel_text(every, dialect, prefix="SKIN")
    light = light_of((37, 50), 3)
    for k, taps in enumerate(every):
        found = run(text, dialect, taps, light, PITCH, profile=k, prefix="SKIN")
        assert apart(found * taps.energy, rendered(light, taps)) < 1e-5


@pytest.mark.parametrize("dialect", RUN)
def test_another_pixel_size_and_one_channel(dialect):
    taps, light = taps_of("1|2", channels=1), light_of((33, 40), 1)
    text = source([taps], DIALECTS[dialect], PLAIN)
    found = run(text, dialect, taps, light, 0.19, whole=True)
    wanted = render_taps(Scene("light", light, 0.19), taps, border="clamp")
    assert apart(found[..., :3], wanted) < 1e-5  # grey


def test_the_comment_says_where_fewer_channels_than_three_are():
    said = {1: "the one channel, c0, is read in red and written as grey", 2: "c1 in green; blue is"}
    for channels, words in said.items():
        text, _ = kernel_text(taps_of("1", channels=channels), "glsl")
        assert words in text
        assert words not in kernel_text(taps_of("1", channels=3), "glsl")[0]


@pytest.mark.parametrize("depth", [False, True])
@pytest.mark.parametrize(("name", "taps"), FOLLOWED)
def test_hlsl_vectors_name_every_component(name, taps, depth):
    """Compilers of Direct3D refuse float3(1.0), which glslang lets pass."""
    text, _ = kernel_text(taps, "hlsl", depth=depth)
    code = re.sub(r"\b[A-Z]\w*<?\w*>? \w+\(.*\{", "", text)
    assert not re.findall(r"float[234]\((?:[^(),]|\([^()]*\))*\)", code), name


THROUGH = Style(normalized=False, features=("TRANSMITTANCE",))


def through_of(text, dialect, channels, step_mm, *more):
    """What a shader's function says of thicknesses from half a step on."""
    thickness = (np.arange(300) + 0.5) * step_mm
    call = ", ".join([f"{step_mm:.9g} * position.x", *more])
    kind = {"hlsl": "float4", "glsl": "vec4", "wgsl": "vec4f"}[dialect]
    zeros = ", 0.0" * (4 - channels)
    device = device_of(dialect)
    (target,), draw = device.prepare(
        text, f"{kind}(SSS_Through({call}){zeros})", [], (300, 1), NUMBERS,
        count=1, onto=None, half=False, prefix="SSS",
    )  # fmt: skip
    draw(1.0)
    return thickness, device.pixels(target)[0, :, :channels]


def rows_of(text, name):
    """The numbers of an array of shader source."""
    body = re.search(rf"{name}(?:\[\d+\])? = [^;]*?[({{]\n?(.*?)\n?[)}}];", text, re.DOTALL)[1]
    return np.array(re.findall(r"(?<![\w.])\d+\.\d+(?:e-?\d+)?", body), float)


@pytest.mark.parametrize("dialect", RUN)
@pytest.mark.parametrize("channels", [1, 3])
def test_light_through_a_thickness(dialect, channels):
    needs(dialect)
    taps = taps_of("1-1|2-2|2-2", channels=channels)
    text = source([taps], DIALECTS[dialect], THROUGH)
    thickness, found = through_of(text, dialect, channels, 0.05)
    mm = rows_of(text, "SSS_THROUGH_MM")
    shares = rows_of(text, "SSS_THROUGH").reshape(len(mm), channels)
    table = np.column_stack([np.interp(thickness, mm, each) for each in shares.T])
    assert np.abs(found - table).max() < 1e-5
    stated = float(re.search(r"largest error is ([\d.e-]+), of 1", text)[1])
    error = np.abs(found - beyond(taps, thickness)).max()
    assert 0.2 * stated < error < 1.06 * stated + 1e-5  # two digits are printed
    assert stated < 0.02


@pytest.mark.parametrize("dialect", RUN)
def test_light_through_several_materials(dialect):
    needs(dialect)
    every = of_two_materials()
    text, _ = kernel_text(every, dialect, transmittance=True)
    for k, taps in enumerate(every):
        thickness, found = through_of(text, dialect, 3, 0.02, f"{k}u")
        assert np.abs(found - beyond(taps, thickness)).max() < 0.02


def test_light_through_a_thickness_is_written_where_it_is_asked_for():
    taps = taps_of("1", channels=3)
    assert "hrough(" not in kernel_text(taps, "hlsl")[0]
    assert "\n#define SSS_TRANSMITTANCE 1\n" in kernel_text(taps, "hlsl", transmittance=True)[0]


@pytest.mark.parametrize("switch", ["coverage", "depth", "jitter", "tilt", "transmittance"])
def test_a_switch_needs_passes(switch):
    words = f"^{switch}: only passes have this, .* not written; leave out `without_shader`.$"
    with pytest.raises(KernelError, match=words):
        kernel_text(taps_of("1", channels=3), "hlsl", without_shader=True, **{switch: True})


def test_a_kernel_without_light_lets_none_through():
    blend = np.zeros((2, 3))
    table = through_table(taps_of("1", channels=3, blend=blend))
    assert (np.diff(table.thickness_mm) > 0.0).all()
    assert not table.share.any()
    assert table.error == 0.0


@settings(max_examples=8, deadline=None)
@given(
    groups=st.lists(
        st.lists(st.sampled_from(["1", "2", "3", "*"]), min_size=1, max_size=2),
        min_size=1,
        max_size=3,
    ),
    channels=st.integers(1, 3),
)
def test_any_structure_compiles(groups, channels):
    needs("hlsl")
    taps = taps_of("|".join("-".join(each) for each in groups), channels=channels)
    for dialect in ("hlsl", "glsl"):
        assert_compiles(source([taps], DIALECTS[dialect], Style()), dialect, taps)


def assert_compiles(text, dialect, taps):
    """Every function that a pass calls, to SPIR-V that spirv-val accepts."""
    last = pass_list(taps)[-1]
    reads = list(dict.fromkeys((last.reads, *(name for name, _ in last.adds))))
    pictures = [f"t{k}" for k in range(len(reads))]
    sampler = [] if dialect == "glsl" else ["bilinear"]
    scale = [] if last.kind == "sum" else ["mm.x"]
    call = f"SSS_{last.name}({', '.join([*pictures, *sampler, 'position', 'texel', *scale])})"
    make = glsl_program if dialect == "glsl" else hlsl_source
    with tempfile.TemporaryDirectory() as folder:
        spirv_of(make(text, call, len(reads), 1, "SSS"), folder, dialect)


def declared(text):
    """Name, length and number of values of each array."""
    text = re.sub(" //.*", "", text)
    pattern = r"(\w+)\[(\d+)\](?:\[\d+\])? = (?:\w+\[\d+\]\()?\{?(.*?)\}?\)?;\n"
    for name, length, body in re.findall(pattern, text, re.DOTALL):
        vectors = len(re.findall(r"(?:float\d|vec\d)\(|\{", body))
        yield name, int(length), vectors or len([each for each in body.split(",") if each.strip()])


@pytest.mark.parametrize("dialect", ["hlsl", "glsl", "c"])
@pytest.mark.parametrize(("name", "taps"), TABLES)
def test_arrays_have_as_many_values_as_they_declare(name, taps, dialect):
    """The compiler does not count them."""
    found = list(declared(source([taps], DIALECTS[dialect], Style(with_passes=False))))
    assert {"SSS_FIRST", "SSS_WEIGHT", "SSS_BLEND"} <= {each for each, *_ in found}
    for array, length, values in found:
        assert values == length, (name, array)


@pytest.mark.parametrize(("name", "taps"), TABLES)
def test_c_prints_the_same_numbers(name, taps, tmp_path):
    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")
    channels, rows = len(taps.channels), sum(len(each.weights) for each in taps.stages)
    (tmp_path / "table.h").write_text(source([taps], DIALECTS["c"], PLAIN), "utf-8")
    used = ("STAGES", "LEVEL", "KIND", "FIRST", "MM_PER_PIXEL", "BLEND")
    places = "SSS_PLACE_MM" if taps.is_disk else "SSS_OFFSET_MM"
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "table.h"\nint main(void) {\n'
        + "".join(f"(void)SSS_{each};" for each in used)
        + f"(void){places};\nfor (int i = 0; i < {rows}; i++) for (int c = 0; c < {channels}; c++)"
        ' printf("%.9g\\n", (double)SSS_WEIGHT[i][c]);\nreturn 0; }\n'
    )
    flags = ["-std=c99", "-Wall", "-Werror", "-pedantic"]
    program = tmp_path / "program"
    subprocess.run(["gcc", *flags, "-o", program, tmp_path / "main.c"], check=True)
    printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
    weights = np.concatenate([each.weights for each in taps.stages]).astype(np.float32)
    np.testing.assert_array_equal(np.array(printed, np.float32), weights.ravel(), name)


def single_pair():
    """A pre-integrated pass on 25 taps: one stage, without a share of the irradiance."""
    blend = np.array([[0.0] * 3, [0.7, 0.5, 0.4]])
    return replace(taps_of("12", channels=3, chained=False), blend=blend)


@pytest.mark.parametrize(
    ("taps", "most"),
    [
        (single_pair(), 60),
        (taps_of("1-1|2-2|2-2", channels=3), 140),
        (taps_of("1-1|1-2|2-2|2-2", channels=3), 140),  # that of the default fit
    ],
)
@pytest.mark.parametrize("dialect", RUN)
def test_it_is_as_short_as_a_reader_can_take_in(taps, most, dialect):
    assert len(kernel_text(taps, dialect)[0].splitlines()) < most


@pytest.mark.parametrize("dialect", RUN)
def test_a_single_pair_of_unit_energy_needs_no_blend(dialect):
    taps, light = single_pair(), light_of((37, 50), 3)
    text, _ = kernel_text(taps, dialect)
    assert "BLEND" not in text
    found = run(text, dialect, taps, light, PITCH, normalized=True)
    assert apart(found * taps.energy, rendered(light, taps)) < 1e-5


@pytest.mark.parametrize("prefix", ["", "1a", "a b", "é", 'x"', "__x"])
def test_a_prefix_is_an_identifier(prefix):
    with pytest.raises(KernelError, match=r"prefix = .* expected letters"):
        kernel_text(taps_of("1", channels=3), "glsl", prefix=prefix)


@pytest.mark.parametrize("prefix", ["gl_SSS", "gl", "GL", "A_", "A__B"])
def test_a_prefix_is_none_that_languages_reserve(prefix):
    with pytest.raises(KernelError, match=r"prefix = .*; names that begin with gl_ or have two _"):
        kernel_text(taps_of("1", channels=3), "glsl", prefix=prefix)


def left_by_babylon(lines, defined):
    """Yield the lines that Babylon.js leaves, as its shaderProcessor.ts read on 2026-11-27.

    It finds directives anywhere in a line, takes a name alone as the question whether it is
    defined, compares whole numbers, and ends statements at every semicolon, in comments too.
    """
    for line in lines:
        word = re.search(r"#ifdef|#else|#elif|#endif|#ifndef|#if", line)
        if word is None:
            if line.startswith("#d"):
                _, name, value = line.split(" ")
                defined[name] = value
            yield line
        elif word[0] in ("#else", "#endif"):
            yield word[0]
            return
        else:
            on = is_true_to_babylon(line, defined)
            kept = list(left_by_babylon(lines, defined if on else dict(defined)))
            other = []
            if kept[-1] == "#else":
                other = list(left_by_babylon(lines, dict(defined) if on else defined))
            yield from (kept if on else other or [""])[:-1]


def is_true_to_babylon(line, defined):
    """Whether a condition holds."""
    command, condition = line.split("//")[0].strip().split(" ", 1)
    if command != "#if":
        return (condition in defined) == (command == "#ifdef")
    if "==" not in condition:
        return condition in defined
    left, right = (int(defined.get(each, each)) for each in condition.split(" == "))
    return left == right


def split_by_babylon(text):
    for line in text.split("\n"):
        if line.startswith("#") or line.strip().startswith("//"):
            yield line
        else:
            yield from re.findall(r"[^;]+;?", line.strip())


@pytest.mark.parametrize("first", ["", "COVERAGE", "DEPTH", "JITTER"])
@pytest.mark.parametrize("on", [0, 1])
def test_preprocessors_read_the_switches_alike(first, on, tmp_path):
    """That of C stands for those of GLSL and HLSL; that of Babylon.js is simpler."""
    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")
    taps = taps_of("1-1|2|*", channels=3, meta={"material": "#endif #if 0", "settings": {}})
    more = {"depth": first == "DEPTH", "jitter": first == "JITTER", "transmittance": True}
    text, _ = kernel_text(taps, "glsl", **more)
    text = (f"#define SSS_{first} {on}\n" if first else "") + text
    (tmp_path / "shader.c").write_text(text, encoding="utf-8")
    command = ["gcc", "-E", "-P", "-undef", "shader.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    left = left_by_babylon(iter([*split_by_babylon(text), "#endif"]), {})
    kept = (each.split("//")[0] for each in left if not each.startswith("#"))
    assert "".join("".join(kept).split()) == "".join(done.stdout.split())


def test_what_is_refused_says_nothing_else(caplog):
    caplog.set_level("INFO", "sssfit")
    one, other = taps_of("1", channels=3), taps_of("2", channels=3)
    with pytest.raises(KernelError, match="fit them with the same stages"):
        kernel_text([one, other], "hlsl", half=True)
    with pytest.raises(KernelError, match="prefix = '1a'"):
        kernel_text(small_kernel(pixels=41), "hlsl", half=True, prefix="1a")
    assert caplog.messages == []
    kernel_text(one, "hlsl", half=True)
    assert len(caplog.messages) == 1


@pytest.mark.parametrize("more", ["with_shader", "dense"])
def test_passes_are_asked_for_or_not(more):
    for kernel in (taps_of("1", channels=3), small_kernel()):
        with pytest.raises(KernelError, match="with its passes or without them; ask for one"):
            kernel_text(kernel, "hlsl", without_shader=True, **{more: True})


def test_what_cannot_share_a_file_is_one_line():
    one, other = taps_of("1", channels=3), taps_of("2", channels=3)
    with pytest.raises(KernelError, match="fit them with the same stages"):
        kernel_text([one, other], "hlsl")
    unlit = replace(one, blend=one.blend * [[0.0], [1.0]])  # without a share of the irradiance
    for first, second in ((one, unlit), (unlit, one)):
        with pytest.raises(KernelError, match="fit them with the same stages"):
            kernel_text([first, second], "hlsl")
    apart, shared = (taps_of("1-1", channels=3, chained=False) for _ in range(2))
    same = replace(shared.stages[1], offsets_mm=shared.stages[0].offsets_mm)
    shared = replace(shared, stages=(shared.stages[0], same))
    with pytest.raises(KernelError, match="fit them with the same stages"):
        kernel_text([shared, apart], "hlsl")
    with pytest.raises(KernelError, match="has 4 channels; passes are written for at most 3"):
        kernel_text(taps_of("1", channels=4), "wgsl")
