"""Panels: curves with a limit, and where each of them stays safe."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.stability.curve import Axis, Curve, Edge

SAFE, FROM, UP_TO, BETWEEN, NEVER = "safe", "from", "up to", "between", "never"


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """Curves with the same axes and the same limit.

    Parameters
    ----------
    stress : str
        A name of ``sssfit.methods.STRESSES``.
    title, y_label : str
        For charts.
    axis : Axis
    limit : float
        The largest measure that counts as safe.
    curves : sequence of Curve
    fails : str
        What goes wrong beyond the limit, in a few words.
    is_log : bool
        Whether the measure is drawn and interpolated by its logarithm.
    floor : float
        What smaller measures are raised to, for their logarithms; 0 if none is.
    """

    stress: str
    title: str
    axis: Axis
    y_label: str
    limit: float
    curves: Sequence[Curve]
    fails: str
    is_log: bool = True
    floor: float = 0.0

    def edges(self, curve: Curve) -> tuple[Edge | None, Edge | None]:
        """Return where a curve stops being safe below and above the mild place.

        None where it stays safe to the end, with other seeds too; where only they might fail, the
        edge is the end. Where the mild place itself is not safe both edges are there.
        """
        return self._edge(curve, -1), self._edge(curve, 1)

    def is_safe_anywhere(self, curve: Curve) -> bool:
        """Return whether a curve keeps within the limit at the mild place."""
        return bool(curve.y[self._start(curve)] <= self.limit)

    def _start(self, curve: Curve) -> int:
        return int(np.abs(self._scaled(curve.x) - self._scaled(np.array(self.axis.mild))).argmin())

    def _scaled(self, x: FloatArray) -> FloatArray:
        scaled: FloatArray = np.log(x) if self.axis.is_log else np.asarray(x, dtype=np.float64)
        return scaled

    def _edge(self, curve: Curve, step: int) -> Edge | None:
        found = self._crossing(curve, curve.y, step)
        end = float(curve.x[-1] if step > 0 else curve.x[0])
        if curve.low is None or curve.high is None:
            return None if found is None else Edge(found[0], *sorted(found[1:]))
        others = [self._crossing(curve, each, step) for each in (curve.low, curve.high)]
        is_end = curve.x[self._start(curve)] == end  # and nothing was tried beyond the mild place
        if found is None and (is_end or others == [None, None]):
            return None
        place, *ends = (end if each is None else each[0] for each in (found, *others))
        return Edge(place, min(ends), max(ends))

    def _crossing(
        self, curve: Curve, y: FloatArray, step: int
    ) -> tuple[float, float, float] | None:
        """Return the place of the first crossing, and the points before and behind it."""
        k = self._start(curve)
        if not y[k] <= self.limit:
            return (float(curve.x[k]),) * 3
        while 0 <= k + step < len(y) and y[k + step] <= self.limit:
            k += step
        if not 0 <= k + step < len(y):
            return None
        inner, outer = float(curve.x[k]), float(curve.x[k + step])
        y_in, y_out = (self._measure(each) for each in (y[k], y[k + step]))
        share = 0.5
        if np.isfinite(y_out) and y_out > y_in:
            share = float(np.clip((self._measure(self.limit) - y_in) / (y_out - y_in), 0.0, 1.0))
        ends = self._scaled(np.array([inner, outer]))
        place = float(ends[0] + share * (ends[1] - ends[0]))
        return (float(np.exp(place)) if self.axis.is_log else place), inner, outer

    def _measure(self, y: float) -> float:
        return float(np.log(max(y, 1e-300))) if self.is_log else float(y)

    def findings(self) -> "Iterator[Finding]":
        """Yield where each curve is safe."""
        for each in self.curves:
            below, above = self.edges(each)
            worst = float(np.max(each.y))
            is_safe = self.is_safe_anywhere(each)
            kind = NEVER if not is_safe else _KINDS[below is not None, above is not None]
            yield Finding(self, each.label, kind, below, above, worst, each.advice)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for JSON; None where a fit was refused."""
        axis = {"mild": self.axis.mild, "x_is_log": self.axis.is_log, "x_form": self.axis.form}
        return plain(
            {
                "stress": self.stress,
                "title": self.title,
                "x": self.axis.label,
                **axis,
                "y": self.y_label,
                "y_is_log": self.is_log,
                "floor": self.floor,
                "limit": self.limit,
                "fails": self.fails,
                "curves": [each.to_dict() for each in self.curves],
                "findings": [each.to_dict() for each in self.findings()],
            }
        )

    @classmethod
    def from_dict(cls, told: Mapping[str, Any]) -> "Panel":
        """Return the panel whose `to_dict` this is."""
        return cls(
            **{key: told[key] for key in ("stress", "title", "limit", "fails", "floor")},
            y_label=told["y"],
            is_log=told["y_is_log"],
            axis=Axis(told["x"], told["mild"], is_log=told["x_is_log"], form=told["x_form"]),
            curves=[Curve.from_dict(each) for each in told["curves"]],
        )


_KINDS = {
    (False, False): SAFE,
    (True, False): FROM,
    (False, True): UP_TO,
    (True, True): BETWEEN,
}


@dataclass(frozen=True, slots=True, eq=False)
class Finding:
    """Where one method is safe under one stress; a row of the table."""

    panel: Panel
    label: str
    kind: str  # one of SAFE, FROM, UP_TO, BETWEEN, NEVER
    below: Edge | None
    above: Edge | None
    worst: float
    advice: str

    @property
    def words(self) -> str:
        """Where it is safe: "from 2.1e5 (1.5e5 to 3e5)"."""
        if self.kind == SAFE:
            return "everywhere that was tried"
        if self.kind == NEVER:
            return "nowhere that was tried"
        edges = {FROM: "from {below}", UP_TO: "up to {above}", BETWEEN: "{below} to {above}"}
        return edges[self.kind].format(below=self._edge(self.below), above=self._edge(self.above))

    def _edge(self, edge: Edge | None) -> str:
        if edge is None:
            return ""
        at, low, high = (
            format(each, self.panel.axis.form) for each in (edge.at, edge.low, edge.high)
        )
        return at if low == high == at else f"{at} ({low} to {high})"

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        edges = {
            name: None if edge is None else {"at": edge.at, "low": edge.low, "high": edge.high}
            for name, edge in (("below", self.below), ("above", self.above))
        }
        own = {"method": self.label, "safe": self.kind, **edges}
        return own | {
            "worst": self.worst if np.isfinite(self.worst) else None,
            "advice": self.advice,
        }
