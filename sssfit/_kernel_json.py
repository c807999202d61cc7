"""The file of a separable kernel: JSON that a person can read and a shader author can parse.

Numbers are written as the shortest decimals that read back to the same bits.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from sssfit._material_checks import shown
from sssfit.errors import KernelError
from sssfit.files import reason

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel

FORMAT = "sssfit.kernel/1"
_MARK = b'"sssfit.kernel/'  # by which a file is ours, however damaged
_REMEDY = "name a .kernel.json file, as `sssfit fit` writes it"
MOST_BYTES = 500_000_000  # 16000 pixels, 10 terms and 64 channels are 200 MB
_TYPES: dict[str, type | tuple[type, ...]] = {
    "method": str,
    "mm_per_pixel": (int, float),
    "channels": list,
    "terms": list,
    "errors": dict,
    "scale": list,
    "parameters": dict,
    "meta": dict,
}


def content(kernel: "SeparableKernel") -> dict[str, Any]:
    """Return what the file holds; NaN becomes None."""
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
        One line that names the origin.
    """
    whole = _parsed(_read(source, origin), origin)
    _check_types(whole, origin)
    terms, errors = whole["terms"], whole["errors"]
    try:
        fields = {key: whole[key] for key in ("method", "channels", "parameters", "meta")}
        return fields | {
            "mm_per_pixel": float(whole["mm_per_pixel"]),
            "signs": np.array([term["sign"] for term in terms], dtype=np.float64),
            "weights": np.array([term["weights"] for term in terms], dtype=np.float64),
            "relative_frobenius_error": _or_nan(errors["relative_frobenius"]),
            "energy_error": _or_nan(errors["energy"]),
            "scale": np.array(whole["scale"], dtype=np.float64),
        }
    except (KeyError, TypeError, ValueError) as error:
        detail = str(error).splitlines()[0][:80]
        raise KernelError(f"{origin}: the kernel is damaged ({detail}); make it again.") from None


def is_kernel_file(path: Path) -> bool:
    """Whether a file is a kernel of any version, by its first bytes."""
    with path.open("rb") as file:
        return _MARK in file.read(200)


def _read(source: str | Path | BinaryIO, origin: str) -> bytes:
    """Read it all, up to a limit."""
    try:
        if isinstance(source, str | Path):
            with Path(source).open("rb") as file:
                text = file.read(MOST_BYTES + 1)
        else:
            text = source.read(MOST_BYTES + 1)
    except OSError as error:
        raise KernelError(f"{origin}: {reason(error)}.") from None
    if len(text) > MOST_BYTES:
        raise KernelError(f"{origin}: over {MOST_BYTES:,} bytes; this is not a kernel file.")
    return text


def _parsed(text: bytes, origin: str) -> Mapping[str, Any]:
    """Parse JSON and look at its format."""
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError) as error:
        if _MARK not in text:
            raise KernelError(f"{origin}: not a kernel; {_REMEDY}.") from None
        how = "; save it as UTF-8" if isinstance(error, UnicodeDecodeError) else ", or cut short"
        raise KernelError(
            f"{origin}: the kernel is damaged (not valid JSON{how}); make it again."
        ) from None
    found = whole.get("format") if isinstance(whole, dict) else None
    if found == FORMAT:
        return dict(whole)
    if isinstance(found, str) and found.startswith("sssfit.kernel/"):
        raise KernelError(f"{origin}: format {shown(found)}; expected {FORMAT!r}.")
    said = "" if found is None else f": it has format {shown(found)}"
    raise KernelError(f"{origin}: not a kernel{said}; {_REMEDY}.")


def _check_types(whole: Mapping[str, Any], origin: str) -> None:
    """Refuse a kernel that lacks a key or has something else under it."""
    for key, expected in _TYPES.items():
        if key not in whole:
            raise KernelError(f"{origin}: the kernel has no {key}; make it again.")
        if not isinstance(whole[key], expected):
            found = type(whole[key]).__name__
            raise KernelError(
                f"{origin}: the kernel is damaged ({key} is of type {found}); make it again."
            )
    if not all(isinstance(each, str) for each in whole["channels"]):
        raise KernelError(
            f"{origin}: the kernel is damaged (channels are not names); make it again."
        )


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _or_none(values: Any) -> list[float | None]:
    return [float(each) if np.isfinite(each) else None for each in values]


def _or_nan(values: list[float | None]) -> Any:
    return np.array([np.nan if each is None else each for each in values], dtype=np.float64)
