"""The file of a separable kernel: JSON that a person can read and a shader author can parse.

Numbers are written as the shortest decimals that read back to the same bits. A file is checked
against ``kernel.schema.json`` by the keywords that this schema uses; a test holds the two together.
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.files import has_mark, read_at_most, reason
from sssfit.kinds import KINDS
from sssfit.messages import shown

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel


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


FORMAT = "sssfit.kernel/1"
_REMEDY = "name a .kernel.json file, as sssfit writes it"
MOST_BYTES = 500_000_000  # 16000 pixels, 10 terms and 64 channels are 200 MB
_ROUNDING = 1e-9  # relative; sums of pixels may be computed in another order


def content(kernel: "SeparableKernel") -> dict[str, Any]:
    """Return the contents of the file; NaN becomes None."""
    return {
        "format": FORMAT,
        "method": kernel.method,
        "rank": kernel.rank,
        "mm_per_pixel": kernel.mm_per_pixel,
        "pixels": kernel.pixels,
        "support_mm": kernel.support_mm,
        "channels": list(kernel.channels),
        "energy": kernel.energy.tolist(),
        "scale": kernel.scale.tolist(),
        "errors": {
            "relative_frobenius": _or_none(kernel.relative_frobenius_error),
            "energy": _or_none(kernel.energy_error),
        },
        "parameters": dict(kernel.parameters),
        "meta": dict(kernel.meta),
        "terms": [
            {"sign": [int(each) for each in signs], "weights": weights.tolist()}
            for signs, weights in zip(kernel.signs, kernel.weights, strict=True)
        ],
    }


def pack(kernel: "SeparableKernel") -> bytes:
    """Return the bytes of the file: one line for each key, one for each term."""
    whole = content(kernel)
    terms = ",\n  ".join(_line(each) for each in whole.pop("terms"))
    lines = [f"{_line(key)}: {_line(value)}" for key, value in whole.items()]
    return ("{\n " + ",\n ".join([*lines, f'"terms": [\n  {terms}\n ]']) + "\n}\n").encode()


def unpack(source: str | Path | BinaryIO, origin: str) -> dict[str, Any]:
    """Return the fields of a kernel from a path or a binary stream.

    Raises
    ------
    KernelError
        The file is invalid; the one-line message names the origin and the place in the file.
    """
    whole = _parsed(_read(source, origin), origin)
    try:
        check(whole, schema())
        _check_sizes(whole)
        signs = np.array([term["sign"] for term in whole["terms"]], dtype=np.float64)
        weights = np.array([term["weights"] for term in whole["terms"]], dtype=np.float64)
        _check_derived(whole, signs, weights)
    except KernelError as error:
        raise KernelError(f"{origin}: {error} Fit the kernel again.") from None
    errors = whole["errors"]
    fields = {key: whole[key] for key in ("method", "channels", "parameters", "meta")}
    return fields | {
        "mm_per_pixel": float(whole["mm_per_pixel"]),
        "signs": signs,
        "weights": weights,
        "relative_frobenius_error": _or_nan(errors["relative_frobenius"]),
        "energy_error": _or_nan(errors["energy"]),
        "scale": np.array(whole["scale"], dtype=np.float64),
    }


def is_kernel_file(path: Path) -> bool:
    """Return whether a file is a kernel of any version, by the format it names."""
    return has_mark(path, {b"{": b'"format": "sssfit.kernel/'})


def _read(source: str | Path | BinaryIO, origin: str) -> bytes:
    """Read the whole file, up to a limit."""
    try:
        if isinstance(source, str | Path):
            with Path(source).open("rb") as file:
                text = read_at_most(file, MOST_BYTES + 1)
        else:
            text = read_at_most(source, MOST_BYTES + 1)
    except OSError as error:
        raise KernelError(f"{origin}: {reason(error)}.") from None
    if len(text) > MOST_BYTES:
        raise KernelError(f"{origin}: over {MOST_BYTES:,} bytes; this is not a kernel file.")
    return text


def _parsed(text: bytes, origin: str) -> Mapping[str, Any]:
    """Parse JSON and check its format."""
    try:
        whole = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        if not any(mark in text for mark in KINDS["kernel"].marks):
            raise KernelError(f"{origin}: not a kernel; {_REMEDY}.") from None
        if isinstance(error, KernelError):
            raise KernelError(f"{origin}: {error}; fit the kernel again.") from None
        how = "; save it as UTF-8" if isinstance(error, UnicodeDecodeError) else ", or cut short"
        raise KernelError(
            f"{origin}: the kernel is damaged (not valid JSON{how}); make a new one."
        ) from None
    found = whole.get("format") if isinstance(whole, dict) else None
    if found == FORMAT:
        return dict(whole)
    if isinstance(found, str) and found.startswith("sssfit.kernel/"):
        raise KernelError(f"{origin}: format {shown(found)}; expected {FORMAT!r}.")
    said = "" if found is None else f": it has format {shown(found)}"
    raise KernelError(f"{origin}: not a kernel{said}; {_REMEDY}.")


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


def _check_sizes(whole: Mapping[str, Any]) -> None:
    """Check the length of every list, and that the terms agree."""
    channels, terms = len(whole["channels"]), whole["terms"]
    pixels = len(terms[0]["weights"])
    lists = {"energy": whole["energy"], "scale": whole["scale"]}
    lists |= {f"errors.{name}": whole["errors"][name] for name in ("relative_frobenius", "energy")}
    for t, term in enumerate(terms):
        lists[f"terms[{t}].sign"] = term["sign"]
        if len(term["weights"]) != pixels:
            raise KernelError(
                f"terms[{t}].weights has {len(term['weights'])} pixels; expected {pixels}, as in "
                "terms[0]."
            )
        lists |= {f"terms[{t}].weights[{k}]": each for k, each in enumerate(term["weights"])}
    for path, values in lists.items():
        if len(values) != channels:
            raise KernelError(
                f"{path} has {len(values)} entries; expected {channels}, one for each channel."
            )


def _check_derived(whole: Mapping[str, Any], signs: FloatArray, weights: FloatArray) -> None:
    """Check the file's figures of the terms against the terms."""
    terms, pixels = weights.shape[:2]
    support_mm = (pixels - 1) // 2 * float(whole["mm_per_pixel"])
    counts = {"rank": (whole["rank"], terms), "pixels": (whole["pixels"], pixels)}
    for name, (said, found) in counts.items():
        if said != found:
            raise KernelError(f"{name} = {said}, but the terms have {found}.")
    if abs(whole["support_mm"] - support_mm) > _ROUNDING * support_mm:
        raise KernelError(
            f"support_mm = {whole['support_mm']}, but {pixels} pixels of {whole['mm_per_pixel']} "
            f"mm reach {support_mm:.9g} mm."
        )
    energy = np.sum(signs * np.sum(weights, axis=1) ** 2, axis=0)
    rounding = _ROUNDING * np.sum(np.sum(np.abs(weights), axis=1) ** 2, axis=0)
    for c in np.flatnonzero(~(np.abs(whole["energy"] - energy) <= rounding)):
        raise KernelError(
            f"energy[{c}] = {whole['energy'][c]}, but the terms add up to {energy[c]:.9g}."
        )


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _or_none(values: Any) -> list[float | None]:
    return [float(each) if np.isfinite(each) else None for each in values]


def _or_nan(values: list[float | None]) -> Any:
    return np.array([np.nan if each is None else each for each in values], dtype=np.float64)
