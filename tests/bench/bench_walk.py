"""Speed of the photon walk: a table on stdout, or docs/benchmarks.md with ``--write``.

    python tests/bench/bench_walk.py            full size, some three minutes
    python tests/bench/bench_walk.py --write    the same into docs/benchmarks.md
    python tests/bench/bench_walk.py --small    ten seconds; the tests run it

Everything is measured in one run: the lane walk and the literal scalar loop (tests/reference.py)
in turn on one core, then whole commands with start-up, an empty compile cache included, though not
with --small.
"""

import argparse
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "docs")]

import reference  # noqa: E402
from sections import DOCS, marked_page, put_section  # noqa: E402

import sssfit  # noqa: E402
from sssfit.grid import paper_grid  # noqa: E402
from sssfit.material import Layer, Material, load_material  # noqa: E402
from sssfit.profile import Profile  # noqa: E402
from sssfit.simulate import simulate_montecarlo  # noqa: E402

RUNS = 5


def seconds(work):
    """Wall time of one call."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def lanes(name, photons, threads=1):
    """The library's walk."""
    simulate_montecarlo(load_material(name), photons=photons, threads=threads)


def scalar(name, photons):
    """The literal loop, same physics, same grid, same channels."""
    material, grid = load_material(name), paper_grid(load_material(name))
    layer = material.layers[0]
    reference.scalar_walk(
        1, photons, layer.albedo, layer.mean_free_path_mm, layer.eta, grid.dr_mm, grid.annuli
    )


def paired(one, other):
    """Median times of two pieces of work done in turn, and of their ratio."""
    pairs = [(seconds(one), seconds(other)) for _ in range(RUNS)]
    return (
        statistics.median(a for a, _ in pairs),
        statistics.median(b for _, b in pairs),
        statistics.median(a / b for a, b in pairs),
    )


def walk_rows(photons):
    """Lanes against the scalar loop, one core, three channels."""
    rows = []
    for name in ("skin1", "ketchup", "marble"):
        lanes(name, 2000)
        scalar(name, 100)
        slow, fast, _ = paired(
            lambda name=name: scalar(name, photons // 10), lambda name=name: lanes(name, photons)
        )
        slow_rate, fast_rate = photons / 10 / slow, photons / fast
        rows.append(
            (name, f"{slow_rate:,.0f}", f"{fast_rate:,.0f}", f"{fast_rate / slow_rate:.1f}")
        )
    return rows


def layered_rows(photons):
    """Three layers of g .8 against the scalar MCML, one core, one channel."""
    layers = (
        Layer(1.4, [0.8], [0.1], [10.0], 0.1),
        Layer(1.35, [0.8], [0.05], [20.0], 0.5),
        Layer(1.45, [0.8], [0.2], [15.0]),
    )
    material = Material("three", ("mono",), layers)
    grid = paper_grid(material)

    def loop(count):
        reference.scalar_layered_walk(
            1,
            count,
            np.array([each.sigma_a_per_mm[0] for each in layers]),
            np.array([each.sigma_s_per_mm[0] for each in layers]),
            np.array([each.g[0] for each in layers]),
            np.array([1.0, *(each.eta for each in layers), 1.0]),
            np.array([min(each.thickness_mm, 1e30) for each in layers]),
            material.specular_reflectance,
            0,
            grid.dr_mm,
            grid.annuli,
        )

    def walk(count):
        simulate_montecarlo(material, photons=count, threads=1)

    loop(100)
    walk(2000)
    slow, fast, _ = paired(lambda: loop(photons // 10), lambda: walk(photons))
    rates = photons / 10 / slow, photons / fast
    return [("three layers, g .8", *(f"{x:,.0f}" for x in rates), f"{rates[1] / rates[0]:.1f}")]


def thread_rows(photons):
    """One thread against two."""
    rows = []
    for name in ("skin1", "ketchup"):
        one, two, ratio = paired(
            lambda name=name: lanes(name, photons, 1), lambda name=name: lanes(name, photons, 2)
        )
        rows.append((name, f"{one:.2f}", f"{two:.2f}", f"{ratio:.2f}"))
    return rows


def command(*arguments, cache=None, folder):
    """Wall and processor time of a whole ``sssfit`` process, start-up included."""
    environment = dict(os.environ)
    if cache:
        environment["NUMBA_CACHE_DIR"] = cache
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    wall = seconds(
        lambda: subprocess.run(
            [sys.executable, "-m", "sssfit.cli", *arguments, "-q"],
            check=True,
            cwd=folder,
            env=environment,
        )
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def command_rows(photons, runs, *, small):
    """Whole processes: the first use ever, then what a user waits for every day."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        cache = None if small else folder  # compiling takes 10 s, whatever the size
        small_run = "simulate", "skin1", "--photons", "1000"
        first = command(*small_run, cache=cache, folder=folder)
        rows.append(
            (
                "`sssfit simulate skin1 --photons 1000`, first use, compiling",
                *(f"{each:.2f}" for each in first),
            )
        )
        layered = "simulate", "skin-melanin-12", "--photons", "1000"
        if not small:
            command(*layered, folder=folder)  # compiles
        for arguments in (
            small_run,
            *(() if small else (layered,)),
            ("simulate", "skin1", "--photons", str(photons)),
            ("simulate", "--paper", "--photons", str(photons)),
            ("chart", "skin1.profile.npz"),
            ("materials",),
        ):
            repeats = 1 if "--paper" in arguments else runs
            times = zip(*(command(*arguments, folder=folder) for _ in range(repeats)), strict=True)
            medians = (f"{statistics.median(each):.2f}" for each in times)
            rows.append((f"`sssfit {' '.join(arguments)}`", *medians))
    return rows


def kernel_rows(small):
    """Pixel-integrated quadrants of the paper's grids, one channel."""
    rows = []
    for name in ("skin1",) if small else ("skin1", "ketchup"):
        profile: Profile = simulate_montecarlo(load_material(name), photons=10_000)
        pitch = float(profile.r_edges_mm[1])
        profile.quadrant_kernel(pitch, 3, channel=0)
        pixels = 40 if small else profile.n_annuli
        took = seconds(lambda p=profile, d=pitch, h=pixels: p.quadrant_kernel(d, h, channel=0))
        rows.append((name, f"{pixels + 1} x {pixels + 1}", f"{took:.2f}"))
    return rows


def markdown(heads, rows):
    """A table."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def processor():
    """Name and flags that matter for vector code."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    model = next((x.split(":")[1].strip() for x in text.split("\n") if "model name" in x), "")
    vectors = "AVX-512" if "avx512f" in text else "AVX2" if "avx2" in text else platform.machine()
    return f"{model or platform.processor()}, {vectors}, {os.cpu_count()} cores"


def page(small):
    """All tables."""
    photons, whole = (4_000, 2_000) if small else (2_000_000, 10_000_000)
    sections = [
        "# Benchmarks",
        "Made by `python tests/bench/bench_walk.py --write`; times are medians and depend on the "
        f"machine; the two sides of a ratio ran in turn. This run: sssfit {sssfit.__version__}, "
        f"{processor()}, Python {platform.python_version()}, numpy {np.__version__}.",
        "## The walk in lanes against a literal scalar loop",
        "Photons a second on one core, all three channels, the paper's grid. The loop is "
        "`scalar_walk` of tests/reference.py: one photon at a time, double precision, also "
        "compiled by numba.",
        markdown(("material", "scalar loop", "lanes", "ratio"), walk_rows(photons)),
        "The layered walk against `scalar_layered_walk`, one channel:",
        markdown(("material", "scalar loop", "lanes", "ratio"), layered_rows(photons // 4)),
        "## Two threads against one",
        f"Seconds for {photons * 5:,} photons.",
        markdown(("material", "one thread", "two threads", "speed-up"), thread_rows(photons * 5)),
        "## What a user waits for",
        "Wall and processor time of whole commands in seconds, start-up included, all cores. The "
        "runs of 1000 photons are start-up for the most part.",
        markdown(
            ("command", "seconds", "of the processor"),
            command_rows(whole, 1 if small else 5, small=small),
        ),
        "## Pixel-integrated kernels",
        "Seconds for one quadrant of the paper's grid, pixel = annulus width, one channel, one "
        "thread.",
        markdown(("material", "pixels", "seconds"), kernel_rows(small)),
    ]
    return "\n\n".join(sections) + "\n"


def write_page(name, script, text):
    """Write a page of docs, with the date and the command of its making."""
    place = script.resolve().relative_to(ROOT).as_posix()
    page = marked_page(place, text, f"python {place} --write")
    (DOCS / name).write_text(page, encoding="utf-8")


def main():
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
    options = parser.parse_args()
    text = page(options.small)
    if options.write:
        script = "tests/bench/bench_walk.py"
        put_section("benchmarks.md", script, text, f"python {script} --write")
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
