"""The word said before compiled code is made, which happens once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._options import Common
from ._report import say

if TYPE_CHECKING:
    from sssfit.material import Material


def say_if_compiling(common: Common, *, walk: Material | None = None, solver: bool = False) -> None:
    """Say that the walk of a material, or the exact solver, is about to be compiled."""
    from sssfit.simulate import is_compiled, is_solver_compiled

    if solver and not is_solver_compiled():
        say(common, "Compiling the solver, some 3 s; it is kept for later runs where it can be.")
    if walk is not None and not is_compiled(walk):
        say(
            common,
            "Compiling the photon walk, some 10 s; it is kept for later runs where it can be.",
        )
