"""Time and error of fits: tables on stdout, or docs/benchmarks-fit.md with ``--write``.

    python tests/bench/bench_fit.py            full size, some minutes
    python tests/bench/bench_fit.py --write    the same into docs/benchmarks-fit.md
    python tests/bench/bench_fit.py --small    ten seconds; the tests run it

The whole 2473 x 2473 kernel of skin1 goes to numpy's SVD in the same run as its quadrant to ours.
"""

import argparse
import math
import platform
import resource
import sys
import warnings
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

from bench_exact import timed  # noqa: E402
from bench_walk import markdown, processor, write_page  # noqa: E402

import sssfit  # noqa: E402
from sssfit.errors import SssfitWarning  # noqa: E402
from sssfit.fit import METHODS, fit_svd, support_of  # noqa: E402
from sssfit.fit._gaussians_search import forget_searches  # noqa: E402
from sssfit.fit.svd import eigenpairs  # noqa: E402
from sssfit.material import load_material, material_names  # noqa: E402
from sssfit.profile import full_kernel  # noqa: E402
from sssfit.simulate import simulate_exact  # noqa: E402

RANK = 6


def solver_rows(small):
    """One channel of skin1: the matrix, our eigenvalues, numpy's of the whole kernel."""
    profile = simulate_exact(load_material("skin1"))
    pitch = 0.5 if small else float(profile.r_edges_mm[1])
    half = int(profile.r_edges_mm[-1] / pitch + 1e-9)
    matrix, quadrant = timed(lambda: profile.quadrant_kernel(pitch, half, channel=0))
    with threadpool_limits(1, user_api="blas"):
        eigenpairs(quadrant, RANK)  # scipy loaded
        ours, (values, _) = timed(lambda: eigenpairs(quadrant, RANK))
        whole = full_kernel(quadrant)
        numpys, (_, singular, _) = timed(lambda: np.linalg.svd(whole))
    apart = np.abs(np.abs(values) - singular[:RANK]).max() / singular[0]
    size = f"{len(whole)} x {len(whole)}"
    return [
        ("the quadrant's pixels", size, f"{matrix:.3f}", "0"),
        ("rank 6 of the quadrant", size, f"{ours:.4f}", f"{apart:.0e}"),
        ("numpy.linalg.svd of the whole", size, f"{numpys:.3f}", "0"),
    ]


def whole_fit_rows(small):
    """All channels on the paper's grid, support the whole grid, pixels and errors included."""
    rows = []
    for name in ("skin1", "ketchup"):
        profile = simulate_exact(load_material(name))
        pitch = 0.5 if small else "profile"
        reach = float(profile.r_edges_mm[-1])
        pixels_mm = {"mm_per_pixel": pitch, "support_mm": reach}
        took, found = timed(lambda p=profile, m=pixels_mm: fit_svd(p, rank=RANK, **m))
        pixels = found.kernel.pixels
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        rows.append((name, f"{pixels} x {pixels}", f"{took:.2f}", f"{memory:.0f}"))
    return rows


def fitted(function, profile, **settings):
    """Fit with nothing kept from earlier fits of the same profile."""
    forget_searches()
    return function(profile, **settings)


def limit_rows(small):
    """The fits that have a time limit of their own, three channels of skin1."""
    profile = simulate_exact(load_material("skin1"))
    support = support_of(profile)
    asked = [("gaussians, 6 terms", "gaussians", {"terms": 6}, 427, 1)]
    asked += [(f"guided, k = {k:g}", "guided", {"k": k}, 257, 10) for k in (0, 1.55, 4)]
    asked += [("guided, k = 1.55", "guided", {}, 513, 60)]
    rows = []
    for label, method, own, pixels, limit in asked:
        pitch = 1.0 if small else support / (pixels // 2 + 0.001)
        settings = {"mm_per_pixel": pitch, **own}
        took, found = timed(lambda f=METHODS[method].fit, s=settings: fitted(f, profile, **s))
        rows.append((label, str(found.kernel.pixels), f"{took:.2f}", str(limit)))
    return rows


def method_rows(small):
    """Every method on every material with its own defaults, at 0.1 mm or 513 pixels."""
    rows = []
    names = material_names(paper=True)[:1] if small else material_names(paper=True)
    for name in names:
        profile = simulate_exact(load_material(name))
        # guided takes up to 513 pixels; bright materials reach further than 25 mm.
        pitch = 1.0 if small else max(0.1, math.ceil(support_of(profile) / 2.56) / 100.0)
        for method, each in METHODS.items():
            took, found = timed(lambda p=profile, f=each.fit, m=pitch: fitted(f, p, mm_per_pixel=m))
            errors = [f"{100 * error:.3g}" for error in found.relative_frobenius_error]
            energy = 100 * np.abs(found.energy_error).max()
            energy_error = f"{energy:.2g}" if energy > 1e-9 else "0"  # else but rounding
            row = (f"{name}, {method}", f"{pitch:g}", str(found.kernel.rank), *errors, energy_error)
            rows.append((*row, f"{took:.2f}"))
    return rows


def page(small):
    """All tables."""
    sections = [
        "# Benchmarks of fits",
        "Made by `python tests/bench/bench_fit.py --write`; times depend on the machine. This run: "
        f"sssfit {sssfit.__version__}, {processor()}, Python {platform.python_version()}, numpy "
        f"{np.__version__}.",
        "## Singular values of skin1's red kernel",
        "One thread; the last column is the largest difference of the six singular values, as a "
        "share of the first.",
        markdown(("work", "pixels", "seconds", "difference"), solver_rows(small)),
        "## Rank 6 of three channels on the paper's grid",
        "Seconds for pixels, terms and errors together, and the peak memory of the process.",
        markdown(("material", "pixels", "seconds", "MB"), whole_fit_rows(small)),
        "## Gaussians and the guided fit",
        "Three channels of skin1, exact profile; seconds, and the limit in seconds.",
        markdown(("fit", "pixels", "seconds", "allowed"), limit_rows(small)),
        "## All methods, all materials",
        "Exact profiles, pixels of 0.1 mm (wider where 513 pixels do not hold 99.9 % of the "
        "energy), each method with its defaults: relative Frobenius error of each channel and the "
        "largest energy error in percent.",
        markdown(
            ("material, method", "mm", "terms", "R", "G", "B", "energy", "seconds"),
            method_rows(small),
        ),
    ]
    return "\n\n".join(sections) + "\n"


def main():
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks-fit.md")
    warnings.simplefilter("ignore", SssfitWarning)  # steep profiles and spikes: known here
    options = parser.parse_args()
    text = page(options.small)
    if options.write:
        write_page("benchmarks-fit.md", Path(__file__), text)
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
