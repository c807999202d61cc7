"""Reads plans from TOML: known keys only, with the likeliest remedy for a wrong one."""

import inspect
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sssfit.errors import PlanError, SssfitError
from sssfit.material import Material, load_material
from sssfit.messages import did_you_mean, printable, shown
from sssfit.methods import FITS, SIMULATIONS, Method, Setting
from sssfit.sweep.axes import as_float, read_axis
from sssfit.sweep.plan import WALK, Plan
from sssfit.text import read_text

_KEYS = ("material", "method", "seed", "axes", "set", "settings", "grid", "fit")
_OF_WALKS = ("photons",)  # the others are of a single run, or of profiles that no store holds


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
        The file cannot be read or is invalid; the message begins with its name.
    """
    path, origin = Path(path), printable(str(path))
    text = read_text(path, origin, expected="a plan in TOML", error=PlanError).content
    try:
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise PlanError(f"{origin}: not valid TOML: {printable(str(error))}.") from None
    try:
        return _plan_of(content | ({} if seed is None else {"seed": seed}), path.parent)
    except SssfitError as error:
        raise PlanError(f"{origin}: {error}") from None


def _plan_of(content: Mapping[str, Any], folder: Path) -> Plan:
    for key in content:
        if key not in _KEYS:
            raise PlanError(
                f"{key} is not a key of a plan; {did_you_mean(key, _KEYS)}expected "
                f"{', '.join(_KEYS)}."
            )
    method, seed = content.get("method", WALK), content.get("seed", 1)
    allowed = [name for name, each in SIMULATIONS.items() if each.makes is None]
    if method not in allowed:
        near = did_you_mean(method, allowed) if isinstance(method, str) else ""
        raise PlanError(f"method = {shown(method)}; {near}expected one of {', '.join(allowed)}.")
    if type(seed) is not int or not 0 <= seed < 2**63:
        raise PlanError(f"seed = {shown(seed)}; expected a whole number from 0 to 2^63 - 1.")
    axes = content.get("axes", [])
    if not isinstance(axes, list):
        raise PlanError(f"axes = {shown(axes)}; expected [[axes]] tables (two brackets).")
    grid = _table(content, "grid", ("dr_mm", "radius_mm"))
    fit = dict(_table(content, "fit")) if "fit" in content else None
    return Plan(
        _base(content, folder),
        tuple(read_axis(each, folder, f"axes[{k}]") for k, each in enumerate(axes)),
        method,
        _settings(_table(content, "settings"), SIMULATIONS[method], method),
        {key: _formula(key, each) for key, each in _table(content, "set").items()},
        fit=fit if fit is None else _settings_of_fit(fit),
        seed=seed,
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


def _settings(given: dict[str, Any], method: Method, name: str) -> dict[str, Any]:
    """Return the settings of a method by the keywords of its function."""
    known = {each.name: each for each in method.settings if name != WALK or each.name in _OF_WALKS}
    for key, value in given.items():
        if key not in known:
            raise PlanError(
                f"settings.{key} is none of {name}'s; {did_you_mean(key, [*known])}expected "
                f"{', '.join(known) or 'no settings'}."
            )
        _check_kind(key, value, known[key])
    whole = {key for key, each in known.items() if each.kind == "count"}
    return {key: _whole(key, each) if key in whole else each for key, each in given.items()}


def _check_kind(key: str, value: object, setting: Setting) -> None:
    """Raise an error for a value that is not of its setting's kind."""
    if setting.kind in ("flag", "choice"):
        fits = isinstance(value, bool) if setting.kind == "flag" else value in setting.among
        expected = "true or false" if setting.kind == "flag" else " or ".join(setting.among)
    else:
        found = as_float(value)
        fits, expected = found is not None and math.isfinite(found), "a finite number"
    if not fits:
        raise PlanError(f"settings.{key} = {shown(value)}; expected {expected}.")


def _whole(key: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int | float) or value != int(value):
        raise PlanError(f"settings.{key} = {shown(value)}; expected a whole number, such as 1e6.")
    return int(value)


def _settings_of_fit(given: dict[str, Any]) -> dict[str, Any]:
    method = given.setdefault("method", "cascade")
    if method not in FITS:
        near = did_you_mean(method, [*FITS]) if isinstance(method, str) else ""
        raise PlanError(f"fit.method = {shown(method)}; {near}expected one of {', '.join(FITS)}.")
    own = [*inspect.signature(FITS[method].load()).parameters][1:]
    known = ["method", "taps", "place", "smooth", *own]
    for key in given:
        if key not in known:
            near = did_you_mean(key, known)
            raise PlanError(f"fit.{key} is unknown; {near}expected {', '.join(known)}.")
    return given


def _formula(key: str, value: object) -> str:
    if (found := as_float(value)) is not None:
        return repr(found)
    if not isinstance(value, str):
        raise PlanError(f"set.{key} = {shown(value)}; expected a formula in quotes.")
    return value
