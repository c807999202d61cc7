"""Draws records as figures, one file per figure; results are computed elsewhere.

`page` has their common parts and writes them: the same figure gives the same bytes. Only this room
imports matplotlib, and never its pyplot, which takes 0.8 s to import and keeps global state.
`files` and `data` do not import it, because they are needed before a figure is drawn.
`figure_of` draws any record that has a chart.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sssfit.errors import ArgumentError
from sssfit.messages import one_of, shown
from sssfit.methods import VIEWS, imported

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The charts that `sssfit.methods.VIEWS` does not have: a record's class, and where it is drawn.
_OTHERS = {
    "Budget": "sssfit.chart.budget:budget_figure",
    "Comparison": "sssfit.chart.pareto:pareto_figure",
    "InversionCurves": "sssfit.chart.inversions:inversions_figure",
    "MovingLight": "sssfit.chart.moving_light:moving_light_figure",
    "PresetComparison": "sssfit.chart.presets:presets_figure",
    "Sheet": "sssfit.chart.sheet:sheet_figure",
    "SpeedUpTable": "sssfit.chart.speed_up:speed_up_figure",
    "Stability": "sssfit.chart.stability:stability_figure",
    "VariateTable": "sssfit.chart.variates:variates_figure",
}
# Where a record is drawn, by the record's class.
FIGURES: Mapping[str, str] = dict(
    sorted((_OTHERS | {each.record: each.figure for each in VIEWS.values()}).items())
)


def figure_of(record: Any, **options: Any) -> Figure:
    """Draw a record, by what it is.

    Parameters
    ----------
    record : Profile, Material, KernelView, Comparison, ...
        A record of a class in ``FIGURES``, or a list of budgets.
    **options
        Those of the record's figure.

    Returns
    -------
    matplotlib.figure.Figure
        `sssfit.chart.page.save_figure` writes it.

    Raises
    ------
    ArgumentError
        There is no chart of such a record.
    """
    kind = type(record[0] if isinstance(record, list) and record else record).__name__
    if kind not in FIGURES:
        names = one_of([*FIGURES])
        raise ArgumentError(f"there is no chart of {shown(record)}; expected one of {names}.")
    figure: Figure = imported(FIGURES[kind])(record, **options)
    return figure
