"""What sweeps cost on workers of this machine and on a Dask cluster: curves, and to 1000 cores.

    python tests/bench/bench_sweep.py            tables, some ten minutes on two cores
    python tests/bench/bench_sweep.py --write    the same into docs/scaling.md
    python tests/bench/bench_sweep.py --small    seconds, to see that it runs

Times include the start and the end of the workers. Memory is the largest resident size of any
worker, seen when a point is finished, every two seconds at most.
"""

import argparse
import pickle
import statistics
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / "bench"), str(ROOT / "docs")]

from bench_walk import markdown, processor  # noqa: E402
from sections import put_section  # noqa: E402

import sssfit  # noqa: E402
from sssfit.simulate.batches import code_version  # noqa: E402
from sssfit.sweep import load_plan, sweep_to_store  # noqa: E402
from sssfit.sweep.cluster import Cluster  # noqa: E402
from sssfit.sweep.tasks import Task, parts_of, perform, point_steps, tasks_of  # noqa: E402

SCRIPT = "tests/bench/bench_sweep.py"
EXAMPLE = ROOT / "docs" / "examples" / "skin-spectral.toml"
CORES = (2, 10, 100, 1000)
LIBRARY = 1_000_000  # points of the extrapolation
TASK_SECONDS = 2.0  # of a full task
LOOK_SECONDS = 2.0  # between two looks at the workers' memory
PLACES = {"processes": {"threads": 2}, "cluster": {"scheduler": "local:2"}}
EMPTY = Task((), 0.0, code_version())


def skin_plan(photons, bands=25):
    """The example's plan over the first of its wavelengths: 8 points each."""
    plan = load_plan(EXAMPLE)
    *others, spectrum = plan.axes
    columns = {name: each[:bands] for name, each in spectrum.columns.items()}
    axes = (*others, replace(spectrum, values=spectrum.values[:bands], columns=columns))
    return replace(plan, axes=axes, settings={"photons": photons})


def albedo_plan(photons, albedos):
    """Half spaces of several albedos and one index."""
    plan = load_plan(ROOT / "docs" / "examples" / "lut-albedo-eta.toml")
    albedo, eta = plan.axes
    axes = (replace(albedo, values=albedos), replace(eta, values=eta.values[:1]))
    return replace(plan, axes=axes, method="montecarlo", settings={"photons": photons})


def measured(plan, folder, every=LOOK_SECONDS, **where):
    """Seconds, this process's own of them on processors, and the largest worker's bytes."""
    largest, looked = 0, 0.0

    def look(*_):
        nonlocal largest, looked
        if time.monotonic() < looked + every:  # a look takes 10 ms of the client
            return
        looked = time.monotonic()
        for each in psutil.Process().children(recursive=True):
            try:
                largest = max(largest, each.memory_info().rss)
            except psutil.NoSuchProcess:
                continue

    begun, own = time.perf_counter(), time.process_time()
    sweep_to_store(plan, folder / "x.zarr", progress=look, force=True, **where)
    return time.perf_counter() - begun, time.process_time() - own, largest


def costs(folder, photons, bands, pairs):
    """One sweep on processes and on a cluster in turn, on one worker and two; the table."""
    plan, rows = skin_plan(photons, bands), []
    for workers in (1, 2):
        places = {"processes": {"threads": workers}, "cluster": {"scheduler": f"local:{workers}"}}
        runs = {name: [] for name in places}
        for _ in range(pairs if workers == 2 else 1):
            for name, where in places.items():
                runs[name].append(measured(plan, folder, **where))
        middle = {name: statistics.median(each[0] for each in of) for name, of in runs.items()}
        for name, of in runs.items():
            client = 1e3 * statistics.median(each[1] for each in of) / plan.count
            more = 100.0 * (middle[name] / middle["processes"] - 1.0)
            largest = max(each[2] for each in of) / 1e6
            is_apart = largest > 0.0  # one process does the work itself
            rows.append(
                (
                    *(name, str(workers), f"{middle[name]:.1f}"),
                    *(f"{plan.count / middle[name]:.1f}", f"{more:+.1f} %"),
                    *((f"{client:.1f}", f"{largest:.0f}") if is_apart else ("-", "-")),
                )
            )
    heads = ("where", "workers", "s", "points/s", "more", "ms of the client a point", "MB a worker")
    return plan, markdown(heads, rows)


def memory(folder, photons, sizes):
    """The largest resident size of any of two workers by the points of a sweep; the table."""
    rows = []
    for points in sizes:
        plan = albedo_plan(photons, tuple(np.linspace(0.5, 0.99, points).tolist()))
        cells = [measured(plan, folder, 0.1, **where)[2] / 1e6 for where in PLACES.values()]
        rows.append((f"{points}", *(f"{each:.0f}" for each in cells)))
    return markdown(("points", *(f"MB a worker, {name}" for name in PLACES)), rows)


def client_seconds(folder, photons, bands):
    """Seconds of the client's processor for each further point, on a cluster."""
    plans = [skin_plan(photons, each) for each in (bands, 5 * bands)]
    own = [measured(plan, folder, scheduler="local:2")[1] for plan in plans]
    return (own[1] - own[0]) / (plans[1].count - plans[0].count)


def by_photons(folder, numbers, bands):
    """Points and photons a second by the photons of a point, on two workers; the table."""
    rows = []
    for photons in numbers:
        plan = skin_plan(photons, bands)
        for name, where in PLACES.items():
            seconds = measured(plan, folder, **where)[0]
            rate = plan.count / seconds
            rows.append((f"{photons:.0e}", name, f"{rate:.1f}", f"{rate * photons / 1e6:.3f}"))
    return markdown(("photons a point", "where", "points/s", "million photons/s"), rows)


def by_albedo(photons, albedos):
    """Seconds of one core by the albedo, and the steps that were predicted; the table."""
    plan, rows = albedo_plan(photons, albedos), []
    perform(plan, whole(plan, 0))
    for index, albedo in enumerate(albedos):
        begun = time.process_time()
        perform(plan, whole(plan, index))
        seconds = time.process_time() - begun
        steps = point_steps(plan, index)
        rows.append(
            (
                *(f"{albedo:g}", f"{seconds:.2f}", f"{photons / seconds / 1e6:.2f}"),
                *(f"{steps / photons:.0f}", f"{1e9 * seconds / steps:.1f}"),
            )
        )
    heads = ("albedo", "s of a core", "million photons/s", "steps a photon, predicted", "ns a step")
    return markdown(heads, rows)


def whole(plan, index):
    """The task of a whole point, whatever its length."""
    return Task(tuple(parts_of(plan, index, 1.0)), 0.0, code_version())


def one_task(plan, calls):
    """Milliseconds of a task that does nothing, and the bytes of a point's way there and back."""
    with Cluster(plan, "local:1") as cluster:
        cluster.submit(EMPTY).result()
        begun = time.perf_counter()
        for each in [cluster.submit(EMPTY) for _ in range(calls)]:
            each.result()
        seconds = (time.perf_counter() - begun) / calls
    task = next(tasks_of(plan, range(plan.count), 2))
    asked, found = len(pickle.dumps((plan, task))), len(pickle.dumps(perform(plan, task)))
    return 1e3 * seconds, asked, found / len(task.parts)


def extrapolated(client, per_point, work, photons):
    """Hours and efficiency of a library on up to 1000 cores; the table.

    ``client`` and ``work`` are seconds a point, of the client and of a worker.
    """
    rows = []
    for more in (1, 10):
        for cores in CORES:
            shared, served = LIBRARY * more * work / cores, LIBRARY * client
            seconds = max(shared, served) + TASK_SECONDS
            rows.append(
                (
                    *(f"{more * photons:.0e}", str(cores), f"{seconds / 3600:.2f}"),
                    f"{100 * shared / seconds:.0f} %",
                    f"{LIBRARY * per_point / seconds / 1e6:.2f}",
                    "cores" if shared > served else "the client",
                )
            )
    heads = ("photons a point", "cores", "hours", "efficiency", "MB/s to the client", "limit")
    return markdown(heads, rows)


def section(small):
    """All tables, as they stand in docs/scaling.md."""
    photons, bands, pairs = (2_000, 1, 1) if small else (300_000, 25, 3)
    numbers = (1e3, 2e3) if small else (1e4, 1e5, 1e6)
    with tempfile.TemporaryDirectory() as made:
        plan, table = costs(Path(made), photons, bands, pairs)
        curve = by_photons(Path(made), [int(each) for each in numbers], 1 if small else 6)
        sizes = memory(Path(made), 2000, (5, 10) if small else (50, 500))
        client = client_seconds(Path(made), int(numbers[0]), 1 if small else 5)
    begun = time.process_time()
    for index in range(plan.count):
        perform(plan, whole(plan, index))
    work = (time.process_time() - begun) / plan.count
    task_ms, asked, found = one_task(plan, 20 if small else 500)
    return "\n\n".join(
        [
            f"Measured with sssfit {sssfit.__version__} on {processor()}.",
            f"{plan.count} points of the two-layer skin, {photons:,} photons each, on processes of "
            "this machine and on a Dask cluster of as many workers, with its start and end; "
            f"two workers: medians of {pairs} in turn. The client's time is that of its processor, "
            "the scheduler of local:N included.",
            table,
            "Memory by the points of a sweep, 2,000 photons each, on two workers:",
            sizes,
            "Points of more and fewer photons, on two workers:",
            curve,
            f"One core by the albedo, {photons:,} photons:",
            by_albedo(photons, (0.5, 0.9, 0.99, 0.999, 0.9999)),
            f"A task that does nothing takes {task_ms:.1f} ms of client and scheduler. It is sent "
            f"in {asked / 1e3:.1f} kB, and a point comes back in {found / 1e3:.1f} kB. A point of "
            f"{photons:,} photons takes {work:.2f} s of a core.",
            f"**Extrapolated**, not measured: {LIBRARY:,} such points, on cores like these, with "
            f"one client, which takes {1e3 * client:.1f} ms for each further point, and "
            f"{TASK_SECONDS:.0f} s for the last task to end.",
            extrapolated(client, found, work, photons),
        ]
    )


def main():
    """Print the tables, or write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--small", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--write", action="store_true", help="into docs/scaling.md")
    given = parser.parse_args()
    text = section(given.small)
    if given.write:
        put_section("scaling.md", SCRIPT, text, f"python {SCRIPT} --write")
    else:
        sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
