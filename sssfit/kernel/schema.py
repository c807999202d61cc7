"""Checks of a kernel file by ``kernel.schema.json``: the first fault, with its place.

Only the keywords used by this schema are supported; a test compares the two.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from typing import Any

from sssfit.errors import KernelError
from sssfit.messages import shown

Schema = Mapping[str, Any]

_TYPES: dict[str, tuple[Callable[[Any], bool], str]] = {
    "object": (lambda v: isinstance(v, dict), "an object"),
    "array": (lambda v: isinstance(v, list), "a list"),
    "string": (lambda v: isinstance(v, str), "a text"),
    "number": (lambda v: type(v) in (int, float) and _is_finite(v), "a finite number"),
    "integer": (lambda v: type(v) is int, "a whole number"),
    "null": (lambda v: v is None, "null"),
}


@cache
def schema() -> Schema:
    """Return the schema that is installed with the library."""
    text = (resources.files("sssfit") / "kernel.schema.json").read_text("utf-8")
    found: Schema = json.loads(text)
    return found


def check(value: object, rules: Schema, path: str = "") -> None:
    """Raise KernelError with the place of the first value that breaks the rules."""
    if "const" in rules and value != rules["const"]:
        raise _fault(path, value, repr(rules["const"]))
    if "enum" in rules and (value not in rules["enum"] or isinstance(value, bool)):
        raise _fault(path, value, " or ".join(map(str, rules["enum"])))
    if "type" in rules:
        _check_type(value, rules["type"], path)
    if isinstance(value, str) and not re.search(rules.get("pattern", ""), value):
        raise _fault(path, value, "a text that prints on one line")
    if isinstance(value, (int, float)):
        _check_range(value, rules, path)
    elif isinstance(value, list):
        _check_list(value, rules, path)
    elif isinstance(value, dict):
        _check_object(value, rules, path)


def _check_type(value: object, wanted: str | list[str], path: str) -> None:
    names = [wanted] if isinstance(wanted, str) else wanted
    if not any(_TYPES[name][0](value) for name in names):
        raise _fault(path, value, " or ".join(_TYPES[name][1] for name in names))


def _check_range(value: float, rules: Schema, path: str) -> None:
    least, most = rules.get("minimum", -math.inf), rules.get("maximum", math.inf)
    if not least <= value <= most:
        limits = f"{least:.6g} to {most:.6g}" if math.isfinite(most) else f"{least:g} or more"
        raise _fault(path, value, limits)


def _check_list(value: list[Any], rules: Schema, path: str) -> None:
    least, most = rules.get("minItems", 0), rules.get("maxItems", math.inf)
    if not least <= len(value) <= most:
        limits = f"{least}" if math.isinf(most) else f"{least} to {most}"
        many = "" if math.isfinite(most) else " or more"
        raise KernelError(f"{path} has {len(value)} entries; expected {limits}{many}.")
    if rules.get("uniqueItems") and len(set(map(repr, value))) < len(value):
        raise KernelError(f"{path} = {shown(value)} has an entry twice; expected each once.")
    items = rules.get("items", {})
    if not _are_numbers(value, items):
        for k, each in enumerate(value):
            check(each, items, f"{path}[{k}]")


def _are_numbers(values: list[Any], rules: Schema) -> bool:
    """Check all numbers at once, because a kernel may have ten million weights."""
    if rules.get("type") != "number" or not set(map(type, values)) <= {int, float}:
        return False
    least, most = rules.get("minimum", -math.inf), rules.get("maximum", math.inf)
    return all(_is_finite(each) and least <= each <= most for each in values)


def _check_object(value: dict[str, Any], rules: Schema, path: str) -> None:
    for name in rules.get("required", ()):
        if name not in value:
            raise KernelError(f"{path or 'the kernel'} has no {name}.")
    named = rules.get("properties", {})
    for name, each in value.items():
        check(each, named.get(name, rules.get("additionalProperties", {})), _joined(path, name))


def _joined(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name


def _fault(path: str, value: object, expected: str) -> KernelError:
    said = json.dumps(value) if value is None or isinstance(value, bool) else shown(value)
    return KernelError(f"{path or 'the kernel'} = {said}; expected {expected}.")


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer of 400 digits
        return False
