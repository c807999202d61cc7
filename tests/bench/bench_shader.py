"""Milliseconds of exported passes on the graphics driver at hand: docs/benchmarks-shader.md.

    python tests/bench/bench_shader.py            1920 x 1080, a minute
    python tests/bench/bench_shader.py --write    the same into docs/benchmarks-shader.md
    python tests/bench/bench_shader.py --small    some seconds; the tests run it

A close shot writes every pixel, a mid shot the middle 1/16 of them, and with no skin in view the
draws are made and write nothing: the fixed cost. The shots are cut by the scissor, as an engine
cuts by its stencil; of compute shaders as many groups run as the shot has. All cases take turns,
and the least time of each counts. Needs `moderngl`.
"""

import argparse
import sys
import time
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

import shared_work  # noqa: E402
from bench_walk import markdown, processor, write_page  # noqa: E402
from compute_runs import prepared_compute  # noqa: E402
from shader_runs import device_of, prepared  # noqa: E402

from sssfit.errors import SssfitWarning  # noqa: E402
from sssfit.export import kernel_text  # noqa: E402
from sssfit.export.compute import bytes_moved, levels_of  # noqa: E402
from sssfit.fit import fit_result  # noqa: E402
from sssfit.fit.on_taps import on_taps  # noqa: E402
from sssfit.material import load_material  # noqa: E402
from sssfit.simulate import simulate_exact  # noqa: E402

SHOTS = {"close": 1.0, "mid": 0.25, "none": 0.0}  # part of either side that is written
# Milliseconds of RR-02-12, table 2: two passes, and six Gaussians in screen space; close shots.
PUBLISHED = {"GTX 580": (1.05, 3.07), "GTX 470": (4.6, 10.38), "GT 130M": (13.66, 40.02)}


def tables():
    """Yield a label and a table of skin1 for each case."""
    profile = simulate_exact(load_material("skin1"))
    for fetches in (14, 17, 24):
        kernel = fit_result(profile, "cascade", fetches=fetches).kernel
        yield f"cascade {kernel.structure}", kernel
    dense = fit_result(profile, "preintegrated").kernel
    for taps in (11, 17, 25):
        yield f"pre-integrated, {taps} taps", on_taps(dense, taps, profile=profile)
    six = fit_result(profile, "gaussians", terms=6).kernel
    yield "six Gaussians, 17 taps", on_taps(six, 17, profile=profile)
    yield "disk, 24 taps", fit_result(profile, "disk", taps=24).kernel


def shot_rows(size, runs):
    """A row for each table: cost, and milliseconds of each shot."""
    width, height = size
    light = np.random.default_rng(1).random((height, width, 3))
    cases, best = {}, {}
    for label, taps in tables():
        text, _ = kernel_text(taps, "glsl")
        draw = prepared(text, "glsl", taps, light, taps.mm_per_pixel, normalized=True)
        moved = f"{taps.bytes_per_pixel():.0f}"
        cases[label] = (f"{taps.fetches:.4g}", str(taps.passes), moved, "0"), draw
        if taps.chained:
            cases[f"{label}, compute"] = compute_case(taps, light)
    for _, draw in cases.values():
        timed(draw, 1.0)  # the driver compiles at the first draw
    for _ in range(runs):
        for label, (_, draw) in cases.items():
            for shot, part in SHOTS.items():
                took = timed(draw, part)
                best[label, shot] = min(best.get((label, shot), np.inf), took)
    for label, (cost, _) in cases.items():
        shots = [f"{1e3 * best[label, shot]:.2f}" for shot in SHOTS]
        shots[2] = "-" if label.endswith("compute") else shots[2]  # no group runs
        yield (label.replace("|", "\\|"), *cost, *shots)


def compute_case(taps, light):
    """Cost and dispatches of a cascade's compute shaders: loads a pixel, and bytes with halos."""
    text, _ = kernel_text(taps, "glsl", compute=True)
    _, run = prepared_compute(text, "glsl", [taps], light, taps.mm_per_pixel, half=True)
    levels = levels_of([taps])
    once, whole = (bytes_moved(levels, with_halos=halos) for halos in (False, True))
    loads = sum((each.side / each.tile) ** 2 / 4.0**each.number for each in levels)
    loads += sum(2.0 / 4.0**each.number for each in levels[:-1])
    moved = f"{once:.0f}", f"{whole - once:.0f}"
    return (f"{loads:.4g}", str(2 * len(levels) - 1), *moved), run


def timed(draw, part):
    """Seconds of all draws of a case, until the driver has done them."""
    context = device_of("glsl").context
    context.finish()
    begun = time.perf_counter()
    draw(part)
    context.finish()
    return time.perf_counter() - begun


def ratio_rows(rows):
    """Six Gaussians over the single pair of 17 taps, here and on the report's cards."""
    close = {label: float(cells[4]) for label, *cells in rows}
    ours = close["six Gaussians, 17 taps"] / close["pre-integrated, 17 taps"]
    yield "here", f"{ours:.2f}"
    for card, (two, six) in PUBLISHED.items():
        yield f"RR-02-12, table 2, {card}", f"{six / two:.2f}"


def report(size, runs):
    """The page."""
    rows = list(shot_rows(size, runs))
    driver = device_of("glsl").context.info
    heads = (
        "table",
        "fetches",
        "passes",
        "bytes a pixel",
        "of halos",
        *(f"{each}, ms" for each in SHOTS),
    )
    return "\n\n".join(
        [
            "# Exported passes on a driver",
            f"{size[0]} x {size[1]} pixels, half floats between the passes, GLSL by "
            f"{driver['GL_RENDERER']}, {driver['GL_VERSION']}, {processor()}; least of {runs}. "
            "Bytes are those that each pass reads and writes, a picture once; tiles of compute "
            "shaders, whose passes are dispatches, also load halos. A software driver "
            "ranks only roughly: it pays for arithmetic and fetches alike, has no texture cache, "
            "and its draws cost little. Nor has it any groupshared memory of its own: compute "
            "shaders save it no traffic, and it pays for every texel of their halos.",
            markdown(heads, rows),
            "Six Gaussians in screen space over one pair of passes, close shot:",
            markdown(("where", "ratio"), list(ratio_rows(rows))),
        ]
    )


def main():
    """Print or write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    warnings.simplefilter("ignore", SssfitWarning)  # of fits, which are not what is measured
    if given.small:  # short searches: long ones take half the time
        shared_work.begin()
        shared_work.allow("bench_shader")
    text = report((64, 36), 1) if given.small else report((1920, 1080), 5)
    if given.write:
        write_page("benchmarks-shader.md", Path(__file__), text)
    else:
        print(text)


if __name__ == "__main__":
    main()
