"""Write the section of docs/motion.md on cost: the seconds of a frame by its samples.

python docs/make_motion_cost.py
"""

import os
import time

import numpy as np
from make_motion import PITCH_MM, row, scenes, skin1
from sections import put_section

from sssfit.render.adaptive import make_sampler, render_samples

COUNTS = (1, 2, 4, 8, 16, 32, 64)
ROUNDS = 25  # in turns: what else the machine does then hits all alike

TEXT = """A frame of the head, 512 x 512 pixels of skin1 in three channels, on two threads. Figures
are the least of {rounds} runs: the processor time of both threads, the line a + b n fitted to it by
relative error, and the wall-clock time, from which the rate is computed. The load of the machine
was {load:.1f} on {cores} cores, ours included:

| samples a pixel n | processor, ms | line, ms | off | clock, ms | million samples a second |
|---|---|---|---|---|---|
{rows}

a = {a:.1f} ms, b = {b:.2f} ms; the largest distance from the line is {off:.1f} %.
"""


def least_ms(scene, sampler):
    """Return the least processor time and the least time on the clock (7, 2), by samples."""
    least = np.full((len(COUNTS), 2), np.inf)
    render_samples(scene, sampler, 1, threads=2)  # compiles
    for _ in range(ROUNDS):
        for k, n in enumerate(COUNTS):
            begun = time.process_time(), time.perf_counter()
            render_samples(scene, sampler, n, threads=2)
            took = time.process_time() - begun[0], time.perf_counter() - begun[1]
            least[k] = np.minimum(least[k], 1e3 * np.array(took))
    return least


def main():
    """Time frames by their samples."""
    (scene, *_) = scenes()
    cpu, clock = least_ms(scene, make_sampler(skin1(), PITCH_MM)).T
    n = np.array(COUNTS, dtype=float)
    ratios = np.stack((1.0 / cpu, n / cpu), axis=1)
    a, b = np.linalg.lstsq(ratios, np.ones(n.size), rcond=None)[0]
    line = a + b * n
    rates = n * scene.height * scene.width / clock / 1e3
    rows = [
        row(
            [
                f"{count}",
                f"{own:.1f}",
                f"{fitted:.1f}",
                f"{100.0 * (own / fitted - 1.0):+.1f} %",
                f"{wall:.1f}",
                f"{rate:.1f}",
            ]
        )
        for count, own, fitted, wall, rate in zip(COUNTS, cpu, line, clock, rates, strict=True)
    ]
    text = TEXT.format(
        rounds=ROUNDS,
        load=os.getloadavg()[0],
        cores=os.cpu_count(),
        rows="\n".join(rows),
        a=a,
        b=b,
        off=100.0 * np.abs(cpu / line - 1.0).max(),
    )
    put_section("motion.md", "docs/make_motion_cost.py", text)


if __name__ == "__main__":
    main()
