"""``sssfit materials deon-skin``: what the name stands for, which is no material."""

import click

from sssfit.messages import table
from sssfit.methods import SIMULATIONS

from ._options import Common
from ._output import finish

DEON_SKIN = SIMULATIONS["gaussians"].makes


def show_deon_skin(common: Common, *, as_toml: bool) -> None:
    """Print the six Gaussians and how to get the profile."""
    from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS
    from sssfit.simulate import DEON_SKIN as SKIN

    if as_toml:
        raise click.UsageError(
            f"{SKIN.name} has no coefficients to write as TOML; begin with another, such as skin1."
        )
    rows = [
        (f"{variance:g}", *(f"{weight:.3f}" for weight in weights))
        for variance, weights in zip(SKIN_VARIANCES_MM2, SKIN_WEIGHTS, strict=True)
    ]
    text = (
        f"name      {SKIN.name}\n"
        f"source    {SKIN.source}\n"
        "six Gaussians in place of coefficients: sssfit simulate deon-skin makes their profile\n\n"
        + table(("variance, mm^2", *SKIN.channels), rows)
    )
    figures = {
        "command": "materials",
        "output": [],
        "name": SKIN.name,
        "source": SKIN.source,
        "channels": SKIN.channels,
        "variances_mm2": SKIN_VARIANCES_MM2,
        "weights": SKIN_WEIGHTS,
    }
    finish(common, figures, text)
