"""Checks of settings and of the fields of records: numbers, names of channels, JSON, provenance.

Files edited by hand and records made in Python get the same checks; each caller passes the error to
raise.
"""

import dataclasses
import inspect
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeGuard, get_args

import numpy as np
import numpy.typing as npt

from sssfit.errors import ArgumentError, MaterialError, SssfitError
from sssfit.messages import did_you_mean, shown
from sssfit.methods import Method, Setting

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

MOST_CHANNELS = 64
_MOST_PHOTONS = 10**18  # a million times the photons of a run
_SHA256 = re.compile(r"[0-9a-f]{1,64}")


def number_array(name: str, value: object, error: type[SssfitError]) -> FloatArray:
    """Return a read-only float64 copy, because a frozen record does not protect array contents.

    Texts and booleans are not numbers, although numpy would convert them; nor are values under a
    mask, which it would use.
    """
    if np.ma.is_masked(value):
        raise error(f"{name} is a masked array; fill it first: array.filled(0.0).")
    try:
        array = np.array(value, dtype=np.float64, order="C") if _is_numeric(value) else None
    except (TypeError, ValueError, OverflowError):  # an integer of 400 digits
        array = None
    if array is None:
        raise error(f"{name} is not an array of numbers.")
    array.flags.writeable = False
    return array


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is one number that a float can hold; True and texts are not."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        float(value)
    except OverflowError:  # an integer of 400 digits
        return False
    return True


def check_record(name: str, value: object, kind: Any, error: type[SssfitError]) -> None:
    """Raise ``error`` unless a value is a record of a class, or of one of a union of them."""
    if not isinstance(value, kind):
        words = " or ".join(each.__name__ for each in get_args(kind) or (kind,))
        raise error(f"{name} = {shown(value)}; expected the record {words}.")


def true_or_false(name: str, value: object, error: type[SssfitError]) -> bool:
    """Return a truth value of Python or numpy, or raise ``error``: a text or a number is none."""
    if not isinstance(value, bool | np.bool_):
        raise error(f"{name} = {shown(value)}; expected True or False.")
    return bool(value)


def is_whole(value: object) -> bool:
    """Return whether a value is a whole number of Python or numpy; True and 2.0 are not."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def check_settings(function: Callable[..., Any], given: Mapping[str, Any], who: str) -> None:
    """Refuse keyword arguments that a function does not have; ``who`` is its name in the message.

    Raises
    ------
    ArgumentError
    """
    taken = inspect.signature(function).parameters.items()
    known = [name for name, each in taken if each.kind is each.KEYWORD_ONLY]
    for name in given:
        if name not in known:
            raise ArgumentError(
                f"{who} has no setting {name}; {did_you_mean(name, known)}expected some of "
                f"{', '.join(known)}."
            )


def check_kinds(
    method: Method, given: Mapping[str, Any], error: type[SssfitError], where: str = ""
) -> None:
    """Refuse texts for numbers and the like; the method's function checks the values themselves.

    ``where`` comes before a setting's name in the message.
    """
    shared = (
        Setting("seed", "whole", "of random numbers"),  # of every method that has random numbers
        Setting("normalize", "flag", "scale to unit energy"),  # of every dense fit
    )
    kinds = {each.keyword or each.name: each for each in (*method.settings, *shared)}
    for key, value in given.items():
        expected = _expected(kinds[key], value) if key in kinds else ""
        if expected:
            raise error(f"{where}{key} = {shown(value)}; expected {expected}.")


def _expected(setting: Setting, value: Any) -> str:
    """Return what was expected in place of a value of another kind, and nothing if it is one."""
    if value is None or setting.kind == "text":
        return ""
    if setting.kind == "flag":
        is_one = not isinstance(value, str | list | tuple | Mapping | np.ndarray)
        return "" if is_one else "True or False"
    if setting.kind == "choice":
        is_one = isinstance(value, str) or callable(value)
        return "" if is_one else f"one of {', '.join(setting.among)}"
    if setting.kind in ("numbers", "parts"):
        return "a number, or one per channel" if isinstance(value, str | bool) else ""
    is_bool = isinstance(value, bool | np.bool_)
    if setting.kind in ("whole", "count"):
        is_plain = isinstance(value, float) or hasattr(value, "__index__")
        return "" if is_plain and not is_bool else "a whole number"
    return "" if is_number(value) else "a number"


def read_only(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return a view that cannot be written to.

    For what compiled functions read: numba compiles them once for arrays that can be written to and
    again, for up to 2 s, for those that cannot.
    """
    view = array.view()
    view.flags.writeable = False
    return view


class ReadOnly:
    """A frozen record whose arrays and mappings cannot be written to, nor can those of its copies.

    numpy loses an array's flag in deep copies and pickles, and a mapping proxy has neither.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}  # type: ignore[arg-type]
        fixed = tuple(name for name, value in values.items() if _is_fixed(value))
        plain = {name: _open(value) for name, value in values.items()}
        return _made_again, (type(self), plain, fixed)


def _made_again(kind: type, values: dict[str, Any], fixed: tuple[str, ...]) -> object:
    """Return a record with the fields of another, which were checked when that one was made."""
    record: object = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(record, name, _closed(value) if name in fixed else value)
    return record


def _is_fixed(value: object) -> bool:
    is_fixed_array = isinstance(value, np.ndarray) and not value.flags.writeable
    return is_fixed_array or isinstance(value, MappingProxyType)


def _open(value: Any) -> Any:
    return dict(value) if isinstance(value, MappingProxyType) else value


def _closed(value: Any) -> Any:
    """Return an array, or a mapping with its arrays, that cannot be written to."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
        return value
    for each in value.values():
        if isinstance(each, np.ndarray):
            each.flags.writeable = False
    return MappingProxyType(value)


def json_object(name: str, value: object, error: type[SssfitError]) -> Mapping[str, Any]:
    """Return a read-only copy as stored in a file: a tuple becomes a list."""
    if not isinstance(value, Mapping):
        raise error(f"{name} = {shown(value)}; expected a mapping.")
    try:
        return MappingProxyType(_json_value(name, value))
    except RecursionError:
        raise error(f"{name} cannot be kept as JSON: it is nested too deep.") from None
    except ValueError as fault:
        raise error(f"{name} cannot be kept as JSON: {fault}.") from None


def check_names(channels: object, error: type[SssfitError] = MaterialError) -> None:
    """Check for 1 to 64 distinct names."""
    if not isinstance(channels, (list, tuple)):
        raise error(f"channels = {shown(channels)}; expected a list of 1 to {MOST_CHANNELS} names.")
    if not 1 <= len(channels) <= MOST_CHANNELS:
        raise error(
            f"channels = {shown(list(channels))} has {len(channels)} names; expected 1 to "
            f"{MOST_CHANNELS}."
        )
    for k, channel in enumerate(channels):
        if not _is_label(channel):
            raise error(f"channels[{k}] = {shown(channel)}; expected a name in quotes.")
        if channel in channels[:k]:
            raise error(f"channels[{k}] = {shown(channel)} is there twice; rename one.")


def check_label(name: str, value: object, error: type[SssfitError]) -> None:
    """Check for a text that prints on one line: a newline would end a shader's comment."""
    if not isinstance(value, str) or not value.isprintable() or not value.strip():
        raise error(f"{name} = {shown(value)}; expected a text that prints on one line.")


def check_provenance(meta: Mapping[str, Any], error: type[SssfitError]) -> None:
    """Check the fields of provenance that others read; each may be missing or None."""
    for name in ("method", "profile_method", "version"):
        if meta.get(name) is not None:
            check_label(f"meta.{name}", meta[name], error)
    for name in ("material_sha256", "profile_sha256"):
        value = meta.get(name)
        if value is not None and not (isinstance(value, str) and _SHA256.fullmatch(value)):
            raise error(f"meta.{name} = {shown(value)}; expected hexadecimal digits or null.")
    for name, least, most in (("photons", 1, _MOST_PHOTONS), ("seed", 0, 2**64 - 1)):
        value = meta.get(name)
        if value is not None and not (type(value) is int and least <= value <= most):
            raise error(
                f"meta.{name} = {shown(value)}; expected a whole number from {least} to "
                f"{most:.6g}, or null."
            )
    settings = meta.get("settings", {})
    if not isinstance(settings, Mapping):
        raise error(f"meta.settings = {shown(settings)}; expected a mapping.")


def _is_numeric(value: object) -> bool:
    """Return whether every element is a number; checks each one unless numpy's type says so."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
        return True
    kinds = set(map(type, np.array(value, dtype=object).ravel()))
    numbers = (int, float, np.integer, np.floating)
    return all(issubclass(kind, numbers) and kind is not bool for kind in kinds)


def _json_value(path: str, value: object) -> Any:
    """Copy JSON values; a ValueError names the position of an invalid one."""
    if isinstance(value, Mapping):
        return {_json_key(path, key): _json_value(f"{path}.{key}", value[key]) for key in value}
    if isinstance(value, (list, tuple)):
        return [_json_value(f"{path}[{k}]", each) for k, each in enumerate(value)]
    if isinstance(value, str):
        return _json_text(path, value)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, np.integer | np.bool_):
        value = value.item()
    elif isinstance(value, np.floating):
        value = float(value)
    if not isinstance(value, (int, float)):
        raise ValueError(f"{path} is of type {type(value).__name__}")  # noqa: TRY004 (one for all)
    if not _is_finite(value):
        raise ValueError(f"{path} = {shown(value)} is not a finite number")
    return int(value) if isinstance(value, int) else float(value)


def _json_key(path: str, key: object) -> str:
    if not isinstance(key, str):
        raise ValueError(f"{path} has the key {shown(key)}, not a text")  # noqa: TRY004
    return _json_text(path, key)


def _json_text(path: str, text: str) -> str:
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{path} holds half of a character, {shown(text)}") from None
    return str(text)


def _is_finite(value: float) -> bool:
    """Return whether a number is finite as a float64; an integer of 400 digits is not."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _is_label(text: object) -> bool:
    """Return whether a text can be the head of a column."""
    return isinstance(text, str) and text.isprintable() and text.strip() == text != ""


def plain(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return figures as JSON values: arrays as lists, paths as text, None for NaN and inf."""
    return {str(key): plain_value(each) for key, each in figures.items()}


def plain_value(value: Any) -> Any:
    """Return one figure as a JSON value; see `plain`."""
    if isinstance(value, Mapping):
        return plain(value)
    if hasattr(value, "tolist"):
        return plain_value(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain_value(each) for each in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
