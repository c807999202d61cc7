"""The file of a separable kernel: JSON that a person can read and a shader author can parse.

Its schema is ``kernel.schema.json``.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.kernel.json_file import JsonFormat, check, line_of, or_nan, or_none, read_json
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel


FORMAT = "sssfit.kernel/1"
KERNEL = JsonFormat(FORMAT, "kernel", ".kernel")
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
            "relative_frobenius": or_none(kernel.relative_frobenius_error),
            "energy": or_none(kernel.energy_error),
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
    terms = ",\n  ".join(line_of(each) for each in whole.pop("terms"))
    lines = [f"{line_of(key)}: {line_of(value)}" for key, value in whole.items()]
    return ("{\n " + ",\n ".join([*lines, f'"terms": [\n  {terms}\n ]']) + "\n}\n").encode()


def unpack(source: str | Path | BinaryIO, origin: str) -> dict[str, Any]:
    """Return the fields of a kernel from a path or a binary stream.

    Raises
    ------
    KernelError
        The file is invalid; the one-line message names the origin and the place in the file.
    """
    whole = read_json(source, origin, KERNEL)
    try:
        check(whole, KERNEL.schema)
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
        "relative_frobenius_error": or_nan(errors["relative_frobenius"]),
        "energy_error": or_nan(errors["energy"]),
        "scale": np.array(whole["scale"], dtype=np.float64),
    }


def is_kernel_file(path: Path) -> bool:
    """Return whether a file is a kernel of any version, by the format it names."""
    return KERNEL.is_file(path)


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
                f"terms[{t}].weights has {counted(len(term['weights']), 'pixel')}; expected "
                f"{pixels}, as in "
                "terms[0]."
            )
        lists |= {f"terms[{t}].weights[{k}]": each for k, each in enumerate(term["weights"])}
    for path, values in lists.items():
        if len(values) != channels:
            raise KernelError(
                f"{path} has {counted(len(values), 'entry')}; expected {channels}, one for each "
                "channel."
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
            f"support_mm = {whole['support_mm']}, but {counted(pixels, 'pixel')} of "
            f"{whole['mm_per_pixel']} "
            f"mm reach {support_mm:.9g} mm."
        )
    energy = np.sum(signs * np.sum(weights, axis=1) ** 2, axis=0)
    rounding = _ROUNDING * np.sum(np.sum(np.abs(weights), axis=1) ** 2, axis=0)
    for c in np.flatnonzero(~(np.abs(whole["energy"] - energy) <= rounding)):
        raise KernelError(
            f"energy[{c}] = {whole['energy'][c]}, but the terms add up to {energy[c]:.9g}."
        )
