"""Reads plans from TOML: known keys only, with the likeliest remedy for a wrong one."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sssfit.errors import PlanError, SssfitError
from sssfit.files import path_of
from sssfit.material import Material, load_material
from sssfit.messages import did_you_mean, printable, shown
from sssfit.sweep.axes import read_axis
from sssfit.sweep.plan import Plan
from sssfit.sweep.plan_checks import WALK
from sssfit.text import read_text

_KEYS = ("material", "method", "seed", "axes", "set", "settings", "grid", "fit")


def load_plan(path: str | Path, *, seed: int | None = None) -> Plan:
    """Read a plan from a TOML file; materials and tables that it names lie beside it.

    Parameters
    ----------
    path : str or Path
    seed : int, optional
        In place of the plan's own.

    Raises
    ------
    PlanError
        The file cannot be read, or it or a point is invalid; the message begins with its name.
    """
    folder, origin = path_of(path, PlanError).parent, printable(str(path))
    if origin == "-":
        raise PlanError(
            "- is stdin, and what a plan names lies in the plan's own folder; give the path of a "
            "file."
        )
    text = read_text(path, origin, expected="a plan in TOML", error=PlanError).content
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise PlanError(f"{origin}: not valid TOML: {printable(str(error))}.") from None
    try:
        plan = _plan_of(content | ({} if seed is None else {"seed": seed}), folder)
        _ = plan.grid  # which checks all points
    except SssfitError as error:
        raise PlanError(f"{origin}: {error}") from None
    return plan


def _plan_of(content: Mapping[str, Any], folder: Path) -> Plan:
    for key in content:
        if key not in _KEYS:
            raise PlanError(
                f"{key} is not a key of a plan; {did_you_mean(key, _KEYS)}expected "
                f"{', '.join(_KEYS)}."
            )
    axes = content.get("axes", [])
    if not isinstance(axes, list):
        raise PlanError(f"axes = {shown(axes)}; expected [[axes]] tables (two brackets).")
    grid = _table(content, "grid", ("dr_mm", "radius_mm"))
    return Plan(
        _base(content, folder),
        tuple(read_axis(each, folder, f"axes[{k}]") for k, each in enumerate(axes)),
        content.get("method", WALK),
        _table(content, "settings"),
        _table(content, "set"),
        fit=_table(content, "fit") if "fit" in content else None,
        seed=content.get("seed", 1),
        **grid,
    )


def _base(content: Mapping[str, Any], folder: Path) -> Material:
    name = content.get("material")
    if not isinstance(name, str) or not name:
        raise PlanError(
            f"material = {shown(name)}; expected a name (`material_names()` lists them) or the "
            "path of a .toml file, from the plan's folder."
        )
    beside = folder / name
    return load_material(beside if name.endswith(".toml") else name)


def _table(content: Mapping[str, Any], key: str, known: tuple[str, ...] = ()) -> dict[str, Any]:
    found = content.get(key, {})
    if not isinstance(found, dict):
        raise PlanError(f"{key} = {shown(found)}; expected a table, [{key}].")
    for name in found:
        if known and name not in known:
            near = did_you_mean(name, known)
            raise PlanError(f"{key}.{name} is unknown; {near}expected {', '.join(known)}.")
    return found
