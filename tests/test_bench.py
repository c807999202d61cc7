"""The benchmark scripts run: every table, every figure a number."""

import math
import re
import runpy
import subprocess
import sys
from pathlib import Path

import fork_server
import pytest
from shader_runs import needs

from sssfit.fit import METHODS

BENCH = Path(__file__).parent / "bench"
ACCURACY = ["run", "seconds", "error", "claimed"]
EXACT = [
    (ACCURACY, ["exact, tolerance 0.01", "exact, tolerance 0.0001", "walk, 1e+04 photons"]),
    (
        ["command", "seconds"],
        [
            "`sssfit simulate skin1 --method exact`, first use",
            "`sssfit simulate skin1 --method exact`",
            "2 materials, as many commands",
            "2 materials, one process, without start-up",
        ],
    ),
]

SPEEDS = ["material", "scalar loop", "lanes", "ratio"]
TABLES = [
    (SPEEDS, ["skin1", "ketchup", "marble"]),
    (SPEEDS, ["three layers, g .8"]),
    (["material", "one thread", "two threads", "speed-up"], ["skin1", "ketchup"]),
    (
        ["command", "seconds", "of the processor"],
        [
            "`sssfit simulate skin1 --photons 1000`, first use, compiling",
            "`sssfit simulate skin1 --photons 1000`",
            "`sssfit simulate skin1 --photons 2000`",
            "`sssfit simulate --paper --photons 2000`",
            "`sssfit chart skin1.profile.npz`",
            "`sssfit materials`",
        ],
    ),
    (["material", "pixels", "seconds"], ["skin1"]),
]


def tables(text):
    """The tables of a Markdown page: heads and rows of cells."""
    found, inside = [], False
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("|"):
            inside = False
        elif not inside:
            found.append((cells, []))
            inside = True
        elif set(line) != {"|", "-"}:
            found[-1][1].append(cells)
    return found


def forked(command, *, check=False, capture_output=False, **options):
    """As `subprocess.run`, by a child that has everything loaded."""
    streams = {} if capture_output else {"stdout": None, "stderr": None}
    ended = fork_server.run(command, **streams, **options)
    if check:
        ended.check_returncode()
    return ended


@pytest.fixture
def small(monkeypatch, capfd):
    """Run a script at its small size, as a program in this process; give its tables."""
    monkeypatch.setattr(subprocess, "run", forked)
    monkeypatch.setattr(sys, "path", [*sys.path])

    def call(script):
        monkeypatch.setattr(sys, "argv", [script, "--small"])
        runpy.run_path(str(BENCH / script), run_name="__main__")
        out, err = capfd.readouterr()
        assert err == ""
        return tables(out.replace("\\|", "/"))

    return call


@pytest.mark.parametrize(
    ("script", "expected"), [("bench_walk.py", TABLES), ("bench_exact.py", EXACT)]
)
def test_small_benchmarks_run_and_fill_every_table(small, script, expected):
    found = small(script)
    assert [(heads, [row[0] for row in rows]) for heads, rows in found] == expected
    for heads, rows in found:
        for row in rows:
            figures = dict(zip(heads[1:], row[1:], strict=True))
            if "pixels" in figures:
                assert figures.pop("pixels") == "41 x 41"
            for value in figures.values():
                number = float(value.replace(",", ""))
                assert math.isfinite(number)
                assert number >= 0.0


def test_small_benchmarks_of_fits_run_and_fill_every_table(small):
    solver, whole, limits, methods = small("bench_fit.py")
    assert [row[0].split()[0] for row in solver[1]] == ["the", "rank", "numpy.linalg.svd"]
    assert float(solver[1][1][3]) < 1e-10  # ours against numpy's, in the same run
    assert [row[0] for row in whole[1]] == ["skin1", "ketchup"]
    assert [row[0].split(",")[0] for row in limits[1]] == ["gaussians"] + 4 * ["guided"]
    assert [row[0] for row in methods[1]] == [f"apple, {name}" for name in METHODS]
    for row in methods[1]:
        assert all(math.isfinite(float(value)) for value in row[1:])


def test_small_benchmarks_of_renderers_run_and_fill_every_table(small):
    few, many, compiling, cascade, reference = small("bench_render.py")
    for _, rows in (few, many):
        names = [row[0].split(",")[0] for row in rows]
        scipys = ["scipy.ndimage.convolve1d"] * 2
        assert names == [*["float32", "float32", "float64", "float64"], *scipys, "cv2.sepFilter2D"]
        for row in rows:
            if row[1] != "not installed":
                limit = 1e-13 if "float64" in row[0] else 1e-5  # all of them blur alike
                assert float(row[3]) < limit
    assert [len(each[1]) for each in (compiling, cascade, reference)] == [2, 2, 2]
    assert all(float(row[1]) > 0.0 for row in cascade[1])
    # Releases differ in threads, so the heading says which one was run.
    is_installed = cascade[1][0][2] != "not installed"
    assert re.fullmatch(r"OpenCV \d+[\d.]+, s" if is_installed else "OpenCV, s", cascade[0][2])
    for row in [*(row[1:] for row in compiling[1]), *(row[3:] for row in reference[1])]:
        assert all(float(value) >= 0.0 for value in row)


def test_small_benchmarks_of_shaders_run_and_fill_every_table(small):
    needs("glsl")
    cases, ratios = small("bench_shader.py")
    assert [row[0].split()[0] for row in cases[1]] == [
        *["cascade"] * 6,  # each with its compute shaders
        *("pre-integrated,", "pre-integrated,", "pre-integrated,", "six", "disk,"),
    ]
    for name, *costs, halos, close, mid, none in cases[1]:
        computes = name.endswith("compute")
        assert all(float(value) > 0.0 for value in (*costs, close, mid))
        assert (float(halos) > 0.0) == computes
        assert none == "-" if computes else float(none) > 0.0
    for passes, dispatches in zip(cases[1][0:6:2], cases[1][1:6:2], strict=True):
        assert float(dispatches[3]) < 0.75 * float(passes[3])
    assert [row[1] for row in ratios[1][1:]] == ["2.92", "2.26", "2.93"]


def test_small_benchmarks_of_sweeps_run_and_fill_every_table(small, monkeypatch):
    """In this process: workers and clusters have tests of their own, and take seconds to start."""
    for extra in ("zarr", "distributed"):
        pytest.importorskip(extra)
    from sssfit import sweep
    from sssfit.sweep import cluster, pools

    def here(plan, path, *, progress, force, **_):
        return whole(plan, path, progress=progress, force=force, threads=1)

    whole = sweep.sweep_to_store
    monkeypatch.setattr(sweep, "sweep_to_store", here)
    monkeypatch.setattr(cluster, "Cluster", lambda plan, _: pools.ThisProcess(plan))
    costs, memory, photons, albedos, cores = small("bench_sweep.py")
    assert [row[:2] for row in costs[1]] == [
        [name, workers] for workers in "12" for name in ("processes", "cluster")
    ]
    assert [row[0] for row in memory[1]] == ["5", "10"]
    assert [row[0] for row in photons[1]] == ["1e+03"] * 2 + ["2e+03"] * 2
    assert [row[0] for row in albedos[1]] == ["0.5", "0.9", "0.99", "0.999", "0.9999"]
    assert [row[1] for row in cores[1]] == ["2", "10", "100", "1000"] * 2
    for row in [*(row[2:5] for row in costs[1]), *(row[2:] for row in photons[1]), *albedos[1]]:
        assert all(math.isfinite(float(value.rstrip(" %"))) for value in row)
    for row in cores[1]:
        assert all(math.isfinite(float(value.rstrip(" %"))) for value in row[2:5])
