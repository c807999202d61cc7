"""The store of a sweep: one Zarr folder of format 2, which xarray opens as it stands.

A point's arrays are written first and its fingerprint, 64 bits of their SHA-256, after them; chunks
are renamed into place. A sweep that is killed between leaves a point without a fingerprint, which
is then computed again to the same bits. Resuming compares the fingerprints with the arrays, so that
chunks that a crash of the machine lost are noticed too.

One process writes, and holds the lock of the store's name.
"""

import hashlib
import json
import time
from itertools import groupby
from pathlib import Path
from typing import Any

from sssfit.errors import FileError, SweepError
from sssfit.files import reason
from sssfit.messages import printable, shown
from sssfit.simulate.batches import code_version
from sssfit.sweep.chunks import Chunks
from sssfit.sweep.layout import content_of, values_of, variables_of
from sssfit.sweep.made import FORMAT, quiet
from sssfit.sweep.needed import needed
from sssfit.sweep.plan import Plan
from sssfit.sweep.tasks import Done
from sssfit.sweep.variables import FINGERPRINT

_WAITS_SECONDS, _WAITS_POINTS = 1.0, 512  # the most that a kill can make be computed again


class Store:
    """An open store, and the points that wait to be written to it.

    Parameters
    ----------
    path : Path
        An existing store of ``plan``.
    plan : Plan
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.plan = path, plan
        self._variables = variables_of(plan)
        numbers = [each for each in (*self._variables, FINGERPRINT) if each.kind != "str"]
        self._chunks = {each.name: Chunks(path, plan, each) for each in numbers}
        self._kernels: Any = self._array("kernel") if plan.fit is not None else None
        self._waiting: list[tuple[int, dict[str, Any]]] = []
        self._written_at = time.monotonic()

    def finished(self) -> list[int]:
        """Return the points whose arrays are as their fingerprints say."""
        marks = {k: self._kept_mark(k) for k in range(self.plan.count)}
        return [k for k, mark in marks.items() if mark and self._mark_of(k) == mark]

    def _kept_mark(self, index: int) -> int:
        *row, last = self.plan.position(index)
        try:
            return int(self._chunks[FINGERPRINT.name].get((*row,), last))
        except OSError:  # a fault of the disk: it is computed again
            return 0

    def _array(self, name: str) -> Any:
        zarr = needed("zarr", "sweep")
        return zarr.open_array(str(self.path / name), mode="r+", zarr_format=2)

    def _mark_of(self, index: int) -> int:
        *row, last = at = self.plan.position(index)
        values: dict[str, Any] = {}
        try:
            for each in self._variables:
                if each.kind == "str":
                    values[each.name] = str(self._kernels[at][()])
                else:
                    values[each.name] = self._chunks[each.name].get((*row,), last)
        except (OSError, ValueError, RuntimeError):  # a text's chunk that cannot be decompressed
            return 0
        return _mark(values)

    def add(self, done: Done) -> None:
        """Take a finished point; written at once or within a second, with its neighbours."""
        values = values_of(self.plan, done, self._variables)
        self._waiting.append((done.part.index, values))
        is_late = time.monotonic() - self._written_at > _WAITS_SECONDS
        if is_late or len(self._waiting) >= _WAITS_POINTS:
            self.flush()

    def flush(self) -> None:
        """Write what waits.

        Raises
        ------
        FileError
            The disk is full, or the folder cannot be written; what was finished before is kept.
        """
        try:
            with quiet():
                self._flush()
        except OSError as error:
            raise FileError(
                f"{self.path} cannot be written: {reason(error)}; the points that were finished "
                "before are kept, and `resume = True` continues from there."
            ) from error
        self._waiting.clear()
        self._written_at = time.monotonic()

    def _flush(self) -> None:
        waiting = sorted(self._waiting, key=lambda each: each[0])
        rows = groupby(waiting, key=lambda each: self.plan.position(each[0])[:-1])
        for row, points in rows:
            found = {self.plan.position(index)[-1]: values for index, values in points}
            for each in self._variables:
                own = {last: values[each.name] for last, values in found.items()}
                if each.kind != "str":
                    self._chunks[each.name].put(row, own)
                    continue
                for last, text in own.items():
                    self._kernels[(*row, last)] = text
            marks = {last: _mark(values) for last, values in found.items()}
            self._chunks[FINGERPRINT.name].put(row, marks)


def _mark(values: dict[str, Any]) -> int:
    digest = hashlib.sha256(content_of(values)).digest()
    return (int.from_bytes(digest[:8], "big") >> 1) | 1


def is_store(path: Path) -> bool:
    """Return whether a folder is a sweep's store, of any version."""
    return str(_read_head(path).get("format", "")).startswith("sssfit.sweep/")


def _read_head(path: Path) -> dict[str, Any]:
    try:
        found = json.loads((path / ".zattrs").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def check_same(path: Path, plan: Plan) -> None:
    """Raise SweepError for a store of another plan or version, and name what differs."""
    head = _read_head(path)
    if head.get("format") != FORMAT:
        raise SweepError(f"{path} has format {shown(head.get('format'))}; expected {FORMAT!r}.")
    if not isinstance(there := head.get("plan"), dict):
        raise SweepError(
            f"{path}: .zattrs says plan = {shown(there)}, and the plan was expected; restore the "
            "file, or use `force = True` to begin again."
        )
    here = json.loads(json.dumps(plan.to_dict()))
    differ = [key for key in here if there.get(key) != here[key]]
    if differ:
        named = "; ".join(
            f"{key} = {_short(there.get(key))} (now {_short(here[key])})" for key in differ
        )
        raise SweepError(
            f"{path} was made with another plan: {named}. Give that plan, another output, or "
            "`force = True` to begin again."
        )
    if head.get("code") != code_version():
        raise SweepError(
            f"{path} was begun with sssfit {shown(head.get('code'))}, and this is "
            f"{code_version()!r}, which would make other bits; use that version, or `force = True` "
            "to begin again."
        )


def _short(value: object) -> str:
    return printable(json.dumps(value))[:80]
