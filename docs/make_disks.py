"""Write the section of docs/cascades.md on disks of fetches and the samplers of engines.

python docs/make_disks.py
"""

import numpy as np
from make_cascades import row, scenes, whole_profile
from sections import put_section

from sssfit.compare.engines import engines
from sssfit.compare.frames import over_frames
from sssfit.fit import fit_taps
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps

SHOWN = {"disk": 0, "edge at 30 degrees": 3, "head": 5, "points": 6}  # of the eight pictures
DISKS = (16, 24, 40)

TEXT = """skin1, exact profile, 256 x 256 pixels of 0.3 mm: 99th percentile of Delta E 2000 in one
frame, and its mean over the eight pictures:

| sampler | fetches | passes | {heads} | mean |
|---|---|---|---|---|---|---|---|
{samplers}

Our best disk (`--method disk`: rings of equal energy from the exact profile, exact energy in every
channel, bilinear fetches), averaged over frames. Once there are eight frames, the newest has a
weight of 1/8. Error against the true picture, and noise, the same figure against the mean of 64
frames:

| fetches | frames | {heads} | mean | mean noise |
|---|---|---|---|---|---|---|---|
{disks}
"""


def cases(profile):
    """Return the eight pictures, each with its truth."""
    return [(each, render_reference(each, profile)) for each in scenes(0.3)]


def figures(errors):
    """Return the cells of the shown pictures and of the mean over all."""
    return [*(f"{errors[k]:.2f}" for k in SHOWN.values()), f"{np.mean(errors):.2f}"]


def sampler_row(label, fetches, passes, picture, pictures):
    """Return a row of errors in one frame."""
    errors = [
        measure(picture(each), truth, mask=each.mask).delta_e_2000_p99 for each, truth in pictures
    ]
    return row([label, f"{fetches:.4g}", str(passes), *figures(errors)])


def sampler_rows(profile, pictures):
    """Return a row for the cascade, and for each engine."""
    table = fit_taps(profile).kernel
    label = f"cascade {table.structure}".replace("|", "\\|")
    yield sampler_row(
        label, table.fetches, table.passes, lambda each: render_taps(each, table), pictures
    )
    for engine in engines():
        yield sampler_row(
            engine.label,
            engine.fetches,
            engine.passes,
            lambda each, engine=engine: engine.render(each, profile),
            pictures,
        )


def disk_rows(profile, pictures, taps):
    """Return a row for one frame, 8 and 16."""
    table = fit_taps(profile, "disk", taps=taps).kernel
    found = [
        over_frames(lambda k, each=each: render_taps(each, table, frame=k), truth, mask=each.mask)
        for each, truth in pictures
    ]
    for frames in zip(*found, strict=True):
        noise = np.mean([each.noise_p99 for each in frames])
        errors = [each.error_p99 for each in frames]
        yield row([str(taps), str(frames[0].frames), *figures(errors), f"{noise:.2f}"])


def main():
    """Write the section."""
    profile = whole_profile("skin1")
    pictures = cases(profile)
    text = TEXT.format(
        heads=" | ".join(SHOWN),
        samplers="\n".join(sampler_rows(profile, pictures)),
        disks="\n".join(each for taps in DISKS for each in disk_rows(profile, pictures, taps)),
    )
    put_section("cascades.md", "docs/make_disks.py", text)


if __name__ == "__main__":
    main()
