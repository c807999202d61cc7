"""Files of ours in JSON: read whole, checked against a schema, written a line a key.

Numbers are written as the shortest decimals that read back to the same bits. A file is checked by
the keywords that our schemas use; a test holds the two together. Every fault is a KernelError of
one line that names the place in the file.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from sssfit.errors import KernelError
from sssfit.files import has_mark, read_at_most, reason, source_of
from sssfit.messages import counted, did_you_mean, shown

Schema = Mapping[str, Any]

_TYPES: dict[str, tuple[Callable[[Any], bool], str]] = {
    "object": (lambda v: isinstance(v, dict), "an object"),
    "array": (lambda v: isinstance(v, list), "a list"),
    "string": (lambda v: isinstance(v, str), "a text"),
    "number": (lambda v: type(v) in (int, float) and _is_finite(v), "a finite number"),
    "integer": (lambda v: type(v) is int, "a whole number"),
    "boolean": (lambda v: type(v) is bool, "true or false"),
    "null": (lambda v: v is None, "null"),
}


@dataclass(frozen=True, slots=True)
class JsonFormat:
    """A kind of file: its ``format`` ("sssfit.kernel/1"), its name in messages, its ending."""

    name: str
    words: str
    ending: str

    @property
    def family(self) -> str:
        """What the formats of all versions begin with."""
        return f"{self.name.partition('/')[0]}/"

    @property
    def mark(self) -> bytes:
        """What stands in a file of any version."""
        return f'"{self.family}'.encode()

    def is_file(self, path: Path) -> bool:
        """Return whether a file is one of any version, by the format it names."""
        keys = b'"format": ', b'"format":'  # as we write it, and as programs do that save bytes
        return any(has_mark(path, {b"{": each + self.mark}) for each in keys)

    @property
    def schema(self) -> Schema:
        """The schema that is installed with the library."""
        return _schema(self.ending)

    @property
    def remedy(self) -> str:
        """What to do about another file."""
        return f"name a {self.ending}.json file, as sssfit writes it"


@cache
def _schema(ending: str) -> Schema:
    text = (resources.files("sssfit") / f"{ending[1:]}.schema.json").read_text("utf-8")
    found: Schema = json.loads(text)
    return found


MOST_BYTES = 500_000_000  # 16000 pixels, 10 terms and 64 channels are 200 MB


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
        raise KernelError(f"{path} has {counted(len(value), 'entry')}; expected {limits}{many}.")
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
    named, other = rules.get("properties", {}), rules.get("additionalProperties", {})
    for name, each in value.items():
        if name not in named and other is False:
            key = name if re.fullmatch(r"\w{1,60}", name, re.ASCII) else shown(name)
            said = f"{_joined(path, key)} is unknown; {did_you_mean(name, list(named))}"
            raise KernelError(f"{said}expected {', '.join(named)}.")
        check(each, named.get(name, other), _joined(path, name))


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


def read_bytes(source: str | Path | BinaryIO, origin: str, form: JsonFormat) -> bytes:
    """Read the whole file, up to a limit."""
    source = source_of(source, KernelError)
    try:
        if isinstance(source, Path):
            with source.open("rb") as file:
                text = read_at_most(file, MOST_BYTES + 1)
        else:
            text = read_at_most(source, MOST_BYTES + 1)
    except OSError as error:
        raise KernelError(f"{origin}: {reason(error)}.") from None
    if len(text) > MOST_BYTES:
        raise KernelError(f"{origin}: over {MOST_BYTES:,} bytes; this is not a {form.words} file.")
    return text


def read_json(source: str | Path | BinaryIO, origin: str, form: JsonFormat) -> dict[str, Any]:
    """Read a file of a format from a path or a binary stream, without checking its schema.

    Raises
    ------
    KernelError
        The file is missing, too large, no JSON, or of another format.
    """
    text = read_bytes(source, origin, form)
    try:
        whole = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        if form.mark not in text:
            raise KernelError(f"{origin}: not a {form.words}; {form.remedy}.") from None
        if isinstance(error, KernelError):
            raise KernelError(f"{origin}: {error}; fit the kernel again.") from None
        how = "; save it as UTF-8" if isinstance(error, UnicodeDecodeError) else ", or cut short"
        raise KernelError(
            f"{origin}: the {form.words} is damaged (not valid JSON{how}); make a new one."
        ) from None
    found = whole.get("format") if isinstance(whole, dict) else None
    if found == form.name:
        return dict(whole)
    if isinstance(found, str) and found.startswith(form.family):
        raise KernelError(f"{origin}: format {shown(found)}; expected {form.name!r}.")
    said = "" if found is None else f": it has format {shown(found)}"
    raise KernelError(f"{origin}: not a {form.words}{said}; {form.remedy}.")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make an object, and raise an error for repeated keys, which JSON would allow."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise KernelError(f"{shown(twice)} is there twice")
    return found


def _no_number(text: str) -> float:
    raise KernelError(f"it holds {text}, which is not a number of JSON")


def line_of(value: Any) -> str:
    """Return JSON on one line."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def or_none(values: Any) -> list[float | None]:
    """Return numbers, with None for what is not finite."""
    return [float(each) if np.isfinite(each) else None for each in values]


def or_nan(values: list[float | None]) -> Any:
    """Return an array with NaN for None."""
    return np.array([np.nan if each is None else each for each in values], dtype=np.float64)
