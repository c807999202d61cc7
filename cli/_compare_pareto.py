"""``sssfit compare``: kernels by error and cost, into a table and a chart."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._compare_input import profile_of, scenes_of
from ._compare_table import FORMATS, figures_of, is_table_file, table_text, text_of
from ._figure import chart_path, held_charts, write_chart
from ._options import Common
from ._outputs import check_distinct, held
from ._progress import step_progress
from ._report import finish, say, table

if TYPE_CHECKING:
    from sssfit.compare.comparison import Comparison
    from sssfit.fit import Pitch
    from sssfit.profile import Profile
    from sssfit.scene.record import Scene


@dataclass(frozen=True)
class Wish:
    """What was asked for: pictures and their pixels, the front's error and cost, foreign files."""

    pictures: Sequence[str]
    size: tuple[int, int] | None
    mm_per_pixel: Pitch | None
    error: str
    cost: str
    force: bool
    common: Common
    layer: str | None = None
    mask: str | None = None
    profile: Profile | None = None  # where the pitch is that of a profile, it has been read

    @cached_property
    def scenes(self) -> tuple[list[Scene], float]:
        """Make or read the pictures, once; the size of their pixels [mm]."""
        pitch = None if self.mm_per_pixel is None else float(self.mm_per_pixel)
        return scenes_of(
            self.pictures,
            self.size,
            pitch,
            self.common,
            layer=self.layer,
            mask=self.mask,
        )


@dataclass(frozen=True)
class Outputs:
    """Where a comparison goes beside the terminal; a chart ``-`` is PNG on stdout."""

    chart: str | None
    table: str | None

    @property
    def names(self) -> list[str]:
        """For reports."""
        return [name for name in (self.chart, self.table) if name is not None]


def compare_one(name: str, outputs: Outputs, wish: Wish) -> tuple[dict[str, Any], str]:
    """Compare the kernels of a material or profile, write what is wanted; figures and text.

    The outputs are held by the caller.
    """
    profile = profile_of(name, wish.common) if wish.profile is None else wish.profile
    comparison = _compared(profile, *wish.scenes, wish)
    _write(comparison, outputs, wish)
    figures = {
        "error": wish.error,
        "cost": wish.cost,
        **figures_of(comparison),
        "verdict": _verdict_figures(comparison, wish),
    }
    return figures, text_of(comparison, wish.error, wish.cost)


def _verdict_figures(comparison: Comparison, wish: Wish) -> list[dict[str, Any]]:
    """Return what the verdict is made from, cheapest first."""
    from sssfit.compare.comparison import verdicts

    return [dataclasses.asdict(each) for each in verdicts(comparison, wish.error, wish.cost)]


def compare_all(folder: Path, wish: Wish, *, paper: bool) -> None:
    """Compare the kernels of every shipped material, or the paper's: a chart and a table for each.

    A material that fails is named at the end; the others are done.
    """
    from sssfit.errors import FitError, SssfitError
    from sssfit.material import material_names

    names = material_names(paper=paper)
    stems = [folder / f"{name}-pareto" for name in names]
    outputs = [Outputs(f"{stem}.png", f"{stem}.md") for stem in stems]
    done: list[tuple[Comparison, Outputs]] = []
    failed: list[str] = []
    with held_outputs([f"{stem}.png" for stem in stems], [f"{stem}.md" for stem in stems], wish):
        scenes, pitch = wish.scenes
        for name, each in zip(names, outputs, strict=True):
            try:
                profile = profile_of(name, wish.common)
                done.append((_compared(profile, scenes, pitch, wish), each))
                _write(*done[-1], wish)
            except SssfitError as error:
                failed.append(f"{name}: {error}")
    if done:
        _report(done, wish)
    if failed:
        raise FitError(f"{len(failed)} of {len(names)} materials failed; {' '.join(failed)}")


def _compared(
    profile: Profile, scenes: Sequence[Scene], mm_per_pixel: float, wish: Wish
) -> Comparison:
    """Fit and judge, with a progress bar in a terminal."""
    from sssfit.compare import compare_kernels
    from sssfit.compare.comparison import check_error

    check_error(wish.error, profile.n_channels)
    with step_progress(profile.material_name or "profile", quiet=wish.common.quiet) as show:
        return compare_kernels(
            profile,
            scenes,
            mm_per_pixel=mm_per_pixel,
            threads=wish.common.threads,
            progress=show,
        )


@contextlib.contextmanager
def held_outputs(
    charts: Sequence[str], tables: Sequence[str], wish: Wish, *, inputs: Sequence[str] = ()
) -> Iterator[None]:
    """Check that everything can be written, and keep other runs off it, before the work begins."""
    from sssfit.errors import FileError

    for name in tables:
        if Path(name).suffix.lower() not in FORMATS:
            raise FileError(
                f"{name}: tables are Markdown, CSV or JSON; end it in .md, .csv or .json."
            )
    drawn, written = [chart_path(each) for each in charts], [Path(each) for each in tables]
    check_distinct([each for each in (*drawn, *written) if each is not None])
    read = [*inputs, *wish.pictures]
    with (
        held_charts(drawn, inputs=read, force=wish.force),
        held(written, is_table_file, inputs=read, force=wish.force),
    ):
        yield


def _write(comparison: Comparison, outputs: Outputs, wish: Wish) -> None:
    """Write chart and table, each whole or not at all; they are held by now."""
    from sssfit.files import write_atomically

    if outputs.chart is not None:
        _draw(comparison, outputs.chart, wish)
    if outputs.table is not None:
        path = Path(outputs.table)
        text = table_text(comparison, path.suffix.lower(), wish.error, wish.cost)
        write_atomically(path, lambda stream: stream.write(text.encode()))


def _draw(comparison: Comparison, name: str, wish: Wish) -> None:
    from sssfit.chart.pareto import pareto_figure

    write_chart(pareto_figure(comparison, error=wish.error, cost=wish.cost), chart_path(name))


def _report(done: Sequence[tuple[Comparison, Outputs]], wish: Wish) -> None:
    """Print the fronts of all materials; with ``--json`` all rows."""
    cells = [
        [
            comparison.profile.material_name or "profile",
            picture.name,
            ", ".join(
                f"{row.label} {row.error(wish.error):.2g}"
                for row in comparison.front(picture.name, wish.error, wish.cost)
            ),
        ]
        for comparison, _ in done
        for picture in comparison.pictures
    ]
    for comparison, _ in done:
        for label, reason in comparison.left_out:
            say(wish.common, f"Left out {label}: {reason}")
    figures: dict[str, Any] = {
        "command": "compare",
        "output": [name for _, each in done for name in each.names],
        "error": wish.error,
        "cost": wish.cost,
        "materials": [comparison.profile.material_name for comparison, _ in done],
        "rows": [row for comparison, _ in done for row in figures_of(comparison)["rows"]],
    }
    heads = ["material", "picture", f"front of {wish.error} by {wish.cost}, cheapest first"]
    text = f"{table(heads, cells)}\nWrote {', '.join(figures['output'])}"
    finish(wish.common, figures, text)
