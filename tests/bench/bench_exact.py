"""Speed against accuracy of the exact solver and the walk: tables, or docs with ``--write``.

    python tests/bench/bench_exact.py            full size, some five minutes
    python tests/bench/bench_exact.py --write    the same into docs/benchmarks-exact.md
    python tests/bench/bench_exact.py --small    ten seconds; the tests run it

The error of a run is the largest |F - F_ref| / total over channels and annulus edges, F_ref being
the solver's own finest run; for the walk, the largest standard error of F stands beside it.
"""

import argparse
import platform
import statistics
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

from bench_walk import command, markdown, processor, seconds, write_page  # noqa: E402

import sssfit  # noqa: E402
from sssfit.material import load_material, material_names  # noqa: E402
from sssfit.simulate import simulate_montecarlo  # noqa: E402
from sssfit.simulate.exact import simulate_exact, simulate_exact_many  # noqa: E402


def worst(difference, total):
    """Largest share of the total over edges and channels."""
    return float(np.max(np.abs(difference) / total))


def timed(work):
    """Return the time of one call, and what it returned."""
    kept = []
    took = seconds(lambda: kept.append(work()))
    return took, kept[0]


def accuracy_rows(small):
    """skin1: tolerances and photon counts, time and error of each."""
    material = load_material("skin1")
    reference = simulate_exact(material, tolerance=1e-4 if small else 2e-6)
    total = reference.diffuse_reflectance
    rows = []
    for tolerance in (1e-2, 1e-4) if small else (1e-2, 1e-3, 1e-4, 1e-5):
        took, profile = timed(lambda t=tolerance: simulate_exact(material, tolerance=t))
        apart = worst(profile.cumulative - reference.cumulative, total)
        claimed = profile.meta["relative_error"]
        rows.append(
            (f"exact, tolerance {tolerance:g}", f"{took:.2f}", f"{apart:.1e}", f"{claimed:.1e}")
        )
    for photons in (10**4,) if small else (10**5, 10**6, 10**7, 10**8):
        took, profile = timed(lambda n=photons: simulate_montecarlo(material, photons=n))
        apart = worst(profile.cumulative - reference.cumulative, total)
        stderr = worst(profile.cumulative_stderr, total)
        rows.append(
            (f"walk, {photons:.0e} photons", f"{took:.2f}", f"{apart:.1e}", f"{stderr:.1e}")
        )
    return rows


def command_rows(small):
    """Whole processes, start-up included, and the eleven materials in one process."""
    rows = []
    names = material_names(paper=True)[:2] if small else material_names(paper=True)
    with tempfile.TemporaryDirectory() as folder:
        cache = None if small else folder  # compiling takes 10 s
        compiling, _ = command("simulate", "skin1", "--method", "exact", cache=cache, folder=folder)
        rows.append(("`sssfit simulate skin1 --method exact`, first use", f"{compiling:.2f}"))
        times = [
            command("simulate", "skin1", "--method", "exact", folder=folder)[0]
            for _ in range(1 if small else 5)
        ]
        rows.append(("`sssfit simulate skin1 --method exact`", f"{statistics.median(times):.2f}"))
        each = [command("simulate", name, "--method", "exact", folder=folder)[0] for name in names]
        rows.append((f"{len(names)} materials, as many commands", f"{sum(each):.2f}"))
    took = seconds(lambda: simulate_exact_many([load_material(name) for name in names]))
    rows.append((f"{len(names)} materials, one process, without start-up", f"{took:.2f}"))
    return rows


def page(small):
    """All tables."""
    simulate_exact(load_material("skin1"), tolerance=0.1)  # compiled or loaded before anything
    simulate_montecarlo(load_material("skin1"), photons=2000)
    sections = [
        "# Benchmarks of the exact solver",
        "Made by `python tests/bench/bench_exact.py --write`; times depend on the machine. This "
        f"run: sssfit {sssfit.__version__}, {processor()}, Python {platform.python_version()}, "
        f"numpy {np.__version__}.",
        "## Speed against accuracy",
        "skin1, three channels, the paper's grid, all cores, without start-up. The error is the "
        "largest difference of F(r) from the solver's finest run, over all edges and channels, as "
        "a share of the total; the claim is the solver's error estimate, and the walk's largest "
        "standard error.",
        markdown(("run", "seconds", "error", "claimed"), accuracy_rows(small)),
        "## What a user waits for",
        "Seconds at the default tolerance of 1e-4.",
        markdown(("command", "seconds"), command_rows(small)),
    ]
    return "\n\n".join(sections) + "\n"


def main():
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks-exact.md")
    options = parser.parse_args()
    text = page(options.small)
    if options.write:
        write_page("benchmarks-exact.md", Path(__file__), text)
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
