"""Exported compute shaders, run on a software driver, against the renderer pixel by pixel."""

import re
from dataclasses import replace

import numpy as np
import pytest
from compute_runs import run_compute
from test_disk import disk_of
from test_shaders import PITCH, PLAIN, RUN, apart, light_of, rendered
from test_taps import taps_of
from test_turned import turned
from turns import in_turn

from sssfit.errors import KernelError
from sssfit.export import DIALECTS, kernel_text, source
from sssfit.export.compute import levels_of
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

COMPUTE = replace(PLAIN, compute=True)
STRUCTURES = ("1", "1-2-3", "1-2|3|2", "*-*", "*|1-*|*", "1-1|1-2|2-2|2-2")
SIZES = ((64, 32), (1, 9), (16, 17))


def wide(structure="2-3|2-3", by=2.0):
    """A table whose halos leave room for small tiles alone."""
    taps = taps_of(structure, channels=3)
    stages = (replace(each, offsets_mm=by * each.offsets_mm) for each in taps.stages)
    return replace(taps, stages=tuple(stages))


@pytest.mark.parametrize(
    ("structure", "dialect"),
    [
        *((each, "glsl") for each in STRUCTURES),
        *((each, other) for each in STRUCTURES[-2:] for other in ("hlsl", "wgsl")),
    ],
)
def test_they_show_what_the_renderer_shows(structure, dialect):
    taps, light = taps_of(structure, channels=3), light_of((37, 50), 3)
    text = source([taps], DIALECTS[dialect], COMPUTE)
    assert apart(run_compute(text, dialect, [taps], light, PITCH), rendered(light, taps)) < 1e-5


@pytest.mark.parametrize(("size", "dialect"), in_turn([(each,) for each in SIZES], RUN))
def test_pictures_of_any_size_are_halved_alike(size, dialect):
    taps, light = taps_of("1-2|3|2", channels=3), light_of(size, 3)
    text = source([taps], DIALECTS[dialect], COMPUTE)
    assert apart(run_compute(text, dialect, [taps], light, PITCH), rendered(light, taps)) < 1e-5


@pytest.mark.parametrize(("name", "dialect"), in_turn(["disk", "edge", "head"], RUN))
def test_scenes(name, dialect):
    scene = make_scene(name, height=95, width=97, mm_per_pixel=PITCH)
    taps = taps_of("1-1|2-2|2-2", channels=3)
    light = np.repeat(scene.irradiance, 3, axis=2)
    text = source([taps], DIALECTS[dialect], COMPUTE)
    assert apart(run_compute(text, dialect, [taps], light, PITCH), rendered(light, taps)) < 1e-5


@pytest.mark.parametrize("dialect", ["glsl", "wgsl"])
def test_a_wide_halo_leaves_a_smaller_tile(dialect):
    taps, light = wide(), light_of((45, 70), 3)
    assert any(each.tile < 16 for each in levels_of([taps]))
    text = source([taps], DIALECTS[dialect], COMPUTE)
    assert apart(run_compute(text, dialect, [taps], light, PITCH), rendered(light, taps)) < 1e-5


@pytest.mark.parametrize("dialect", ["hlsl", "wgsl"])
def test_larger_pixels_and_one_channel(dialect):
    taps, light = taps_of("1-2|2", channels=1), light_of((33, 40), 1)
    text = source([taps], DIALECTS[dialect], COMPUTE)
    found = run_compute(text, dialect, [taps], light, 0.37, whole=True)
    wanted = render_taps(Scene("light", light, 0.37), taps, border="clamp")
    assert apart(found[..., :3], wanted) < 1e-5  # grey


@pytest.mark.parametrize("dialect", RUN)
def test_the_halo_limits_the_blur_of_smaller_pixels(dialect):
    taps, light = taps_of("1-2|3|2", channels=3), light_of((37, 50), 3)
    text = source([taps], DIALECTS[dialect], COMPUTE)
    near, far = (run_compute(text, dialect, [taps], light, mm) for mm in (0.5 * PITCH, PITCH))
    np.testing.assert_array_equal(near, far)
    assert "Halos\n// are those for 0.3 mm; for less the blur stays as many texels wide." in text


@pytest.mark.parametrize("dialect", RUN)
def test_several_materials(dialect):
    other = replace(wide("1-1|2"), meta={"material": "clay"})
    every = [taps_of("1-1|2", channels=3), other]
    text, _ = kernel_text(every, dialect, prefix="SKIN", compute=True)
    light = light_of((37, 50), 3)
    for k, taps in enumerate(every):
        found = run_compute(text, dialect, every, light, PITCH, profile=k, prefix="SKIN")
        assert apart(found * taps.energy, rendered(light, taps)) < 1e-5


def of_several_pixels():
    """Tables of one structure for pixels of two sizes, of which the finer one reaches as far."""
    fine = replace(wide("1-1|2", by=1.5), meta={"material": "clay"})
    stages = (replace(each, offsets_mm=3.0 * each.offsets_mm) for each in fine.stages)
    coarse = taps_of("1-1|2", channels=3)
    coarse = replace(coarse, mm_per_pixel=3.0 * PITCH, stages=tuple(stages))
    return [coarse, fine]


@pytest.mark.parametrize(("is_turned", "dialect"), in_turn([(False,), (True,)], RUN))
def test_tables_for_several_pixels_are_right_on_their_own(is_turned, dialect):
    every = of_several_pixels()[:: -1 if is_turned else 1]
    text, _ = kernel_text(every, dialect, compute=True)
    light = light_of((37, 50), 3)
    for k, taps in enumerate(every):
        scene = Scene("light", light, taps.mm_per_pixel)
        found = run_compute(text, dialect, every, light, taps.mm_per_pixel, profile=k)
        assert apart(found * taps.energy, render_taps(scene, taps, border="clamp")) < 1e-5
    assert "Halos\n// are those for each profile's own; for less the blur stays" in text


def test_the_memory_of_a_group_is_that_of_the_widest_table():
    """Whatever the order, and whatever the pixels that a table was made for."""
    coarse, fine = of_several_pixels()
    assert levels_of([coarse, fine]) == levels_of([fine, coarse]) == levels_of([fine])
    stages = (replace(each, offsets_mm=30.0 * each.offsets_mm) for each in fine.stages)
    fine = replace(fine, stages=tuple(stages))
    for tables in ([fine], [coarse, fine], [fine, coarse]):
        with pytest.raises(KernelError, match=r"level 0 reach \d+ texels, and 16384 bytes of"):
            kernel_text(tables, "wgsl", compute=True)


def rows_of(text):
    """Reads, writes and numbers of each level in the table of the comment, and those of adding."""
    levels = re.findall(
        r"^// SSS_Level\d +(\w+) +(\w+(?: \w+)?) +1(?:/(\d+))? +(\d+) +(\d+)$", text, re.M
    )
    adds = re.findall(r"^// SSS_Add +(\w+) (\w+) +(\w+) +1(?:/(\d+))?$", text, re.M)
    return levels, adds


@pytest.mark.parametrize("dialect", RUN)
@pytest.mark.parametrize("taps", [taps_of("1-1|1-2|2-2|2-2", channels=3), wide(), wide("*|2")])
def test_the_table_of_dispatches_adds_up(taps, dialect):
    text, _ = kernel_text(taps, dialect, compute=True)
    levels, adds = rows_of(text)
    held, most = {"E"}, 0
    once = halos = 0.0
    for reads, writes, size, tile, halo in levels:
        assert reads in held
        held |= set(writes.split())
        side, part = int(tile) + 2 * int(halo), 1.0 / int(size or 1) ** 2
        most = max(most, 2 * 4 * 3 * side**2)
        once += part * (1.0 + 1.0 + 0.25 * (len(writes.split()) > 1))
        halos += part * ((side / int(tile)) ** 2 - 1.0)
    for coarse, own, writes, size in adds:
        assert {coarse, own} <= held
        held.add(writes)
        once += 2.25 / int(size or 1) ** 2
    assert "M0" in held
    assert most <= 16384
    assert f"in {most} bytes of groupshared memory" in text
    assert most == 4 * int(re.search(r"SSS_GROUP(?:\[|: array<f32, )(\d+)", text)[1])
    said = re.search(r"half floats: ([\d.]+), and ([\d.]+) of halos.*\n.* move ([\d.]+)\.", text)
    moved = 8.0 * once, 8.0 * halos, taps.bytes_per_pixel()
    np.testing.assert_allclose([float(each) for each in said.groups()], moved, rtol=5e-3)
    assert moved[0] < moved[2]


@pytest.mark.parametrize("dialect", RUN)
def test_it_stays_readable(dialect):
    for taps in (taps_of("1-1|1-2|2-2|2-2", channels=3), taps_of("1-1|2-2|2-2", channels=3)):
        text, _ = kernel_text(taps, dialect, compute=True)
        assert len(text.splitlines()) < 200
        assert "COVERAGE" not in text


def test_hlsl_vectors_name_every_component():
    """Compilers of Direct3D refuse float3(1.0), which glslang lets pass."""
    text, _ = kernel_text(taps_of("1|*", channels=3), "hlsl", compute=True)
    code = re.sub(r"\b[A-Z]\w*<?\w*>? \w+\(.*\{", "", text)
    assert not re.findall(r"float[234]\((?:[^(),]|\([^()]*\))*\)", code)


@pytest.mark.parametrize("taps", [disk_of(9), taps_of("1-2", channels=3, chained=False)])
def test_other_tables_have_no_compute_shader(taps):
    with pytest.raises(KernelError, match="are written for cascades of pairs along the axes and"):
        kernel_text(taps, "hlsl", compute=True)


def test_what_cannot_be_is_one_line():
    taps = taps_of("1-2|1", channels=3)
    with pytest.raises(KernelError, match="are written for cascades of pairs along the axes and"):
        kernel_text(turned("1-1", ["x30", ""], channels=3), "glsl", compute=True)
    for asked in ("coverage", "depth", "jitter", "tilt"):
        with pytest.raises(KernelError, match=f"keep no {asked}; export the passes, which do"):
            kernel_text(taps, "glsl", compute=True, **{asked: True})
    with pytest.raises(KernelError, match=r"level 0 reach \d+ texels, and 16384 bytes of group"):
        kernel_text(wide("4-4", by=30.0), "wgsl", compute=True)
    with pytest.raises(
        KernelError, match="compute: only passes have this, and they are not written"
    ):
        kernel_text(taps, "glsl", compute=True, without_shader=True)


@pytest.mark.parametrize("dialect", ["hlsl", "wgsl"])
def test_light_through_a_thickness_goes_along(dialect):
    taps, light = taps_of("2", channels=3), light_of((20, 30), 3)
    text, _ = kernel_text(taps, dialect, compute=True, transmittance=True, keep_energy=True)
    assert "SSS_Through(" in text
    assert apart(run_compute(text, dialect, [taps], light, PITCH), rendered(light, taps)) < 1e-5
