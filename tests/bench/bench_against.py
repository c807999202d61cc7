"""Speed of the photon walks against those of another revision of this repository.

    python tests/bench/bench_against.py REVISION            a table on stdout, some two minutes
    python tests/bench/bench_against.py REVISION --write    the same into docs/benchmarks.md
    python tests/bench/bench_against.py REVISION --small    tiny sizes; needs git

The revision is checked out into a temporary worktree. Each side has a process of its own, held to
one core, which compiles first; then both do the same walk in turn, and medians of pairs are taken.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAIRS = 7

# Layers from the top down: eta, g, sigma_a and sigma_s (1/mm; of each channel), mm; and photons.
_INF = float("inf")
_SAMPLE = ((10.0, 0.9, 1.0), (1.0, 0.0, 1.0), (1.0, 0.7, 2.0))  # sigma_s, g and mm of MCML's sample
CASES = {
    "half space, g 0: skin1's green": (
        [(1.3, 0.0, [0.17], [0.88], _INF)],
        2_000_000,
    ),
    "thin: MCML's sample": (
        [(1.37, g, [a], [s], mm) for (s, g, mm), a in zip(_SAMPLE, (0.1, 0.1, 0.2), strict=True)],
        400_000,
    ),
    "thin: half a mean free path, g .9": ([(1.4, 0.9, [0.02], [10.0], 0.05)], 1_600_000),
    "thick: 2 and 18 mean free paths": (
        [(1.5, 0.8, [0.05], [4.0], 0.5), (1.33, 0.3, [0.3], [6.0], 3.0)],
        300_000,
    ),
    "thick: under a thin layer without end, g .95": (
        [(1.0, 0.5, [0.02], [5.0], 0.3), (1.4, 0.95, [0.01], [15.0], _INF)],
        60_000,
    ),
    "glass over and under thin tissue": (
        [
            (1.37, 0.8, [0.1], [5.0], 0.1),
            (1.5, 0.0, [0.0], [0.0], 1.0),
            (1.4, 0.9, [0.1], [10.0], 0.2),
            (1.52, 0.0, [0.0], [0.0], 1.0),
        ],
        800_000,
    ),
    "three channels: MCML's sample": (
        [
            (1.37, g, [a, 3.0 * a, 6.0 * a], [s] * 3, mm)
            for (s, g, mm), a in zip(_SAMPLE, (0.1, 0.1, 0.2), strict=True)
        ],
        400_000,
    ),
}


def side():
    """Answer a name and a number of photons on stdin with the seconds of that walk."""
    from sssfit.material import Layer, Material
    from sssfit.simulate import simulate_montecarlo

    for line in sys.stdin:
        name, photons = line.rstrip("\n").split("\t")
        layers, _ = CASES[name]
        count = len(layers[0][2])
        material = Material(
            "case",
            tuple("RGB"[:count]),
            tuple(Layer(eta, [g] * count, a, s, mm) for eta, g, a, s, mm in layers),
        )
        begun = time.process_time()
        simulate_montecarlo(material, photons=int(photons), threads=1, dr_mm=0.05, radius_mm=10.0)
        print(time.process_time() - begun, flush=True)


def start(tree, cache):
    """Start the process of one side, with the package of a working tree, on one core."""
    place = Path(cache) / "package"
    place.mkdir(parents=True)
    (place / "sssfit").symlink_to(Path(tree) / "sssfit")
    cores = sorted(os.sched_getaffinity(0))[-1:] if hasattr(os, "sched_getaffinity") else None
    return subprocess.Popen(
        [sys.executable, __file__, "--side"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={
            **os.environ,
            "PYTHONPATH": str(place),
            "XDG_CACHE_HOME": cache,
            "NUMBA_CACHE_DIR": "",
        },
        preexec_fn=(lambda: os.sched_setaffinity(0, cores)) if cores else None,
    )


def timed(process, name, photons):
    """Seconds of processor time of one walk in a side's process."""
    process.stdin.write(f"{name}\t{photons}\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def rows(old, new, share):
    """Times of both sides and their ratio, a row for each case."""
    for name, (_, photons) in CASES.items():
        walked = max(1000, int(photons * share))
        for process in (old, new):
            timed(process, name, 1000)
        pairs = [(timed(old, name, walked), timed(new, name, walked)) for _ in range(PAIRS)]
        rates = [walked / statistics.median(each) for each in zip(*pairs, strict=True)]
        ratio = statistics.median(a / b for a, b in pairs)
        yield f"| {name} | {rates[0]:,.0f} | {rates[1]:,.0f} | {ratio:.2f} |"


def table(revision, share):
    """The table, with the revision's commit."""
    git = ["git", "-C", str(ROOT)]
    commit = subprocess.run(
        [*git, "rev-parse", "--short", revision], check=True, capture_output=True, text=True
    ).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        subprocess.run([*git, "worktree", "add", "-q", "--detach", tree, commit], check=True)
        sides = [start(tree, f"{folder}/old"), start(ROOT, f"{folder}/new")]
        try:
            found = list(rows(*sides, share))
        finally:
            for process in sides:
                process.stdin.close()
                process.wait()
            subprocess.run([*git, "worktree", "remove", "--force", tree], check=True)
    head = f"| layers | {commit} | now | ratio |\n|---|---|---|---|\n"
    return commit, head + "\n".join(found)


def main():
    """Print the table, or write it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("revision", nargs="?", help="commit, branch or tag to compare with")
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
    parser.add_argument("--side", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.side:
        side()
        return
    if options.revision is None:
        parser.error("name a revision to compare with")
    commit, text = table(options.revision, 0.0 if options.small else 1.0)
    if not options.write:
        print(text)
        return
    sys.path.insert(0, str(ROOT / "docs"))
    from sections import put_section

    script = "tests/bench/bench_against.py"
    page = (
        "## The walks against earlier ones\n\nPhotons a second of processor time on one "
        f"core, by the walks of revision {commit} and by those of today, in turn; medians of "
        f"{PAIRS} pairs. Annuli of 0.05 mm, to 10 mm.\n\n{text}"
    )
    put_section("benchmarks.md", script, page, f"python {script} {commit} --write")


if __name__ == "__main__":
    main()
