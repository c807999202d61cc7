"""A chain of pairs whose stages share numbers: one small filter, or one shape of several widths.

The chain's parameters x (``_chain``) follow fewer of its own, p, linearly,

    x = x_0 + T p.

Offset steps and weights are logarithms, so that one of p can widen all offsets of a stage, or be a
weight that all stages and channels have.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, KernelError
from sssfit.fit._chain import Chain
from sssfit.kernel.structure import Shape, parse


@dataclass(frozen=True, slots=True, eq=False)
class TiedChain:
    """The misfit of a chain by the parameters that it follows; a ``Searched``.

    Parameters
    ----------
    chain : Chain
        With S parameters.
    base : array (S,)
    ties : array (S, P)
    step_parameters : array
        Which of the P set widths or offset steps.
    begin : function
        Of a random generator; returns parameters (P,) from which a search may start.
    """

    chain: Chain
    base: FloatArray
    ties: FloatArray
    step_parameters: npt.NDArray[np.intp]
    begin: Callable[[np.random.Generator], FloatArray]

    def full(self, p: FloatArray) -> FloatArray:
        """Return the chain's parameters (S,)."""
        found: FloatArray = self.base + self.ties @ p
        return found

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return random parameters (P,)."""
        return self.begin(rng)

    def value_and_gradient(self, p: FloatArray) -> tuple[float, FloatArray]:
        """Return the chain's misfit and its gradient (P,)."""
        value, gradient = self.chain.value_and_gradient(self.full(p))
        return value, gradient @ self.ties

    def hessian(self, p: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives (P, P)."""
        found: FloatArray = self.ties.T @ self.chain.hessian(self.full(p)) @ self.ties
        return found


def equal_pairs(stages: str) -> tuple[Shape, ...]:
    """Return the stages of a structure in which all are pairs with the same number of taps.

    Raises
    ------
    FitError
        It is not one.
    """
    try:
        shapes = parse(stages)
    except KernelError as error:
        raise FitError(str(error)) from None
    if len({(each.kind, each.pairs) for each in shapes}) > 1 or shapes[0].kind != "pair":
        raise FitError(
            f"stages = {stages!r}; expected the same number of tap pairs in each, such as "
            "1|1|1 or 3-3-3: all stages are one blur."
        )
    return shapes
