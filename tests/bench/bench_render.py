"""Speed of the flat renderers: tables on stdout, or docs/benchmarks-render.md with ``--write``.

    python tests/bench/bench_render.py            full size, a minute
    python tests/bench/bench_render.py --write    the same into docs/benchmarks-render.md
    python tests/bench/bench_render.py --small    some seconds, for compiling; the tests run it

Whatever is compared is done in turn in the same run, and the best time of each counts: other work
on the machine only ever adds. OpenCV's row needs `pip install opencv-python-headless`.
"""

import argparse
import importlib.util
import itertools
import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import scipy
import scipy.fft
from scipy.ndimage import convolve1d

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "bench")]

from bench_exact import timed  # noqa: E402
from bench_walk import markdown, processor, write_page  # noqa: E402

import sssfit  # noqa: E402
from sssfit.kernel import Stage, Taps  # noqa: E402
from sssfit.render.cascade import apply_cascade  # noqa: E402
from sssfit.render.reference import convolve, padded_shape  # noqa: E402
from sssfit.render.separable import apply_passes  # noqa: E402

# Prints what the first use of the passes takes, without imports, in one precision and in both.
FIRST_USE = """
import sys, time
import numpy as np
import sssfit._jit.passes
from sssfit.render.separable import apply_passes
for dtype in (np.float32, np.float64):
    begun = time.perf_counter()
    apply_passes(np.ones((8, 8, 3), dtype), np.ones((1, 25, 3)), np.ones((1, 3)))
    print(time.perf_counter() - begun)
"""


def best_of(runs, jobs):
    """Least seconds of each piece of work, all done in turn, and what it returned."""
    best, results = dict.fromkeys(jobs, np.inf), {}
    for _ in range(runs + 1):  # the first, with all that is loaded and compiled, counts too
        for name, work in jobs.items():
            took, results[name] = timed(work)
            best[name] = min(best[name], took)
    return best, results


def gaussian(pixels):
    """A pass of that many weights, out to three standard deviations."""
    x = np.arange(pixels) - pixels // 2
    weights = np.exp(-0.5 * (6.0 * x / pixels) ** 2)
    return weights / weights.sum()


def opencv(threads=1):
    """sepFilter2D with its mirror borders, if OpenCV is installed."""
    if importlib.util.find_spec("cv2") is None:
        return None
    import cv2

    def filtered(picture, line):
        cv2.setNumThreads(threads)
        return cv2.sepFilter2D(picture, -1, line, line, borderType=cv2.BORDER_REFLECT)

    return filtered


def opencv_release():
    """Its name and release, as of the package that is installed."""
    if importlib.util.find_spec("cv2") is None:
        return "OpenCV"
    import cv2

    return f"OpenCV {cv2.__version__}"


def scipys(picture, line):
    """scipy.ndimage along x and along y; its default border is our mirror."""
    return convolve1d(convolve1d(picture, line, axis=1), line, axis=0)


def pass_rows(pixels, side, runs):
    """RGB in float32 and float64: ours, scipy's, OpenCV's."""
    double = np.random.default_rng(1).random((side, side, 3))
    single, line = double.astype(np.float32), gaussian(pixels)
    term = np.repeat(line[None, :, None], 3, axis=2), np.ones((1, 3))
    line32 = line.astype(np.float32)
    jobs = {
        "float32, one thread": lambda: apply_passes(single, *term, threads=1),
        "float32, two threads": lambda: apply_passes(single, *term, threads=2),
        "float64, one thread": lambda: apply_passes(double, *term, threads=1),
        "float64, two threads": lambda: apply_passes(double, *term, threads=2),
        "scipy.ndimage.convolve1d, float32": lambda: scipys(single, line32),
        "scipy.ndimage.convolve1d, float64": lambda: scipys(double, line),
    }
    if filtered := opencv():
        jobs["cv2.sepFilter2D, float32"] = lambda: filtered(single, line32)
    best, results = best_of(runs, jobs)
    mark, truth = best["scipy.ndimage.convolve1d, float32"], results["float64, one thread"]
    rows = [
        (name, f"{took:.4f}", f"{mark / took:.1f}", f"{np.abs(results[name] - truth).max():.1e}")
        for name, took in best.items()
    ]
    return rows if filtered else [*rows, ("cv2.sepFilter2D, float32", *["not installed"] * 3)]


def cascade():
    """1-1|2-2|2-2 for pixels of 1 mm, with offsets as of skin1's at .3 mm."""
    stages = []
    for level, texels in ((0, [0.5]), (0, [1.25]), (1, [1.2, 3.3]), (1, [2.1, 4.5]),
                          (2, [2.4, 5.2]), (2, [5.2, 11.7])):  # fmt: skip
        weights = np.full((len(texels) + 1, 3), 1.0 / (2 * len(texels) + 1))
        stages.append(Stage(level, "pair", np.array(texels) * 2.0**level, weights))
    return Taps(
        method="by hand",
        mm_per_pixel=1.0,
        channels=("R", "G", "B"),
        chained=True,
        stages=tuple(stages),
        blend=np.full((7, 3), 0.1),
        errors={"spectral": np.full(3, np.nan), "energy": np.full(3, np.nan)},
        meta={},
    )


def cascade_rows(side, runs):
    """A cascade in float32 beside two dense passes of 37 weights by OpenCV, on the same threads."""
    picture = np.random.default_rng(3).random((side, side, 3)).astype(np.float32)
    taps, line = cascade(), gaussian(37).astype(np.float32)
    jobs = {}
    for threads in (1, 2):
        jobs["ours", threads] = lambda n=threads: apply_cascade(picture, taps, 1.0, threads=n)
        if filtered := opencv(threads):
            jobs["OpenCV", threads] = lambda f=filtered: f(picture, line)
    best, results = best_of(runs, jobs)
    if not np.array_equal(results["ours", 1], results["ours", 2]):
        raise SystemExit("the cascade's bits depend on the number of threads")
    rows = []
    for threads in (1, 2):
        ours, dense = best["ours", threads], best.get(("OpenCV", threads))
        theirs = [f"{dense:.4f}", f"{ours / dense:.2f}"] if dense else ["not installed"] * 2
        rows.append((str(threads), f"{ours:.4f}", *theirs))
    return rows


def compile_rows(small):
    """First use with an empty folder for machine code, and the next one."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        cache = {} if small else {"NUMBA_CACHE_DIR": folder}  # compiling takes 10 s
        for what in ("first use, compiling", "next process"):
            ended = subprocess.run(
                [sys.executable, "-c", FIRST_USE],
                env=os.environ | cache,
                capture_output=True,
                text=True,
                check=True,
            )
            rows.append((what, *(f"{float(word):.2f}" for word in ended.stdout.split())))
    return rows


def reference_rows(small, runs):
    """The true kernel by FFT beside a bare transform there and back of the same padded size."""
    rng, rows = np.random.default_rng(2), []
    sizes = [(64, 20)] if small else [(2048, 100), (1024, 256), (1024, 1023)]
    for (side, half), border in itertools.product(sizes, ("mirror", "zero")):
        shape = padded_shape(side, side, half, border)
        padded, picture = rng.random(shape), rng.random((side, side, 3))
        quadrant = rng.random((half + 1, half + 1, 3))

        def bare(padded=padded, shape=shape):
            for _ in range(3):
                scipy.fft.irfft2(scipy.fft.rfft2(padded, workers=2), s=shape, workers=2)

        def ours(channels, picture=picture, quadrant=quadrant, border=border):
            return convolve(picture[:, :, :channels], quadrant, border=border, threads=2)

        jobs = {"bare": bare, "ours": lambda o=ours: o(3), "gray": lambda o=ours: o(1)}
        best, _ = best_of(runs, jobs)
        took = [best["bare"], best["ours"], best["ours"] / best["bare"], best["gray"]]
        name = f"{side} x {side}, {border}"
        size = f"{2 * half + 1} x {2 * half + 1}", f"{shape[0]} x {shape[1]}"
        rows.append((name, *size, *(f"{each:.3f}" for each in took)))
    return rows


def page(small):
    """All tables."""
    side, runs = (64, 1) if small else (2048, 7)
    heads = ("work", "seconds", "speed-up over scipy", "largest difference")
    sections = [
        "# Benchmarks of renderers",
        "Made by `python tests/bench/bench_render.py --write`; times depend on the machine. This "
        f"run: sssfit {sssfit.__version__}, {processor()}, Python {platform.python_version()}, "
        f"numpy {np.__version__}, scipy {scipy.__version__}. Best of {runs + 1}, run in turn.",
        "## Separable passes",
        f"One term on {side} x {side} RGB, mirrored borders. The ratio is to scipy's float32, the "
        "difference to our float64. OpenCV (`pip install opencv-python-headless`) uses one thread.",
        "### 25 weights",
        markdown(heads, pass_rows(25, side, runs)),
        "### 427 weights",
        "As many as skin1 has on pixels of 0.1 mm.",
        markdown(heads, pass_rows(427, side, 1 if small else 3)),
        "### Compiling",
        "Seconds until the first picture is blurred, without imports.",
        markdown(("process", "float32", "float64 after it"), compile_rows(small)),
        "## A cascade",
        f"1-1|2-2|2-2 on {side} x {side} RGB in float32 beside OpenCV's sepFilter2D with 37 "
        "weights a pass, mirrored borders. OpenCV 4.12 runs it on one thread, 5.0 on all.",
        markdown(
            ("threads", "cascade, s", f"{opencv_release()}, s", "ratio"), cascade_rows(side, runs)
        ),
        "## The true kernel by FFT",
        "RGB in float64, two threads. For comparison (bare), three pairs of scipy.fft's rfft2 and "
        "irfft2 at the padded size; last, one channel of irradiance with three of the kernel.",
        markdown(
            ("picture", "kernel", "padded", "bare, s", "ours, s", "ratio", "one for three, s"),
            reference_rows(small, runs),
        ),
    ]
    return "\n\n".join(sections) + "\n"


def main():
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks-render.md")
    options = parser.parse_args()
    text = page(options.small)
    if options.write:
        write_page("benchmarks-render.md", Path(__file__), text)
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
