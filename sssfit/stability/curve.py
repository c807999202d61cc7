"""Curves of a measure over what a stress makes harder."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly


@dataclass(frozen=True, slots=True)
class Edge:
    """Where a curve crosses its limit.

    Parameters
    ----------
    at : float
        On the axis of what is made harder, between two of its points by interpolation.
    low, high : float
        Its uncertainty: where ``low`` and ``high`` of the curve cross, or the two points around it.
    """

    at: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class Curve(ReadOnly):
    """One method under one stress.

    Parameters
    ----------
    label : str
        "svd 3", "cascade 24".
    x : array (N,)
        What is made harder, ascending.
    y : array (N,)
        The measure, by median over seeds where there are several; infinite where a fit is refused.
    low, high : array (N,), optional
        Between what the measure of as many other seeds lies; see ``sssfit.stability.seeds``.
    advice : str
        What to do where it fails.
    """

    label: str
    x: npt.NDArray[Any]
    y: npt.NDArray[Any]
    low: FloatArray | None = None
    high: FloatArray | None = None
    advice: str = ""

    def __post_init__(self) -> None:
        for name in ("x", "y", "low", "high"):
            value: npt.ArrayLike | None = getattr(self, name)
            if value is not None:
                stored = np.array(value, dtype=np.float64)
                stored.setflags(write=False)
                object.__setattr__(self, name, stored)

    def to_dict(self) -> dict[str, Any]:
        """Return what there is, by the names of the parameters."""
        return {name: getattr(self, name) for name in self.__slots__}

    @classmethod
    def from_dict(cls, told: Mapping[str, Any]) -> "Curve":
        """Return the curve whose `to_dict` this is; None, as JSON has it, is infinite."""
        low, high = (told[name] for name in ("low", "high"))
        return cls(
            label=told["label"],
            x=_figures(told["x"]),
            y=_figures(told["y"]),
            low=None if low is None else _figures(low),
            high=None if high is None else _figures(high),
            advice=told["advice"],
        )


def _figures(told: Sequence[float | None]) -> FloatArray:
    return np.array([np.inf if each is None else each for each in told], dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Axis:
    """What a stress makes harder.

    Parameters
    ----------
    label : str
        With the unit in brackets.
    mild : float
        The end or place from which the search for the limit begins.
    is_log : bool
    form : str
        Format of its numbers in tables.
    """

    label: str
    mild: float
    is_log: bool = True
    form: str = ".3g"
