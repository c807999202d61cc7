"""The methods of ``sssfit fit`` in one table: what each does, and which options are its own.

Nothing of the library is imported here, so the table can make the help; ``function`` is a name in
``sssfit.fit``. ``counted`` is the option whose value becomes part of the file's name (svd3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import click
from click.core import ParameterSource


@dataclass(frozen=True, slots=True)
class Fit:
    """One way from a profile to a kernel."""

    summary: str
    options: tuple[str, ...] = ()
    counted: str | None = None
    count: int | None = None  # where the option is not given


FITS = {
    "svd": Fit(
        "rank N: the largest terms of the singular value decomposition; the smallest error",
        ("rank", "energy"),
        "rank",
        3,
    ),
    "gaussians": Fit(
        "1 to 10 passes: a sum of Gaussians, best for the profile, r-weighted",
        ("terms", "signed", "free_energy", "energy"),
        "terms",
        4,
    ),
    "preintegrated": Fit(
        "one pass: the profile integrated along lines; exact for axis edges", ("energy",)
    ),
    "guided": Fit(
        "one pass fitted under a guide function: near (k = 0) to far (k = 4) scattering",
        ("k", "b", "centre_bound"),
    ),
    "artist": Fit(
        "one pass of two Gaussians per channel, fitted or set by hand",
        ("target", "near", "far", "weight"),
    ),
    "falloff": Fit(
        "one pass, red skin stretched: width, strength and falloff, fitted or by hand",
        ("width", "strength", "falloff"),
    ),
    "burley": Fit(
        "one pass: normalised diffusion, a shape per channel, as engines take it", ("energy",)
    ),
}


_KEYWORDS = {"near": "near_mm2", "far": "far_mm2"}  # where the library's name has the unit


def fit_lines() -> str:
    """Return the methods, a line each; the longest name and two spaces set the column."""
    width = max(map(len, FITS)) + 2
    return "\n".join(f"  {name.ljust(width)}{fit.summary}" for name, fit in FITS.items())


def own_settings(context: click.Context, method: str, given: dict[str, Any]) -> dict[str, Any]:
    """Keep the method's own options that were given; refuse those of others."""
    for option in given:
        is_given = context.get_parameter_source(option) is ParameterSource.COMMANDLINE
        owners = [name for name, fit in FITS.items() if option in fit.options]
        if is_given and method not in owners:
            raise click.UsageError(
                f"--{option.replace('_', '-')} is for --method {' or '.join(owners)}, and this is "
                f"{method}; leave it out."
            )
    own = FITS[method].options
    return {
        _KEYWORDS.get(key, key): value
        for key, value in given.items()
        if key in own and value is not None and value is not False  # 0 is a value
    }
