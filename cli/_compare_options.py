"""The options of ``sssfit compare``: what is lit, which kernels and causes, what is drawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from sssfit.methods import FITS

from ._compare_parts import PICTURES
from ._options import Count, LengthOr, WholeRange
from ._scene import EDGE_DEGREES, FILE_OPTIONS, MADE, Size

_OPTIONS = (
    click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit."),
    click.option("--paper", is_flag=True, help="The eleven of them that the SSSS paper has."),
    click.option(
        "--what",
        type=click.Choice(["front", "budget", "kernels", "sheet"]),
        help="budget: why a kernel is off; kernels: every one by error and cost; front: those that "
        "no other beats, a line a picture; sheet: pictures of all, drawn into --chart."
        "  [default: budget and kernels]",
    ),
    click.option(
        "--picture",
        "pictures",
        metavar="NAME|FILE,...",
        multiple=True,
        help=f"What is lit: {', '.join(MADE)}, or your own EXR, HDR, TIFF, PNG, JPG or TGA "
        f"files. The edge is at {EDGE_DEGREES:g} degrees.  [default: {PICTURES}]",
    ),
    click.option(
        "--mm-per-pixel",
        type=LengthOr("profile"),
        metavar="MM|profile",
        help="Size of all pixels; profile is the width of the profile's first annulus."
        "  [default: what your own file says, else 0.3]",
    ),
    click.option(
        "--size",
        type=Size(),
        metavar="WxH",
        help="Made pictures: columns and rows.  [default: 512x512]",
    ),
    *FILE_OPTIONS,
    click.option(
        "--chart",
        metavar="FILE",
        help="Draw the kernels by error and cost, or the sheet, as PNG, SVG or PDF by the ending; "
        "- for PNG on stdout.",
    ),
    click.option("--table", metavar="FILE", help="Write the kernels' rows, .md, .csv or .json."),
    click.option(
        "--error",
        type=click.Choice(["delta-e", "l2"]),
        default="delta-e",
        show_default=True,
        help="Of chart and front: mean Delta E 2000, or relative L2 of linear light.",
    ),
    click.option(
        "--cost",
        type=click.Choice(["weights", "passes", "seconds"]),
        default="weights",
        show_default=True,
        help="Of chart and front: weights applied to a pixel, passes, or measured seconds.",
    ),
    click.option("--budget-chart", metavar="FILE", help="Draw the budget."),
    click.option(
        "--photons",
        type=Count(2, 10**12),
        metavar="N",
        help="Of the budget's photon walk.  [default: 1e6]",
    ),
    click.option(
        "--method",
        type=click.Choice(list(FITS)),
        default="svd",
        show_default=True,
        help="The kernel whose budget it is.",
    ),
    click.option(
        "--rank", type=WholeRange(1, 1000), metavar="N", help="Its rank, svd.  [default: 3]"
    ),
    click.option(
        "--terms", type=WholeRange(1, 10), metavar="N", help="Its Gaussians.  [default: 4]"
    ),
    click.option(
        "--model",
        type=click.Choice(["dipole", "dipole-grosjean", "burley"]),
        help="The budget of a kernel of this model.  [default: of the photon walk]",
    ),
    click.option(
        "-o",
        "--output",
        metavar="FOLDER",
        help="Where --all and --paper put NAME-pareto.png and NAME-pareto.md.  [default: here]",
    ),
    click.option(
        "--force",
        is_flag=True,
        help="Replace an input, or files that are not our charts or tables.",
    ),
)


def compare_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add them all, in this order."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
