"""What a sweep of skin costs on workers of this machine and on a Dask cluster of as many.

    python tests/bench/bench_sweep.py                   200 points of 3e5 photons, some minutes
    python tests/bench/bench_sweep.py --photons 2e4     seconds, to see that it runs
    python tests/bench/bench_sweep.py --workers 1,2

Times include the start and the end of the workers; "to the last point" ends when it is computed.
Memory is the largest resident size of any worker, seen whenever a point is finished.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import psutil

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / "bench"), str(ROOT / "docs")]

from bench_walk import markdown, processor  # noqa: E402

from sssfit.sweep import load_plan, sweep_to_store  # noqa: E402

EXAMPLE = ROOT / "docs" / "examples" / "skin-spectral.toml"
POINTS = 200


def skin_plan(photons):
    """The example's plan over 25 of its wavelengths: 4 x 2 x 25 points."""
    plan = load_plan(EXAMPLE)
    *others, bands = plan.axes
    columns = {name: each[:25] for name, each in bands.columns.items()}
    axes = (*others, replace(bands, values=bands.values[:25], columns=columns))
    found = replace(plan, axes=axes, settings={"photons": photons})
    assert found.count == POINTS
    return found


def measured(plan, folder, **where):
    """Seconds, seconds to the last point, and the largest worker's bytes."""
    largest, last = 0, 0.0

    def look(*_):
        nonlocal largest, last
        last = time.perf_counter()
        for each in psutil.Process().children(recursive=True):
            try:
                largest = max(largest, each.memory_info().rss)
            except psutil.NoSuchProcess:
                continue

    begun = time.perf_counter()
    sweep_to_store(plan, folder / "x.zarr", progress=look, force=True, **where)
    return time.perf_counter() - begun, last - begun, largest


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photons", type=float, default=3e5)
    parser.add_argument("--workers", default="2")
    given = parser.parse_args()
    plan = skin_plan(int(given.photons))
    rows = []
    with tempfile.TemporaryDirectory() as made:
        for count in map(int, given.workers.split(",")):
            ways = {"processes": {"threads": count}, "cluster": {"scheduler": f"local:{count}"}}
            times = {}
            for name, where in ways.items():
                seconds, last, size = measured(plan, Path(made), **where)
                times[name] = seconds
                more = 100.0 * (seconds / times["processes"] - 1.0)
                rows.append(
                    (
                        *(name, str(count), f"{seconds:.1f}", f"{last:.1f}"),
                        *(f"{POINTS / seconds:.1f}", f"{more:+.1f} %", f"{size / 1e6:.0f}"),
                    )
                )
    heads = ("where", "workers", "s", "s to the last point", "points/s", "more", "MB a worker")
    sys.stdout.write(f"{POINTS} points of {given.photons:g} photons; {processor()}\n\n")
    sys.stdout.write(markdown(heads, rows) + "\n")


if __name__ == "__main__":
    main()
