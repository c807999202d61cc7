"""The file of a table of taps, ``NAME.taps.json``; its schema is ``taps.schema.json``."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from sssfit.errors import KernelError
from sssfit.kernel.json_file import JsonFormat, check, line_of, or_nan, or_none, read_json
from sssfit.messages import counted

if TYPE_CHECKING:
    from sssfit.kernel.taps import Taps

FORMAT = "sssfit.taps/1"
TAPS = JsonFormat(FORMAT, "table of taps", ".taps")
_ROUNDING = 1e-9  # relative; sums may be computed in another order


def content(taps: "Taps") -> dict[str, Any]:
    """Return the contents of the file; NaN becomes None."""
    cost = taps.cost
    return {
        "format": FORMAT,
        "method": taps.method,
        "structure": taps.structure,
        "mm_per_pixel": taps.mm_per_pixel,
        "chained": taps.chained,
        "fetches": cost.fetches,
        "passes": cost.passes,
        "all_passes": cost.all_passes,
        "channels": list(taps.channels),
        "energy": taps.energy.tolist(),
        "errors": {name: or_none(values) for name, values in taps.errors.items()},
        "meta": dict(taps.meta),
        "stages": [
            {
                "level": each.level,
                "kind": each.kind,
                "offsets_mm": each.offsets_mm.tolist(),
                "weights": each.weights.tolist(),
            }
            | ({"angle_degrees": each.angle_degrees} if each.angle_degrees else {})
            for each in taps.stages
        ],
        "blend": taps.blend.tolist(),
    }


def pack(taps: "Taps") -> bytes:
    """Return the bytes of the file: one line for each key, one for each stage."""
    whole = content(taps)
    stages = ",\n  ".join(line_of(each) for each in whole.pop("stages"))
    lines = [f"{line_of(key)}: {line_of(value)}" for key, value in whole.items()]
    lines.insert(-1, f'"stages": [\n  {stages}\n ]')
    return ("{\n " + ",\n ".join(lines) + "\n}\n").encode()


def unpack(source: str | Path | BinaryIO, origin: str) -> tuple[dict[str, Any], Mapping[str, Any]]:
    """Return the fields of a table from a path or a binary stream, and all that the file says.

    Raises
    ------
    KernelError
        The file is invalid; the one-line message names the origin and the place in the file.
    """
    whole = read_json(source, origin, TAPS)
    try:
        check(whole, TAPS.schema)
        _check_sizes(whole)
    except KernelError as error:
        raise KernelError(f"{origin}: {error} Fit it again.") from None
    fields = {key: whole[key] for key in ("method", "channels", "chained", "stages", "meta")}
    names = ("level", "kind", "offsets_mm", "weights", "angle_degrees")
    fields["stages"] = [
        {name: each[name] for name in names if name in each} for each in whole["stages"]
    ]
    return fields | {
        "mm_per_pixel": float(whole["mm_per_pixel"]),
        "blend": np.array(whole["blend"], dtype=np.float64),
        "errors": {name: or_nan(whole["errors"][name]) for name in ("spectral", "energy")},
    }, whole


def is_taps_file(path: Path) -> bool:
    """Return whether a file is a table of taps of any version, by the format it names."""
    return TAPS.is_file(path)


def _check_sizes(whole: Mapping[str, Any]) -> None:
    """Check that every list by channel has one entry for each."""
    channels = len(whole["channels"])
    lists = {"energy": whole["energy"]}
    lists |= {f"errors.{name}": whole["errors"][name] for name in ("spectral", "energy")}
    lists |= {f"blend[{k}]": each for k, each in enumerate(whole["blend"])}
    for s, stage in enumerate(whole["stages"]):
        rows = enumerate(stage["weights"])
        lists |= {f"stages[{s}].weights[{k}]": each for k, each in rows}
    for path, values in lists.items():
        if len(values) != channels:
            raise KernelError(
                f"{path} has {counted(len(values), 'entry')}; expected {channels}, one for each "
                "channel."
            )


def check_derived(whole: Mapping[str, Any], taps: "Taps") -> None:
    """Check the file's figures of the stages against the stages, or raise KernelError."""
    found = content(taps)
    for name in ("structure", "passes", "all_passes"):
        if whole[name] != found[name]:
            raise KernelError(f"{name} = {whole[name]}, but the stages have {found[name]}.")
    if abs(whole["fetches"] - found["fetches"]) > _ROUNDING * found["fetches"]:
        raise KernelError(
            f"fetches = {whole['fetches']}, but the stages take {found['fetches']:.9g}."
        )
    rounding = _ROUNDING * np.abs(taps.blend).sum(axis=0)
    for c in np.flatnonzero(~(np.abs(np.array(whole["energy"]) - taps.energy) <= rounding)):
        raise KernelError(
            f"energy[{c}] = {whole['energy'][c]}, but the blend adds up to {taps.energy[c]:.9g}."
        )
