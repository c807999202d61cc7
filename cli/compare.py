"""``sssfit compare``: why a kernel's picture is not the true one, and every kernel by its cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from sssfit.methods import FITS
from sssfit.scene.made import COMPARED, check_pictures

from ._input import load_source
from ._options import Common, common_options, options, own_settings, refuse
from ._output import finish, held, target, write, write_chart
from ._progress import step_progress, walk_progress
from ._verb_options import COMPARE

_USED_BY = {  # what reads an option, where not every --what does
    **dict.fromkeys(("budget_chart", "photons", "method", "rank", "terms", "model"), "budget"),
    **dict.fromkeys(("table", "only", "error", "cost"), "front or kernels"),
    **dict.fromkeys(("pictures", "size", "layer", "mask"), "front, kernels, budget or presets"),
}


@click.command(short_help="Compare kernels by error and cost; split an error by cause.")
@click.argument("material", required=False)
@options(*COMPARE)
@common_options
@click.pass_context
def compare(context: click.Context, /, material: str | None, common: Common, **given: Any) -> None:
    """Compare all kernels of MATERIAL by error and cost, and split an error by cause.

    The error budget comes first: simulation noise, energy beyond the grid, separability and
    storage, each alone compared with the exact profile's 2D kernel, the largest first. Then come
    cascades, and every method dense and on taps, with error and cost. A star marks the Pareto
    front: no other kernel is as good in both and better in one. Seconds are those of this machine.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin; a budget needs a material.

    \b
      sssfit compare skin1
      sssfit compare skin1 --chart skin1-pareto.png --table skin1.csv
      sssfit compare skin1 --what budget --method gaussians --budget-chart budget.png
      sssfit compare skin1 --picture head --mm-per-pixel 0.15 --cost seconds --only svd,cascade
      sssfit compare --all -o charts
      sssfit compare skin1 --what sheet --chart skin1-sheet.png
      sssfit compare skin1 --what presets --chart skin1-engines.png
    """
    pictures = [name for each in given["pictures"] or COMPARED for name in each.split(",")]
    _check(material, given, pictures)
    own = own_settings(context, FITS, given["method"], {k: given[k] for k in ("rank", "terms")})
    from sssfit.compare import runner
    from sssfit.errors import FitError, SssfitError

    if given["what"] == "budget" and material:
        runner.check_budget(material)
    what = given["what"] if material else "front"
    run = {"seed": common.seed, "threads": common.threads}
    on = {k: given[k] for k in ("mm_per_pixel", "size", "layer", "mask")} | {"seed": common.seed}
    asked = {k: given[k] for k in ("error", "only", "mm_per_pixel", "photons", "method", "model")}
    asked |= {"settings": own or None, "steps": step_progress, "walk": walk_progress, **run}
    front = {key: given[key] for key in ("error", "cost")}
    files, wrote, failed, parts = _files(material, given), set[str](), [], list[Any]()
    outputs = [target(each) for own in files.values() for each in own.values()]
    with held(outputs, _is_ours, inputs=[material, *pictures], force=given["force"]):
        source = load_source(material) if material else None
        if source is not None and given["mm_per_pixel"] == "profile":
            asked["profile"] = runner.profile_of(source, threads=common.threads)
        scenes = [] if what == "sheet" else runner.scenes_for(asked.get("profile"), pictures, **on)
        for name, own_files in files.items():
            try:
                of_name = source or load_source(name)
                for part in runner.compare(of_name, scenes, what, name=name, **asked):
                    wrote |= _write(part, own_files, front)
                    parts.append(part)
            except SssfitError as error:
                if material:
                    raise
                failed.append(f"{name}: {error}")
    output = [each for own in files.values() for each in own.values() if each in wrote]
    if parts:
        finish(common, *runner.told(what, parts, output, **front))
    if failed:
        raise FitError(f"{len(failed)} of {len(files)} materials failed; {' '.join(failed)}")


def _files(material: str | None, given: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the files of each material's budget chart, chart and table that are asked for."""
    from sssfit.chart.files import chart_format
    from sssfit.compare.table import check_table_name
    from sssfit.material import material_names

    keys, folder = ("budget_chart", "chart", "table"), Path(given["output"] or ".")
    if material is None:
        stems = {name: folder / f"{name}-pareto" for name in material_names(paper=given["paper"])}
        return {key: {"chart": f"{each}.png", "table": f"{each}.md"} for key, each in stems.items()}
    files = {key: given[key] for key in keys if given[key]}
    for key, name in files.items():
        if name != "-":
            check_table_name(Path(name)) if key == "table" else chart_format(name)
    return {material: files}


def _is_ours(path: Path) -> bool:
    """Tell whether a file is a chart or a table that we wrote."""
    from sssfit.chart.files import is_chart_file
    from sssfit.compare.table import is_table_file

    return is_chart_file(path) or is_table_file(path)


def _write(part: Any, files: Mapping[str, str], front: Mapping[str, str]) -> set[str]:
    """Draw a part, and write the table of kernels, into files that are held; return which."""
    from sssfit.compare import Comparison
    from sssfit.compare.table import table_text

    chart = files.get("budget_chart" if isinstance(part, list) else "chart")
    if chart:
        write_chart(part, target(chart), **(front if isinstance(part, Comparison) else {}))
    table = files.get("table")
    if table and isinstance(part, Comparison):
        write(table_text(part, Path(table).suffix.lower(), **front).encode(), Path(table))
    return {each for each in (chart, table) if each}


def _check(material: str | None, given: Mapping[str, Any], names: Sequence[str]) -> None:
    """Refuse options that do not go together, or that would do nothing."""
    what, several = given["what"], material is None
    if [not several, given["every"], given["paper"]].count(True) != 1:
        raise click.UsageError("name one MATERIAL or profile, or give --all or --paper.")
    if several and what not in (None, "front"):
        raise click.UsageError("--all is for --what front; name one MATERIAL.")
    if several and (given["chart"] or given["table"]):
        raise click.UsageError("--all names its charts and tables; leave --chart and --table out.")
    if several and given["mm_per_pixel"] == "profile":
        raise click.UsageError("the pictures of --all share their pixels; give a length in mm.")
    if given["output"] is not None and not several:
        raise click.UsageError("-o is the folder of --all; name files by --chart and --table.")
    if what == "budget" and given["chart"]:
        raise click.UsageError("--chart draws no budget; name its file with --budget-chart.")
    asked = "front" if several else what
    refuse(given, {k: f"--what {v}" for k, v in _USED_BY.items() if asked and asked not in v})
    if what == "sheet" and not given["chart"]:
        raise click.UsageError("--what sheet is a picture; name its file with --chart.")
    if given["chart"] == given["budget_chart"] == "-":
        raise click.UsageError("only one of --chart and --budget-chart can go to stdout.")
    check_pictures(names, **{key: given[key] for key in ("layer", "mask", "size")})
