"""Draws records as figures, one file per figure; results are computed elsewhere.

`page` has their common parts and writes them: the same figure gives the same bytes. Only this room
imports matplotlib, and never its pyplot, which takes 0.8 s to import and keeps global state.
`files` and `data` do not import it, because they are needed before a figure is drawn.
`figure_of` draws any record that has a chart.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Where the chart of a record is drawn, by the record's class; a new chart is one file and one line.
FIGURES: Mapping[str, str] = {
    "Budget": "budget:budget_figure",
    "Comparison": "pareto:pareto_figure",
    "Convergence": "convergence:convergence_figure",
    "Editing": "editing:editing_figure",
    "Guide": "guide:guide_figure",
    "KernelView": "kernel:kernel_figure",
    "Material": "material:material_figure",
    "ModelComparison": "models:models_figure",
    "Profile": "profile:profile_figure",
    "Sheet": "sheet:sheet_figure",
    "Spectrum": "spectrum:spectrum_figure",
}


def figure_of(record: Any, **options: Any) -> Figure:
    """Draw a record, by what it is.

    Parameters
    ----------
    record : Profile, Material, KernelView, Comparison, ...
        Of a class in ``FIGURES``; of budgets a list.
    **options
        Those of the record's figure.

    Returns
    -------
    matplotlib.figure.Figure
        `sssfit.chart.page.save_figure` writes it.

    Raises
    ------
    TypeError
        No chart is of such a record.
    """
    kind = type(record[0] if isinstance(record, list) else record).__name__
    if kind not in FIGURES:
        raise TypeError(f"no chart of {kind}; expected one of {', '.join(FIGURES)}.")
    module, name = FIGURES[kind].split(":")
    figure: Figure = getattr(import_module(f"sssfit.chart.{module}"), name)(record, **options)
    return figure
