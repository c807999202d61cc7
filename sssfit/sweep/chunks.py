"""The chunks of a sweep's arrays of numbers, read and written as the files that they are.

In Zarr's format 2 a chunk without compression is a file of its values in C order, named by its
place, "3.0.1"; without the file, all of it is the fill value. Zarr itself took 2 ms of a core for
each chunk, 10 ms for a point, by its event loop and checks of indices; this takes a 20th of that.
"""

import contextlib
from collections.abc import Mapping
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.sweep.layout import chunk_points, sizes_of
from sssfit.sweep.plan import Plan
from sssfit.sweep.variables import Variable


class Chunks:
    """The chunks of one array.

    Parameters
    ----------
    store : Path
        The store's folder, in which the array was made; one process writes to it.
    plan : Plan
        Its plan.
    variable : Variable
        A variable of float64 or int64.
    """

    def __init__(self, store: Path, plan: Plan, variable: Variable) -> None:
        sizes = [sizes_of(plan)[name] for name in variable.dimensions]
        self._folder = store / variable.name
        self._unfinished = store / ".unfinished"  # after a kill it is what the next run writes to
        self._inner = chunk_points(plan, variable)
        self._fill = np.nan if variable.kind == "float64" else 0
        self._type = "<f8" if variable.kind == "float64" else "<i8"
        self._shape = (self._inner, *sizes)

    def get(self, row: tuple[int, ...], last: int) -> npt.NDArray[Any]:
        """Return the value of a point, of shape ``sizes``; fill values where there is none.

        Parameters
        ----------
        row : tuple of int
            The point's index along all axes but the last.
        last : int
            Its index along the last axis.

        Raises
        ------
        OSError
            A chunk cannot be read.
        """
        found: npt.NDArray[Any] = self._read(row, last // self._inner)[last % self._inner]
        return found

    def put(self, row: tuple[int, ...], values: Mapping[int, npt.ArrayLike]) -> None:
        """Write the values of some points of a row, by their indices along the last axis.

        Each chunk is renamed into place: what was there is replaced whole or not at all.

        Raises
        ------
        OSError
            A chunk cannot be read or written.
        """
        for number, points in groupby(sorted(values), key=lambda k: k // self._inner):
            found = self._read(row, number) if self._inner > 1 else self._empty()
            for k in points:
                found[k % self._inner] = values[k]
            self._write(row, number, found)

    def _empty(self) -> npt.NDArray[Any]:
        return np.full(self._shape, self._fill, self._type)

    def _place(self, row: tuple[int, ...], number: int) -> Path:
        place = (*row, number, *(0 for _ in self._shape[1:]))
        return self._folder / ".".join(map(str, place))

    def _read(self, row: tuple[int, ...], number: int) -> npt.NDArray[Any]:
        """Return a chunk; the points of one of another length than it should have are lost."""
        try:
            content = np.frombuffer(self._place(row, number).read_bytes(), self._type)
            return content.reshape(self._shape).copy()
        except (FileNotFoundError, ValueError):
            return self._empty()

    def _write(self, row: tuple[int, ...], number: int, chunk: npt.NDArray[Any]) -> None:
        place = self._place(row, number)
        if np.isnan(chunk).all():  # as Zarr has it
            place.unlink(missing_ok=True)
            return
        try:
            self._unfinished.write_bytes(chunk.tobytes())
            self._unfinished.replace(place)
        except OSError:
            with contextlib.suppress(OSError):
                self._unfinished.unlink()
            raise
