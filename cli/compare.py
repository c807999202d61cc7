"""``sssfit compare``: what a kernel loses, and why."""

from __future__ import annotations

import click

from ._compare_budget import BudgetRequest, compare_budget
from ._fits import FITS, own_settings
from ._options import Common, Count, Length, common_options
from ._scene import Size


@click.command()
@click.argument("material")
@click.option("--budget", is_flag=True, help="Say which cause makes how much of the error.")
@click.option(
    "--picture",
    "pictures",
    default="head",
    show_default=True,
    metavar="NAME,...",
    help="Made pictures or files, with commas between them.",
)
@click.option(
    "--size",
    type=Size(),
    metavar="WxH",
    help="Made pictures: columns and rows.  [default: 512x512]",
)
@click.option(
    "--mm-per-pixel",
    type=Length(),
    metavar="MM",
    help="Size of a pixel.  [default: 0.3; of your own file what its header says]",
)
@click.option(
    "--photons",
    type=Count(2, 10**12),
    metavar="N",
    default=10**6,
    help="Of the photon walk.  [default: 1e6]",
)
@click.option(
    "--method", type=click.Choice(list(FITS)), default="svd", show_default=True, help="The fit."
)
@click.option("--rank", type=click.IntRange(1, 1000), metavar="N", help="Of svd.  [default: 3]")
@click.option(
    "--terms", type=click.IntRange(1, 10), metavar="N", help="Of gaussians.  [default: 4]"
)
@click.option(
    "--model",
    type=click.Choice(["dipole", "dipole-grosjean", "burley"]),
    help="Fit the kernel to this model.  [default: to the photon walk]",
)
@click.option(
    "--chart",
    metavar="FILE",
    help="Draw it as well, as PNG, SVG or PDF by its ending; - for PNG on stdout.",
)
@click.option("--force", is_flag=True, help="Replace a file that is not a chart.")
@common_options
@click.pass_context
def compare(
    context: click.Context,
    material: str,
    budget: bool,
    pictures: str,
    size: tuple[int, int] | None,
    mm_per_pixel: float | None,
    photons: int,
    method: str,
    rank: int | None,
    terms: int | None,
    model: str | None,
    chart: str | None,
    force: bool,
    common: Common,
) -> None:
    """Take the error of a kernel of MATERIAL apart, by cause, on one picture or several.

    The truth is the picture convolved with the exact profile's whole 2D kernel. Each cause is
    switched on alone against it: simulation noise, energy beyond the grid, a model in place of the
    exact profile, separability, storage. The largest is what to act on. MATERIAL is a name or a
    TOML file: one half space with g = 0.

    \b
      sssfit compare skin1 --budget
      sssfit compare wholemilk --budget --picture disk,edge,head --chart budget.png
      sssfit compare skin1 --budget --method gaussians --terms 4 --model burley
    """
    if not budget:
        raise click.UsageError("say what to compare: --budget.")
    settings = own_settings(context, method, {"rank": rank, "terms": terms})
    request = BudgetRequest(
        pictures.split(","), size, mm_per_pixel, photons, method, settings, model, chart, force
    )
    compare_budget(material, request, common)
