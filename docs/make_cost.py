"""Write a section of docs/how-to-choose.md: our seconds beside the papers' milliseconds, as ratios.

python docs/make_cost.py
"""

import time

import numpy as np
from sections import put_section

from sssfit.measure.cost import seconds_per_megapixel
from sssfit.render.separable import apply_passes

HEIGHT, WIDTH, CHANNELS = 1080, 1920, 3
SAMPLES = (9, 17, 33)
REPEATS, ROUNDS = 12, 4  # in turns: what else the machine does then hits all alike
# RR-02-12: table 2, GTX 580, GTX 470 and GT 130M, close; figure 5, GTX 470, all at 1080p.
PAPER_PASSES_MS = {"GTX 580": (1.05, 3.07), "GTX 470": (4.6, 10.38), "GT 130M": (13.66, 40.02)}
PAPER_SAMPLES_MS = (1.02, 1.77, 3.15)

TEXT = """## Cost compared with the papers

{height} x {width} RGB in float32 on one core, seconds of processor time per megapixel, least of
{repeats}. The report gives milliseconds on graphics cards, so only ratios can be compared.

| passes of 17 weights | ours | ratio | report's ratio, table 2, close views |
|---|---|---|---|
{passes}

| weights a pass, two passes | ours | ratio | report, figure 5 (ms) | ratio |
|---|---|---|---|---|
{samples}

Six times the passes take {pass_ratio:.1f} times as long here, and 2.3 to 2.9 times as long in the
report. Its figures include a fixed part, given as 0.1 ms for two passes and 0.71 ms for six
Gaussians where nothing scatters, and it does not say how many samples each Gaussian has. From 9
to 33 weights, 3.7 times as many, the time grows {sample_ratio:.1f} times here and 3.1 times in
the report. Here a pass has a high cost at any number of weights, so fewer terms save more than
shorter passes.
"""


def seconds(terms, pixels):
    """Time 2 x terms passes of so many weights, per 1e6 pixels."""
    random = np.random.default_rng(1)
    picture = random.random((HEIGHT, WIDTH, CHANNELS), dtype=np.float32)
    half = random.random((terms, pixels // 2 + 1, CHANNELS)) + 0.1
    weights = np.concatenate((half[:, :0:-1], half), axis=1)
    signs = np.ones((terms, CHANNELS))
    return seconds_per_megapixel(
        lambda: apply_passes(picture, weights, signs, threads=1),
        HEIGHT * WIDTH,
        repeats=REPEATS // ROUNDS,
        clock=time.process_time,
    )


def least_seconds():
    """Return the least time of each case, (terms, weights)."""
    cases = [*((1, each) for each in SAMPLES), (6, 17)]
    rounds = [{case: seconds(*case) for case in cases} for _ in range(ROUNDS)]
    return {case: min(each[case] for each in rounds) for case in cases}


def section():
    """Return the section's text."""
    found = least_seconds()
    two, twelve = found[1, 17], found[6, 17]
    theirs = ", ".join(f"{six / one:.2f} ({card})" for card, (one, six) in PAPER_PASSES_MS.items())
    passes = [
        f"| 2, one term | {two:.4f} | 1 | 1 |",
        f"| 12, six Gaussians | {twelve:.4f} | {twelve / two:.2f} | {theirs} |",
    ]
    ours = [found[1, each] for each in SAMPLES]
    samples = [
        f"| {n} | {mine:.4f} | {mine / ours[0]:.2f} | {ms} | {ms / PAPER_SAMPLES_MS[0]:.2f} |"
        for n, mine, ms in zip(SAMPLES, ours, PAPER_SAMPLES_MS, strict=True)
    ]
    return TEXT.format(
        height=HEIGHT,
        width=WIDTH,
        repeats=REPEATS,
        passes="\n".join(passes),
        samples="\n".join(samples),
        pass_ratio=twelve / two,
        sample_ratio=ours[-1] / ours[0],
    )


def main():
    """Put the section in its place."""
    put_section("how-to-choose.md", "docs/make_cost.py", section())


if __name__ == "__main__":
    main()
