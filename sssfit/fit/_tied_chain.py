"""A chain of pairs whose stages share numbers: one small filter, or one shape of several widths.

The chain's parameters x (``_chain``) follow fewer of its own, p, linearly,

    x = x_0 + T p.

Offset steps and weights are logarithms, so that one of p can widen all offsets of a stage, or be a
weight that all stages and channels have.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import FitError, KernelError
from sssfit.fit._chain import Chain
from sssfit.kernel.structure import Shape, parse
from sssfit.messages import shown


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
        Indices of those of the P that set widths or offset steps.
    begin : function
        Takes a random generator and returns parameters (P,) from which a search may start.
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
            f"stages = {shown(stages)}; expected the same number of tap pairs in each, such as "
            "1|1|1 or 3-3-3: all stages are one blur."
        )
    return shapes


def gaussian_weights(pairs: int) -> FloatArray:
    """Return the shares of a Gaussian in intervals of one deviation, the middle first (n+1,).

    All of them, mirrored ones included, add up to 1.
    """
    edges = np.arange(pairs + 2) - 0.5
    below = np.array([math.erf(each / math.sqrt(2.0)) for each in edges])
    shares = 0.5 * np.diff(below)
    found: FloatArray = shares / (shares[0] + 2.0 * shares[1:].sum())
    return found


def one_shape(chain: Chain, *, is_fitted: bool) -> TiedChain:
    """Return a chain whose stages have one shape, each of its own width.

    The parameters are the blend's, the logarithm of each stage's first offset step, and where the
    shape is fitted those of the other steps in relation to it and of the weights beside the middle
    one in relation to a Gaussian's.
    """
    blend, count, pairs = (
        chain.channels * (len(chain.shapes) + 1),
        len(chain.shapes),
        chain.counts[0],
    )
    shape = 2 * pairs - 1 if is_fitted else 0
    ties = np.zeros((chain.size, blend + count + shape))
    ties[:blend, :blend] = np.eye(blend)
    base = np.zeros(chain.size)
    for k in range(count):
        steps, weights = chain.places(k)
        ties[steps, blend + k] = 1.0
        base[weights] = np.log(gaussian_weights(pairs))
        if is_fitted:
            own = blend + count + np.arange(shape)
            ties[steps[1:], own[: pairs - 1]] = 1.0
            ties[weights[:, 1:], own[pairs - 1 :]] = 1.0

    def begin(rng: np.random.Generator) -> FloatArray:
        width, growth = rng.uniform(0.3, 1.0), rng.uniform(1.5, 2.6)
        levels = np.array([each.level for each in chain.shapes])
        widths = np.log(width * growth ** np.arange(count) / 2.0**levels)
        return np.concatenate((rng.normal(0.0, 0.3, blend), widths, np.zeros(shape)))

    return TiedChain(chain, base, ties, blend + np.arange(count), begin)
