"""Checks of a plan's fields, the same for those of a TOML file and those given in Python."""

import inspect
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sssfit.arrays import check_kinds, is_whole, json_object, number_array
from sssfit.errors import PlanError
from sssfit.material import Material
from sssfit.messages import did_you_mean, shown
from sssfit.methods import FITS, SIMULATIONS, Setting
from sssfit.sweep.axes import Axis, as_float

WALK = "montecarlo"
_MARKED = re.compile(r"\x60(\w+)( = [^\x60]+)?\x60")  # `dr_mm = 0.1`
_OF_WALKS = ("photons",)  # the others are of a single run
_OF_PROFILES = ("angles",)  # which a store does not hold


def checked_base(value: object) -> Material:
    """Return the base material; PlanError for anything else, such as its name."""
    if not isinstance(value, Material):
        raise PlanError(f"base = {shown(value)}; expected a Material, as load_material returns it.")
    return value


def checked_method(value: object) -> str:
    """Return the name of a method that simulates materials."""
    allowed = [name for name, each in SIMULATIONS.items() if each.makes is None]
    if not isinstance(value, str) or value not in allowed:
        near = did_you_mean(value, allowed) if isinstance(value, str) else ""
        raise PlanError(f"method = {shown(value)}; {near}expected one of {', '.join(allowed)}.")
    return value


def checked_seed(value: object) -> int:
    """Return a seed as an integer of Python."""
    if not is_whole(value) or not 0 <= int(value) < 2**63:  # type: ignore[call-overload]
        raise PlanError(f"seed = {shown(value)}; expected a whole number from 0 to 2^63 - 1.")
    return int(value)  # type: ignore[call-overload, no-any-return]


def checked_axes(value: object) -> tuple[Axis, ...]:
    """Return axes whose coordinates are floats of Python, each there once."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(each, Axis) for each in value):
        raise PlanError(f"axes = {shown(value)}; expected a tuple of Axis records.")
    if not value:
        raise PlanError("axes is missing; give one [[axes]] table or more.")
    return tuple(_checked_axis(each) for each in value)


def _checked_axis(axis: Axis) -> Axis:
    where = f"axis {axis.name}"
    values = _floats(where, axis.values)
    if len({*values}) < len(values):
        twice = next(each for each in values if values.count(each) > 1)
        raise PlanError(f"{where} has the value {twice:.6g} twice; leave one of them out.")
    columns = {
        name: _floats(f"{where}, column {name}", each) for name, each in axis.columns.items()
    }
    for name, each in columns.items():
        if len(each) != len(values):
            raise PlanError(
                f"{where}, column {name}, has {len(each)} values and the axis {len(values)}; give "
                "as many."
            )
    return replace(axis, values=values, columns=columns)


def _floats(where: str, values: object) -> tuple[float, ...]:
    array = number_array(f"{where}: values", values, PlanError)
    if array.ndim != 1 or not array.size or np.isnan(array).any():
        raise PlanError(f"{where} has the values {shown(values)}; expected a list of 1 or more.")
    return tuple(array.tolist())


def checked_settings(value: object, method: str) -> dict[str, Any]:
    """Return the settings of a method by the keywords of its function, as JSON values."""
    given = {key: _scalar(each) for key, each in _mapping("settings", value).items()}
    own = [each for each in SIMULATIONS[method].settings if each.name not in _OF_PROFILES]
    known = {each.name: each for each in own if method != WALK or each.name in _OF_WALKS}
    for key, each in given.items():
        if key not in known:
            raise PlanError(
                f"settings.{key} is none of {method}'s; {did_you_mean(str(key), [*known])}expected "
                f"{', '.join(known) or 'no settings'}."
            )
        _check_kind(key, each, known[key])
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


def checked_formulas(value: object) -> dict[str, str]:
    """Return the formula of each key; a number becomes its text."""
    return {key: _formula(key, _scalar(each)) for key, each in _mapping("set", value).items()}


def _formula(key: str, value: object) -> str:
    if (found := as_float(value)) is not None:
        return repr(found)
    if not isinstance(value, str):
        raise PlanError(f"set.{key} = {shown(value)}; expected a formula in quotes.")
    return value


def checked_fit(value: object) -> dict[str, Any] | None:
    """Return the arguments of the fit of each profile as JSON values, with its method."""
    if value is None:
        return None
    given = {"method": "cascade", **json_object("fit", value, PlanError)}
    method = given["method"]
    if not isinstance(method, str) or method not in FITS:
        near = did_you_mean(method, [*FITS]) if isinstance(method, str) else ""
        raise PlanError(f"fit.method = {shown(method)}; {near}expected one of {', '.join(FITS)}.")
    own = [*inspect.signature(FITS[method].load()).parameters][1:]
    known = ["method", "taps", "place", "smooth", *own]
    for key in given:
        if key not in known:
            near = did_you_mean(key, known)
            raise PlanError(f"fit.{key} is unknown; {near}expected {', '.join(known)}.")
    check_kinds(FITS[method], given, PlanError, "fit.")
    return given


def in_keys(error: Exception) -> str:
    """Return what an error says with keys of a plan in place of the arguments that it marks.

    The command line would put options in their place, and a sweep has none of them.
    """
    own = {each.name for method in SIMULATIONS.values() for each in method.settings}

    def key(found: re.Match[str]) -> str:
        name, value = found[1], found[2] or ""
        if name == "method":  # of the plan itself
            return re.sub(r"= (\w+)", r'= "\1"', f"{name}{value}")
        table = "grid" if name in ("dr_mm", "radius_mm") else "settings" if name in own else "fit"
        return f"[{table}] {name}{value.replace('True', 'true').replace('False', 'false')}"

    return _MARKED.sub(key, str(error))


def _mapping(name: str, value: object) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise PlanError(f"{name} = {shown(value)}; expected a mapping.")
    return value


def _scalar(value: object) -> object:
    """Return a number of numpy as one of Python, which JSON can hold."""
    if isinstance(value, np.floating):
        return float(value)
    return value.item() if isinstance(value, np.generic) else value
