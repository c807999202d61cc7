"""``sssfit compare``: every kernel of a material by error and cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ._compare_input import MM_PER_PIXEL
from ._compare_pareto import Outputs, Wish, check_outputs, compare_all, compare_one
from ._options import Common, Length, common_options
from ._scene import MADE, Size

_PICTURES = "disk,edge,head"


@click.command()
@click.argument("material", required=False)
@click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit.")
@click.option(
    "--chart",
    metavar="FILE",
    help="Draw it, as PNG, SVG or PDF by the ending; - for PNG on stdout.",
)
@click.option("--table", metavar="FILE", help="Write the rows, .md, .csv or .json.")
@click.option(
    "--picture",
    "pictures",
    metavar="NAME|FILE,...",
    multiple=True,
    help=f"What is lit: {', '.join(MADE)}, or your own EXR, HDR, TIFF or PNG files."
    f"  [default: {_PICTURES}]",
)
@click.option(
    "--mm-per-pixel",
    type=Length(),
    metavar="MM",
    help=f"Size of all pixels.  [default: what your own file says, else {MM_PER_PIXEL}]",
)
@click.option(
    "--size",
    type=Size(),
    metavar="WxH",
    help="Made pictures: columns and rows.  [default: 512x512]",
)
@click.option(
    "--error",
    type=click.Choice(["delta-e", "l2"]),
    default="delta-e",
    show_default=True,
    help="Of chart and front: mean Delta E 2000, or relative L2 of linear light.",
)
@click.option(
    "--cost",
    type=click.Choice(["weights", "passes", "seconds"]),
    default="weights",
    show_default=True,
    help="Of chart and front: weights applied to a pixel, passes, or measured seconds.",
)
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    help="Where --all puts NAME-pareto.png and NAME-pareto.md.  [default: here]",
)
@click.option("--force", is_flag=True, help="Replace files that are no charts or tables of ours.")
@common_options
def compare(
    material: str | None,
    every: bool,
    chart: str | None,
    table: str | None,
    pictures: Sequence[str],
    mm_per_pixel: float | None,
    size: tuple[int, int] | None,
    error: str,
    cost: str,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Fit MATERIAL by every method, and hold what each kernel loses against what it costs.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin. Methods, ranks and numbers of Gaussians are all fitted to the exact
    profile on the pictures' pixels, applied, and compared with the picture by the profile's whole
    2D kernel. A star marks the Pareto front: no other kernel is better in error and cost both.
    Seconds are of this machine.

    \b
      sssfit compare skin1
      sssfit compare skin1 --chart skin1-pareto.png --table skin1.csv
      sssfit compare skin1 --picture head --size 1024x1024 --mm-per-pixel 0.15 --cost seconds
      sssfit compare slab.profile.npz --picture mine.exr --error l2
      sssfit compare --all -o charts
    """
    check_outputs(material, every, chart, table, output)
    names = [name for given in pictures or (_PICTURES,) for name in given.split(",")]
    wish = Wish(names, size, mm_per_pixel, error, cost, force, common)
    if material is None:
        compare_all(Path(output or "."), wish)
    else:
        compare_one(material, Outputs(chart, table), wish)
