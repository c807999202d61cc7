"""The options that single methods of ``sssfit fit`` have; ``_fits`` says which are whose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from ._options import ListOf, Number, WholeRange

_NUMBER = Number()
_PER_CHANNEL = ListOf(_NUMBER)

_OPTIONS = (
    click.option(
        "--rank",
        type=WholeRange(1, 1000),
        metavar="N",
        help="svd: number of terms.  [default: 3]",
    ),
    click.option(
        "--energy",
        type=click.Choice(["rescale", "keep"]),
        help="svd, gaussians, preintegrated, burley: scale the kernel to the diffuse reflectance, "
        "or keep what the support holds (svd: the least error).  [default: rescale]",
    ),
    click.option(
        "--terms",
        type=WholeRange(1, 10),
        metavar="N",
        help="gaussians: how many.  [default: 4]",
    ),
    click.option("--signed", is_flag=True, help="gaussians: allow negative weights."),
    click.option(
        "--free-energy",
        is_flag=True,
        help="gaussians: do not hold the weights to the diffuse reflectance.",
    ),
    click.option(
        "--k",
        type=_NUMBER,
        metavar="0..4",
        help="guided: 0 for near, 4 for far scattering.  [default: 1.55]",
    ),
    click.option(
        "--b",
        type=_NUMBER,
        metavar="NUMBER",
        help="guided: how narrow the axes are that the guide leaves out.  [default: 50]",
    ),
    click.option(
        "--centre-bound",
        type=_NUMBER,
        metavar="SHARE",
        help="guided: largest share of the pass in its middle pixel.  [default: none]",
    ),
    click.option(
        "--target",
        type=click.Choice(["line", "kernel", "picture"]),
        help="artist: fit the line integral, the 2D kernel, or what is seen of a disk, an edge and "
        "a head, in some 5 s.  [default: line]",
    ),
    click.option(
        "--near",
        type=_PER_CHANNEL,
        metavar="MM2,...",
        help="artist: variance of the narrow Gaussian, one or a channel's each.",
    ),
    click.option(
        "--far",
        type=_PER_CHANNEL,
        metavar="MM2,...",
        help="artist: variance of the wide Gaussian, one or a channel's each.",
    ),
    click.option(
        "--weight",
        type=_PER_CHANNEL,
        metavar="SHARE,...",
        help="artist: share of the narrow Gaussian, one or a channel's each.",
    ),
    click.option("--width", type=_NUMBER, metavar="W", help="falloff: one for all channels."),
    click.option(
        "--strength",
        type=_PER_CHANNEL,
        metavar="T,...",
        help="falloff: share that is blurred, one or a channel's each.",
    ),
    click.option(
        "--falloff",
        type=_PER_CHANNEL,
        metavar="F,...",
        help="falloff: a channel's width beside the others, one or a channel's each.",
    ),
)


def fit_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add them all, in this order."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
