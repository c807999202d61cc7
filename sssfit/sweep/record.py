"""What a sweep made, and what one would take."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sssfit.messages import counted, filled
from sssfit.sweep.plan import Plan


@dataclass(frozen=True, slots=True)
class SweepResults:
    """A sweep that ended.

    Parameters
    ----------
    plan : Plan
    path : Path
        Path of its store.
    before : int
        Points that were finished when it began.
    done : int
        Points that it computed.
    failures : tuple of (int, str)
        Points that cannot be computed, and why.
    seconds : float [s]
    """

    plan: Plan
    path: Path
    before: int
    done: int
    failures: tuple[tuple[int, str], ...]
    seconds: float

    @property
    def is_complete(self) -> bool:
        """Whether the store has every point."""
        return self.before + self.done == self.plan.count

    @property
    def failure(self) -> str | None:
        """What is to be said of points that cannot be computed; None without such."""
        if not self.failures:
            return None
        index, why = self.failures[0]
        return (
            f"{counted(len(self.failures), 'point')} of {self.plan.count} cannot be computed, the "
            f"first at {self.plan.label(index)}: {why.rstrip('.')}; the others are kept in "
            f"{self.path}."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit sweep --json``."""
        return {
            "material": self.plan.base.name,
            "method": self.plan.method,
            "axes": {axis.name: len(axis.values) for axis in self.plan.axes},
            "points": self.plan.count,
            "finished_before": self.before,
            "computed": self.done,
            "failed": len(self.failures),
            "photons": self.plan.photons,
            "annuli": self.plan.grid.annuli,
            "dr_mm": self.plan.grid.dr_mm,
            "seconds": self.seconds,
        }

    def text(self) -> str:
        """Return the printed report."""
        figures = self.to_dict()
        line = (
            f"{self.plan.base.name} by {self.plan.method}: "
            "{points:#point} ("
            + self.plan.shape_in_words
            + "), {computed} computed, {finished_before} before"
        )
        grid = "{annuli:#annulus} of {dr_mm:.4g} mm, {seconds:.1f} s"
        return "\n".join([filled(line, figures), filled(grid, figures)])
