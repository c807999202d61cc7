"""The methods of ``sssfit simulate`` in one table: what each does, and which options are its own.

Nothing of the library is imported here, so the table can make the help; ``function`` is a name in
``sssfit.simulate``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import click
from click.core import ParameterSource


@dataclass(frozen=True, slots=True)
class Method:
    """One way from a material to a profile.

    ``shares`` says that the function takes a list of materials, works once for what they have in
    common, and knows ``threads`` and ``stop``; the others take one material. One that ``makes``
    a profile by name takes none, and that name needs no ``--method``.
    """

    summary: str
    function: str
    options: tuple[str, ...] = ()
    shares: bool = False
    makes: str | None = None


METHODS = {
    "montecarlo": Method(
        "walks photons, through layers and slabs too; with standard errors",
        "simulate_montecarlo_many",
        ("photons", "target_error", "checkpoint_every", "resume"),
        shares=True,
    ),
    "exact": Method(
        "solves the transport equation: no noise; one half space",
        "simulate_exact_many",
        ("tolerance",),
        shares=True,
    ),
    "dipole": Method(
        "diffusion, Jensen et al. 2001; one half space",
        "simulate_dipole",
    ),
    "dipole-grosjean": Method(
        "the same with Grosjean's diffusion coefficient",
        "simulate_dipole_grosjean",
    ),
    "multipole": Method(
        "diffusion, Donner and Jensen 2005; slabs and layers too",
        "simulate_multipole",
    ),
    "burley": Method(
        "normalised diffusion, Christensen and Burley 2015; one half space",
        "simulate_burley",
        ("mapping",),
    ),
    "gaussians": Method(
        "skin as the six Gaussians of d'Eon et al. 2007; deon-skin only",
        "simulate_deon_skin",
        makes="deon-skin",
    ),
}
MAPPINGS = ("perpendicular", "diffuse", "diffuse-mfp")


def method_lines() -> str:
    """Return the methods for the end of the help, a line each; click keeps lines after a backspace.

    The longest name and two spaces set the column.
    """
    width = max(map(len, METHODS)) + 2
    return "\b\nMethods:\n" + "\n".join(
        f"  {name.ljust(width)}{method.summary}" for name, method in METHODS.items()
    )


def method_for(context: click.Context, method: str, material: str | None) -> str:
    """Return the method that a name asks for; refuse a method and a name that do not go together.

    A name of a profile that a method makes has no coefficients, and no other method can use it.
    """
    made = METHODS[method].makes
    if made is not None and material != made:
        asked = "--all" if material is None else material
        raise click.UsageError(
            f"--method {method} makes {made} only, and this is {asked}; for sums of Gaussians of a "
            "material's profile use sssfit fit --method gaussians."
        )
    owners = [name for name, each in METHODS.items() if each.makes == material]
    if material is None or not owners or method in owners:
        return method
    if context.get_parameter_source("method") is ParameterSource.COMMANDLINE:
        raise click.UsageError(
            f"{material} has no coefficients, and --method {method} needs them; use --method "
            f"{owners[0]} or leave it out."
        )
    return owners[0]


def own_options(context: click.Context, method: str, given: dict[str, Any]) -> dict[str, Any]:
    """Keep the method's own options of all that methods have; refuse those of others, if given."""
    for owner, each in METHODS.items():
        for option in each.options:
            is_given = context.get_parameter_source(option) is ParameterSource.COMMANDLINE
            if is_given and option not in METHODS[method].options:
                raise click.UsageError(
                    f"--{option.replace('_', '-')} is for --method {owner}, and this is {method}; "
                    "leave it out."
                )
    return {key: given[key] for key in METHODS[method].options}
