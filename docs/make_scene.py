"""Write the sections of docs/scene.md, and draw their figures.

python docs/make_scene.py table errors full geometry pictures    ten minutes; or some of them
"""

import argparse
import math
from pathlib import Path

import numpy as np
from PIL import Image
from sections import put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.crowd.frame import measure_frame
from sssfit.crowd.row import RESOLUTION as FULL
from sssfit.crowd.row import Row
from sssfit.crowd.runner import six_gaussians
from sssfit.crowd.table import ALL, DISTANCES, HEADS, MAP_SIZE, RESOLUTION, measure_table
from sssfit.render.texture import Savings, render_texture

DOCS = Path(__file__).parent
CELLS = [(heads, distance) for heads in (1, 4, 16) for distance in (2.5, 10.0, 50.0)]
COUNTING = {"map_size": 256, "screen": False}  # texels are counted, not timed


def row(cells):
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def lines(head, rows):
    """Return a table."""
    return "\n".join([row(head), row(["---"] * len(head)), *map(row, rows)])


# The paper's table

TABLE_TEXT = """Six Gaussians of skin1, maps of {maps} texels and pictures of {width} x {height}
pixels, both a quarter of the paper's; all three savings, culled by normals of vertices. Each cell
has the factor by which fewer texels are convolved, our speed-up (on {cores} cores) and the paper's
speed-up:

{table}

Our factor is at least the paper's speed-up in {above} of {cells} cells by texels and in {faster} by
time. The mean Delta E of the savings is {worst:.2f} at most, at {where}.

![Speed-ups, texture space beside screen space, and the error of the savings](scene-table.png)

Texels convolved in texture space with all savings, over pixels that screen space convolves by the
same kernel; where it is below 1, texture space computes less:

{screen}"""


def table():
    """Measure Table 1 in full."""
    from sssfit.process import thread_count

    found = measure_table(six_gaussians())
    save_figure(figure_of(found), DOCS / "scene-table.png")
    errors = np.array([[f.work["saved"].mean_delta_e for f in each] for each in found.frames])
    worst = np.unravel_index(errors.argmax(), errors.shape)
    head = ["heads", *(f"{each:g} units" for each in DISTANCES)]
    cells = zip(HEADS, found.texels, found.seconds, found.published, strict=True)
    rows = [
        [str(heads), *(f"{a:.2f} / {b:.2f} / {c:.2f}" for a, b, c in zip(*parts, strict=True))]
        for heads, *parts in cells
    ]
    ratio = [
        [str(h), *(f"{x:.2f}" for x in each)]
        for h, each in zip(HEADS, found.over_screen, strict=True)
    ]
    return TABLE_TEXT.format(
        maps=MAP_SIZE,
        height=RESOLUTION[0],
        width=RESOLUTION[1],
        cores=thread_count(None),
        table=lines(head, rows),
        above=int((found.texels >= found.published).sum()),
        faster=int((found.seconds >= found.published).sum()),
        cells=found.published.size,
        worst=errors.max(),
        where=f"{HEADS[worst[0]]} heads and {DISTANCES[worst[1]]:g} units",
        screen=lines(head, ratio),
    )


# What each saving costs

ERRORS_TEXT = """Mean Delta E 2000 over visible pixels, and the largest one farther than the
kernel reaches from outlines and from the picture's border ("inside"); a dash where
no pixel is as far:

{table}"""


def errors():
    """Measure the savings apart, in nine cells."""
    kernel = six_gaussians()
    kinds = {
        "culled, clipped": Savings(culled="vertex", clipped=True),
        "culled by face, clipped": Savings(culled="face", clipped=True),
        "by depth": Savings(by_depth=True),
        "all": ALL,
    }
    rows = []
    for heads, distance in CELLS:
        place = Row(heads, distance, resolution=RESOLUTION)
        given = place.shape, place.offsets_mm, place.camera, place.lights, kernel
        whole = render_texture(*given, map_size=MAP_SIZE)
        cells = [str(heads), f"{distance:g}"]
        for savings in kinds.values():
            found = measure_frame(
                place, kernel, savings=savings, map_size=MAP_SIZE, whole=whole, screen=False
            ).work["saved"]
            cells.append(f"{found.mean_delta_e:.3f} / {inside(found)}")
        rows.append(cells)
    return ERRORS_TEXT.format(table=lines(["heads", "units", *kinds], rows))


# At the paper's own size

FULL_TEXT = """One head, maps of {size} texels and pictures of {width} x {height} pixels, smaller
maps by depth alone:

{table}"""
FULL_MAP = 2048


def full():
    """Measure smaller maps at the paper's own size."""
    kernel, rows = six_gaussians(), []
    for distance in (10.0, 20.0, 50.0, 100.0):
        found = measure_frame(
            *(Row(1, distance, resolution=FULL), kernel),
            savings=Savings(by_depth=True),
            map_size=FULL_MAP,
            screen=False,
        )
        texels, seconds = found.speed_up
        error = found.work["saved"].mean_delta_e
        cells = f"{distance:g}", str(found.map_sizes[0]), f"{texels:.2f}", f"{seconds:.2f}"
        rows.append([*cells, f"{error:.3f}"])
    head = ["units", "side of the map", "times fewer texels", "times as fast", "mean Delta E"]
    height, width = FULL
    return FULL_TEXT.format(size=FULL_MAP, width=width, height=height, table=lines(head, rows))


def inside(work):
    """Return the largest error inside, or a dash."""
    return f"{work.largest_inside:.1e}" if work.inside_pixels else "-"


# What the paper leaves open

GEOMETRY_TEXT = """Times fewer texels convolved with all savings, by what the paper does not say; at
4 heads and 2.5, 10 and 50 units:

{table}"""


def geometry():
    """Count texels for other heads, spacings and fields of view."""
    kernel = six_gaussians()
    changed = [("as above", {})]
    changed += [(f"heads of {each:g} units", {"head_units": each}) for each in (2.0, 3.0)]
    changed += [(f"{each:g} units apart", {"spacing_units": each}) for each in (1.5, 4.0)]
    changed += [(f"{each:g} degrees", {"fov_degrees": each}) for each in (20.0, 45.0, 60.0)]
    rows = []
    for name, change in changed:
        places = [Row(4, each, resolution=RESOLUTION, **change) for each in (2.5, 10.0, 50.0)]
        found = [measure_frame(each, kernel, savings=ALL, **COUNTING) for each in places]
        rows.append([name, *map(fewer, found)])
    head = ["", *(f"{each:g} units" for each in (2.5, 10.0, 50.0))]
    return GEOMETRY_TEXT.format(table=lines(head, rows))


def fewer(frame):
    """Return how many times fewer texels are convolved."""
    texels, _ = frame.speed_up
    return "none in view" if math.isnan(texels) else f"{texels:.2f}"


# Pictures

PICTURES_TEXT = """![Four heads at 10 units, with bloom](scene-heads.png)

![A head of a row of five at 4 units: its neighbours are cut off](scene-near.png)"""


def pictures():
    """Render two frames as a reader sees them."""
    kernel = six_gaussians()
    for name, heads, distance, bloom in (("heads", 4, 10.0, 0.05), ("near", 5, 4.0, 0.0)):
        place = Row(heads, distance, resolution=(500, 800))
        frame = measure_frame(place, kernel, savings=ALL, map_size=1024, screen=False)
        path = DOCS / f"scene-{name}.png"
        frame.save(path, bloom=bloom)
        with Image.open(path) as deep:
            small = deep.convert("RGB")
        small.save(path, optimize=True)
    return PICTURES_TEXT


SECTIONS = {each.__name__: each for each in (table, errors, full, geometry, pictures)}


def main():
    """Write the sections that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sections", nargs="*", choices=[*SECTIONS, []], default=list(SECTIONS))
    for each in parser.parse_args().sections:
        script = f"docs/make_scene.py {each}"
        put_section("scene.md", script, SECTIONS[each](), f"python {script}")


if __name__ == "__main__":
    main()
