"""Records of what the solver for layers found: the profile of a material from its channels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.simulate._deterministic import (
    ROUNDING,
    computed_profile,
    energies_from_cumulative,
)
from sssfit.simulate.stack.solution import Answer, Errors, Side, SideErrors, share_of


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """The answer for a channel, its errors, and the number of directions that gave it."""

    answer: Answer
    errors: Errors
    count: int


def profile_of(
    material: Material,
    grid: RadialGrid,
    solved: Sequence[Solved],
    tolerance: float,
    *,
    similarity: bool,
) -> Profile:
    """Assemble the answers of a material's channels."""
    sides = [each.answer.reflected for each in solved]
    allowed = tolerance * max(each.answer.leaving for each in solved)
    reflected = _energies(sides, allowed)
    stderr = np.stack([_stderr(each.errors.reflected) for each in solved], axis=1)
    below = [each.answer.transmitted for each in solved if each.answer.transmitted is not None]
    under = [each.errors.transmitted for each in solved if each.errors.transmitted is not None]
    absorbed = np.maximum([each.answer.absorbed for each in solved], 0.0).T
    shares = [share_of(each.errors, each.answer) for each in solved]
    totals = material.specular_reflectance + np.array([each.answer.leaving for each in solved])
    return computed_profile(
        material,
        "exact",
        grid,
        reflected,
        stderr=stderr,
        transmitted=_energies(below, allowed) if below else None,
        transmitted_stderr=np.stack([_stderr(each) for each in under], axis=1) if under else None,
        absorbed=absorbed,
        relative_error=max(shares),
        settings={
            "tolerance": tolerance,
            "similarity": similarity,
            "solver": "layer",
            "directions": max(each.count for each in solved),
        },
        energy_balance_stderr=np.abs(totals + absorbed.sum(axis=0) - 1.0).tolist(),
    )


def _energies(sides: Sequence[Side], allowed: float) -> FloatArray:
    """Return energies of the annuli and beyond the grid (n + 1, C); F may fall by ``allowed``."""
    cumulative = np.stack([np.append(0.0, each.cumulative) for each in sides], axis=1)
    totals = np.array([each.total for each in sides])
    share = allowed / max(float(totals.max()), ROUNDING)
    return energies_from_cumulative(cumulative, totals, tolerance=share)


def _stderr(errors: SideErrors) -> FloatArray:
    """Return errors of annuli and beyond the grid (n + 1,), whose squares add up to those of F.

    Each is at least the annulus's own, and the sum up to any edge at least F's error there.
    """
    largest = np.maximum.accumulate(errors.edges)
    steps_up = np.diff(np.append(0.0, largest**2))
    stderr: FloatArray = np.sqrt(np.maximum(steps_up, errors.annuli**2))
    return stderr
