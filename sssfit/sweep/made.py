"""Makes a sweep's store: all arrays, with their units and coordinates, and none of the points."""

import json
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit import __version__
from sssfit.errors import FileError
from sssfit.files import followed, reason, temporary_folder
from sssfit.messages import counted, note
from sssfit.simulate.batches import code_version
from sssfit.sweep.layout import bytes_of, chunk_points, sizes_of, variables_of
from sssfit.sweep.needed import needed
from sssfit.sweep.plan import Plan
from sssfit.sweep.variables import FINGERPRINT, SEED, Variable

FORMAT = "sssfit.sweep/1"
_SPARE_BYTES = 1e7


@contextmanager
def quiet() -> Iterator[None]:
    """Zarr warns of data types that its format 3 has no name for; these stores are of format 2."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def make_store(path: Path, plan: Plan, *, replaces: bool = False) -> None:
    """Make the store of a plan without any point, whole or not at all.

    Parameters
    ----------
    path : Path
    plan : Plan
    replaces : bool
        Whether to delete the store that is there; a symbolic link to it stays.

    Raises
    ------
    FileError
        The disk lacks the room, or the folder cannot be written.
    """
    path = followed(path)
    try:
        _check_room(path, plan)
        with temporary_folder(beside=path) as folder:
            made = _made(folder, plan)
            made.chmod(path.parent.stat().st_mode & 0o777)
            if replaces:
                path.rename(folder / "before")
            made.rename(path)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {reason(error)}.") from error


def restore(path: Path, plan: Plan) -> None:
    """Write again what a store has from its beginning, where it was damaged, and tell of it.

    Those are the arrays' heads, the coordinates and the seeds. Points are left as they are, and so
    are a head that can be read, which may have more in it, and arrays with another one, whose
    numbers may be packed otherwise.

    Raises
    ------
    FileError
        The folder cannot be written.
    """
    path = followed(path)
    try:
        with temporary_folder(beside=path) as folder:
            made = _made(folder, plan)
            files = [each.relative_to(made) for each in sorted(made.rglob("*")) if each.is_file()]
            marks = FINGERPRINT.name  # which are 0 only at the beginning
            own = [each for each in files if each.name[0] == "." or each.parts[0] != marks]
            damaged = [each for each in own if _is_damaged(path / each, made / each)]
            for each in damaged:
                (path / each).parent.mkdir(exist_ok=True)
                (made / each).replace(path / each)
            if damaged:
                with quiet():  # the heads of all that is there, the user's own arrays too
                    needed("zarr", "sweep").consolidate_metadata(str(path), zarr_format=2)
    except OSError as error:
        raise FileError(f"{path} cannot be written: {reason(error)}.") from error
    if damaged:
        others = f" and {counted(len(damaged) - 1, 'other file')}" if len(damaged) > 1 else ""
        was = "were" if len(damaged) > 1 else "was"
        note(f"{path}: {damaged[0].as_posix()}{others} {was} damaged or missing; written again.")


def _is_damaged(there: Path, here: Path) -> bool:
    """Tell whether a file of a store is missing, cannot be read, or has other numbers."""
    if not there.exists():
        return True
    if here.name[0] == ".":
        return _read_json(there) is None
    is_packed_alike = _read_json(there.with_name(".zarray")) == _read_json(
        here.with_name(".zarray")
    )
    return is_packed_alike and there.read_bytes() != here.read_bytes()


def _read_json(path: Path) -> object:
    """Return what a file holds, None if it is no JSON, or missing."""
    try:
        found: object = json.loads(path.read_bytes())
    except (FileNotFoundError, ValueError):
        return None
    return found


def _made(folder: Path, plan: Plan) -> Path:
    """Make a store without any point in a temporary folder."""
    zarr = needed("zarr", "sweep")
    made = folder / "made"
    with quiet():
        _fill(zarr.create_group(str(made), zarr_format=2, attributes=_head(plan)), plan)
        zarr.consolidate_metadata(str(made), zarr_format=2)
    return made


def _check_room(path: Path, plan: Plan) -> None:
    needs, free = bytes_of(plan) + _SPARE_BYTES, shutil.disk_usage(path.parent).free
    if needs > free:
        raise FileError(
            f"{path} would take {needs / 1e6:,.0f} MB, and the disk has {free / 1e6:,.0f} MB left; "
            "make room, name another disk, or use a coarser grid or fewer points."
        )


def _head(plan: Plan) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "version": __version__,
        "code": code_version(),
        "plan": plan.to_dict(),
        "plan_sha256": plan.sha256,
        "photons": plan.photons,
    }


def _fill(root: Any, plan: Plan) -> None:
    """Make all arrays; coordinates and seeds are known from the beginning."""
    for axis in plan.axes:
        _coordinate(root, axis.name, axis.values, axis.name, axis.units, axis.key or axis.name)
        for name, column in axis.columns.items():
            _coordinate(root, name, column, axis.name, _units(name), f"column {name} of the table")
    edges = plan.grid.r_edges_mm
    _coordinate(root, "r_mm", 0.5 * (edges[1:] + edges[:-1]), "r_mm", "mm", "middle of a ring")
    _coordinate(root, "r_edges_mm", edges, "edge", "mm", "edges of the rings")
    longest = max(map(len, plan.base.channels))
    channels = np.array(plan.base.channels, f"<U{longest}")
    _coordinate(root, "channel", channels, "channel", None, "channel")
    for each in variables_of(plan):
        _array(root, plan, each)
    _array(root, plan, FINGERPRINT)[...] = np.zeros(plan.shape, np.int64)
    if plan.photons is not None:
        seeds = [plan.point_seed(k) for k in range(plan.count)]
        _array(root, plan, SEED)[...] = np.array(seeds, np.int64).reshape(plan.shape)
    others = [name for axis in plan.axes for name in axis.columns]
    root.attrs["coordinates"] = " ".join([*others, "r_edges_mm"])


def _units(name: str) -> str:
    return "1/mm" if name.endswith("_per_mm") else "mm" if name.endswith("_mm") else "1"


def _coordinate(
    root: Any, name: str, values: npt.ArrayLike, dimension: str, units: str | None, words: str
) -> None:
    content = np.asarray(values)
    described = {"_ARRAY_DIMENSIONS": [dimension], "long_name": words}
    described |= {} if units is None else {"units": units}
    own: dict[str, Any] = {"attributes": described, "compressors": None, "fill_value": None}
    if content.dtype.kind == "f":
        own["fill_value"] = np.nan
    root.create_array(name, shape=content.shape, dtype=content.dtype, **own)[...] = content


def _array(root: Any, plan: Plan, each: Variable) -> Any:
    sizes = [sizes_of(plan)[name] for name in each.dimensions]
    described = {
        "_ARRAY_DIMENSIONS": [*(axis.name for axis in plan.axes), *each.dimensions],
        "long_name": each.long_name,
    }
    described |= {} if each.units is None else {"units": each.units}
    own: dict[str, Any] = {"dtype": str if each.kind == "str" else each.kind}
    if each.kind == "float64":
        own["fill_value"] = np.nan
    elif each.kind == "int64":
        own["fill_value"] = None
    if each.kind != "str":
        own["compressors"] = None
    return root.create_array(
        each.name,
        shape=(*plan.shape, *sizes),
        chunks=(*(1 for _ in plan.shape[:-1]), chunk_points(plan, each), *sizes),
        attributes=described,
        **own,
    )
