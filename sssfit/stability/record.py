"""What all stresses of one material find, as a table, a text and a dictionary."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sssfit.errors import FileError
from sssfit.messages import table
from sssfit.stability.panel import Panel


@dataclass(frozen=True, slots=True, eq=False)
class Stability:
    """All stresses of one material.

    Parameters
    ----------
    material : str
    mm_per_pixel : float
    panels : tuple of Panel
    notes : tuple of str
        What was left out or reduced, in sentences.
    seed : int
    """

    material: str
    mm_per_pixel: float
    panels: tuple[Panel, ...]
    notes: tuple[str, ...] = field(default=())
    seed: int = 1

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit stability --json``."""
        return {
            "material": self.material,
            "mm_per_pixel": self.mm_per_pixel,
            "seed": self.seed,
            "panels": [each.to_dict() for each in self.panels],
            "notes": list(self.notes),
        }

    @classmethod
    def from_dict(cls, told: Mapping[str, Any]) -> "Stability":
        """Return the record whose `to_dict` this is, to be drawn or tabulated again.

        Raises
        ------
        FileError
            Something is missing, or is no figure.
        """
        try:
            panels = tuple(Panel.from_dict(each) for each in told["panels"])
            own = {key: told[key] for key in ("material", "mm_per_pixel", "seed")}
            return cls(**own, panels=panels, notes=tuple(told["notes"]))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            reason = f"no {error}" if isinstance(error, KeyError) else str(error)
            raise FileError(
                f"no figures of stresses ({reason}); expected what a stability record's to_dict "
                "gives, with all its keys."
            ) from error

    def table(self) -> str:
        """Return the Markdown table: of which quantity each method is safe, and what to do."""
        rows = [
            [
                *(f"{panel.stress}: {panel.title}", panel.axis.label),
                *(f.label, f.words, panel.fails, f.advice),
            ]
            for panel in self.panels
            for f in panel.findings()
        ]
        lines = [HEADS, ["---"] * len(HEADS), *rows]
        cells = ([each.replace("|", r"\|") for each in row] for row in lines)
        return f"{MARK}\n\n" + "".join(f"| {' | '.join(row)} |\n" for row in cells)

    def text(self) -> str:
        """Return the same table for a terminal, a block for each panel."""
        blocks = []
        for panel in self.panels:
            rows = [[each.label, each.words] for each in panel.findings()]
            head = f"{panel.stress}: {panel.title} ({panel.axis.label})"
            fails = f"limit {panel.limit:g}; beyond it {panel.fails}"
            blocks.append(f"{head}; {fails}\n{table(['method', 'safe'], rows)}")
        return "\n\n".join([*blocks, *self.notes])


MARK = "<!-- sssfit.stability/1 -->"
HEADS = ("stress", "quantity", "method", "safe", "fails by", "what to do")
