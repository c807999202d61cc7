"""Profiles as tables (CSV): those of other programs and of measurements in, ours out.

A table has comment lines that begin with #, a header line and a line for each radius; commas
separate its columns. ``r_mm`` is the radius in mm, a column named ``X_stderr`` holds the standard
errors of the column ``X`` (nan: none), and every other column is a channel. What the numbers mean
is the table's quantity, which is either given or said in a comment, ``# quantity = energy``:

density
    R_d [1/mm^2] at the radius ``r_mm``, taken to be that of the annulus around it. Annuli meet
    half-way between the radii; the first begins at 0, the last reaches as far beyond its radius as
    it begins before it. The energy of an annulus is R_d times its area.
energy
    The share of the incident light that leaves in an annulus, whose outer edge is ``r_mm`` and
    whose inner edge is that of the line before (0 for the first). A last line with ``r_mm`` = inf
    holds what leaves beyond.

Radii may be unequally spaced. What we write is energy, with every digit: reading it gives the same
bits of radii, energies and standard errors. Specular reflectance, absorption and transmittance have
no place in a table.
"""

import csv
import io
import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sssfit import __version__, _disks
from sssfit._material_checks import check_channels, printable, shown
from sssfit.errors import MaterialError, ProfileError, SssfitWarning
from sssfit.files import has_mark
from sssfit.profile import FORMAT, Profile
from sssfit.text import finite_number, read_text

FloatArray = npt.NDArray[np.float64]

QUANTITIES = ("density", "energy")

_MARK = "# sssfit.profile.csv/1"
_STDERR = "_stderr"
_SAID = re.compile(r"#\s*quantity\s*=\s*(\w+)")
_MOST = 1e12  # mm, as far as a grid may reach; and any number, so that nothing overflows
_TO_MM = {
    "r_um": "divide it by 1000",
    "r_cm": "multiply it by 10",
    "r_m": "multiply it by 1000",
    "r": "convert it to mm",
}


def load_csv(path: str | Path, *, quantity: str | None = None) -> Profile:
    """Read a profile from a table; see `parse_csv`."""
    text = read_text(path, str(path), expected="a table of a profile (CSV)", error=ProfileError)
    return parse_csv(text, str(path), quantity=quantity)


def parse_csv(text: str, origin: str, *, quantity: str | None = None) -> Profile:
    r"""Read a profile from the text of a table, as this file's head describes it.

    Parameters
    ----------
    text : str
        The whole file, lines ending in newline characters.
    origin : str
        The file it came from: stands first in every message, its last part is ``meta["source"]``.
    quantity : "density" or "energy", optional
        What the numbers are; by default what the table says.

    Returns
    -------
    Profile
        Of unknown material; nothing is known about absorption (``absorbed`` has no layers, the
        energy balance is NaN), and the specular reflectance is given as 0.

    Raises
    ------
    ProfileError
        One line with the origin, the line's number, the column, what it holds and the remedy.

    Warns
    -----
    SssfitWarning
        A channel adds up to more than all light.

    Examples
    --------
    >>> profile = parse_csv("r_mm,red\n0.5,0.1\n2,0.05\ninf,0.01\n", "a.csv", quantity="energy")
    >>> profile.r_edges_mm.tolist(), profile.diffuse_reflectance.round(12).tolist()
    ([0.0, 0.5, 2.0], [0.16])
    """
    table = _Table(text, printable(origin))
    quantity = table.checked_quantity(quantity)
    channels = table.channels()
    radii_mm, values = table.numbers(quantity)
    n = len(radii_mm) - int(math.isinf(radii_mm[-1]))
    edges_mm = _edges_mm(radii_mm[:n], quantity)
    if quantity == "density":
        values = values * _disks.annulus_areas(edges_mm)[:, None]
    columns = {name: values[:, k] for k, name in enumerate(table.value_names)}
    none = np.full(len(values), np.nan)
    energy = np.stack([columns[name] for name in channels], axis=1)
    stderr = np.stack([columns.get(name + _STDERR, none) for name in channels], axis=1)
    is_beyond = len(values) > n
    try:
        profile = Profile(
            r_edges_mm=edges_mm,
            annulus_energy=energy[:n],
            annulus_energy_stderr=stderr[:n],
            beyond_grid=energy[n] if is_beyond else np.zeros(len(channels)),
            beyond_grid_stderr=stderr[n] if is_beyond else np.full(len(channels), np.nan),
            specular_reflectance=0.0,
            absorbed=np.zeros((0, len(channels))),
            unfinished=np.zeros(len(channels)),
            annulus_transmittance=None,
            meta={
                "format": FORMAT,
                "method": "imported",
                "material": None,
                "channels": channels,
                "photons": None,
                "seed": None,
                "version": __version__,
                "source": Path(origin).name,
                "settings": {"quantity": quantity},
            },
        )
    except ProfileError as error:
        raise ProfileError(f"{printable(origin)}: {error}") from None
    _warn_of_too_much(profile, origin)
    return profile


def csv_text(profile: Profile) -> str:
    """Write a profile as a table of energies; `parse_csv` gives the same bits back.

    A channel without a single standard error has no column of them.

    Raises
    ------
    ProfileError
        A channel's name cannot head a column.
    """
    _check_names(profile.channels)
    stream = io.StringIO()
    stream.write(f"{_MARK}\n# quantity = energy: the share of the incident light that leaves ")
    stream.write("between the r_mm of the line before and r_mm; inf: beyond the grid\n")
    stream.write(f"# {printable(_provenance(profile))}\n")
    heads: list[str] = ["r_mm"]
    columns: list[FloatArray] = [np.append(profile.r_edges_mm[1:], math.inf)]
    for c, name in enumerate(profile.channels):
        heads.append(name)
        columns.append(np.append(profile.annulus_energy[:, c], profile.beyond_grid[c]))
        stderr = np.append(profile.annulus_energy_stderr[:, c], profile.beyond_grid_stderr[c])
        if not np.isnan(stderr).all():
            heads.append(name + _STDERR)
            columns.append(stderr)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(map(repr, row) for row in np.stack(columns, axis=1).tolist())
    return stream.getvalue()


def is_profile_csv(path: Path) -> bool:
    """Tell whether a file is a table that `csv_text` wrote."""
    return has_mark(path, {_MARK.encode(): b""})


@dataclass(frozen=True, slots=True)
class _Line:
    """One line of a table: its number in the file, from 1, and its cells."""

    number: int
    cells: list[str]


class _Table:
    """A table's header and lines of cells, and the one line said about what is wrong in them."""

    def __init__(self, text: str, origin: str) -> None:
        self._origin = origin
        raw = [(k, line.strip()) for k, line in enumerate(text.split("\n"), 1) if line.strip()]
        comments = [line for _, line in raw if line.startswith("#")]
        said = (_SAID.match(line) for line in comments)
        self._said = next((match[1] for match in said if match), None)
        lines = [self._split(k, line) for k, line in raw if not line.startswith("#")]
        if not lines:
            raise ProfileError(f"{origin} holds no table; expected a header such as r_mm,R,G,B.")
        self._head, self._lines = lines[0], lines[1:]
        self._check_head()
        self.value_names = [name for name in self._head.cells if name != "r_mm"]

    def _failure(self, line: _Line, said: str, column: str = "") -> ProfileError:
        where = f"line {line.number}, column {shown(column)}" if column else f"line {line.number}"
        return ProfileError(f"{self._origin}: {where}: {said}")

    def _split(self, number: int, line: str) -> _Line:
        """Cut a line into cells by the rules of CSV."""
        try:
            cells = next(csv.reader([line], skipinitialspace=True, strict=True))
        except csv.Error as error:
            said = f"not valid CSV: {printable(str(error))}."
            raise self._failure(_Line(number, []), said) from None
        return _Line(number, [cell.strip() for cell in cells])

    def _check_head(self) -> None:
        head = self._head
        example = "expected a header such as r_mm,R,G,B"
        if all(finite_number(cell) is not None for cell in head.cells):
            raise self._failure(head, f"numbers where names should be; {example}.")
        if len(head.cells) == 1:
            raise self._failure(
                head, f"{shown(head.cells[0])} is one column; {example}, separated by commas."
            )
        if "r_mm" not in head.cells:
            near = next((cell for cell in head.cells if cell in _TO_MM), None)
            remedy = f": {_TO_MM[near]} and name it r_mm" if near else f"; {example}"
            lead = f"{shown(near)} is not in mm" if near else "no column is named r_mm"
            raise self._failure(head, f"{lead}{remedy}.")
        for name in head.cells:
            if not name:
                raise self._failure(head, "a column has no name; take out its comma, or name it.")
            if head.cells.count(name) > 1:
                raise self._failure(head, f"the column {shown(name)} is there twice; rename one.")

    def checked_quantity(self, given: str | None) -> str:
        """Return what the numbers are, by the caller or by the table's own comment."""
        quantity = given or self._said
        if quantity is None:
            raise ProfileError(
                f"{self._origin} does not say what its numbers are; give --quantity density (R_d "
                "in 1/mm^2 at the radius r_mm) or --quantity energy (of the annulus out to r_mm)."
            )
        if quantity not in QUANTITIES or (self._said or quantity) != quantity:
            other = self._said not in (None, quantity)
            said = f", where its comment says {shown(self._said)}" if other else ""
            raise ProfileError(
                f"{self._origin}: quantity = {shown(quantity)}{said}; expected density or energy, "
                "the same in both places."
            )
        return quantity

    def channels(self) -> list[str]:
        """Names of the columns that are channels."""
        channels = [name for name in self.value_names if not name.endswith(_STDERR)]
        try:
            check_channels(channels)
        except MaterialError as error:
            raise self._failure(self._head, str(error)) from None
        for name in self.value_names:
            if name not in channels and name.removesuffix(_STDERR) not in channels:
                raise self._failure(
                    self._head,
                    f"the column {shown(name)} has standard errors of a column that is not there.",
                )
        return channels

    def numbers(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return all radii (m,) [mm], the last may be inf, and the other columns (m, k)."""
        at = self._head.cells.index("r_mm")
        radii_mm: list[float] = []
        rows: list[list[float]] = []
        for k, line in enumerate(self._lines):
            if len(line.cells) != len(self._head.cells):
                raise self._failure(
                    line,
                    f"{len(line.cells)} cells where the header has {len(self._head.cells)}; "
                    "separate by commas, write decimals with a point.",
                )
            radii_mm.append(self._radius(line, line.cells[at], radii_mm, quantity))
            if math.isinf(radii_mm[-1]) and line is not self._lines[-1]:
                raise self._failure(self._lines[k + 1], "a line follows r_mm = inf, the last one.")
            cells = line.cells[:at] + line.cells[at + 1 :]
            named = zip(self.value_names, cells, strict=True)
            rows.append([self._value(line, name, cell) for name, cell in named])
        if len(rows) < 2:
            raise ProfileError(
                f"{self._origin} has {len(rows)} radius; a profile needs 2 or more."
                if rows
                else f"{self._origin} ends after its header; a profile needs 2 radii or more."
            )
        return np.array(radii_mm), np.array(rows)

    def _radius(self, line: _Line, cell: str, before: Sequence[float], quantity: str) -> float:
        """Read a radius and hold it against those before it."""
        if cell.lower() in ("inf", "+inf", "infinity"):
            if quantity == "density":
                raise self._failure(
                    line, "inf; what lies beyond can only be given as energy.", "r_mm"
                )
            if not before:
                raise self._failure(line, "inf comes before any radius.", "r_mm")
            return math.inf
        radius_mm = self._number(line, "r_mm", cell)
        if not 0 <= radius_mm <= _MOST or (radius_mm == 0 and quantity == "energy"):
            expected = "the outer edge of an annulus, above 0" if quantity == "energy" else "0 up"
            raise self._failure(
                line, f"{shown(cell)}; expected a radius in mm, {expected}.", "r_mm"
            )
        if before and radius_mm <= before[-1]:
            raise self._failure(
                line, f"{shown(cell)} is not above the {before[-1]!r} before it; sort by r.", "r_mm"
            )
        return radius_mm

    def _value(self, line: _Line, name: str, cell: str) -> float:
        """Read an energy, a density or a standard error."""
        if name.endswith(_STDERR) and cell.lower() == "nan":
            return math.nan
        value = self._number(line, name, cell)
        if not 0 <= value <= _MOST:
            said = "is negative" if value < 0 else "is out of range"
            raise self._failure(line, f"{shown(cell)} {said}; expected 0 to {_MOST:g}.", name)
        return value

    def _number(self, line: _Line, name: str, cell: str) -> float:
        if not cell:
            raise self._failure(line, "the cell is empty; leave out lines that have gaps.", name)
        value = finite_number(cell)
        if value is None:
            raise self._failure(line, f"{shown(cell)} is not a finite number such as 1.5e-3.", name)
        return value


def _edges_mm(radii_mm: FloatArray, quantity: str) -> FloatArray:
    """Edges of the annuli (n+1,) [mm] from finite radii (n,)."""
    if quantity == "energy":
        return np.append(0.0, radii_mm)
    between_mm = radii_mm[:-1] + 0.5 * np.diff(radii_mm)
    last_mm = radii_mm[-1] + (radii_mm[-1] - between_mm[-1])
    return np.concatenate(([0.0], between_mm, [last_mm]))


def _warn_of_too_much(profile: Profile, origin: str) -> None:
    """Point out what cannot be in the units a profile has."""
    total = profile.diffuse_reflectance
    worst = int(np.argmax(total))
    if total[worst] > 1.0 + 1e-6:
        warnings.warn(
            f"{printable(origin)}: {shown(profile.channels[worst])} adds up to "
            f"{total[worst]:.4g} of 1 that arrives; divide by 100 if these are densities per cm^2.",
            SssfitWarning,
            stacklevel=3,
        )


def _check_names(channels: Sequence[str]) -> None:
    """Refuse names that would not come back as the same columns."""
    try:
        check_channels(list(channels))
    except MaterialError as error:
        raise ProfileError(f"{error} (to head a column)") from None
    for name in channels:
        if name in ("", "r_mm") or name.endswith(_STDERR):
            raise ProfileError(
                f"channel {shown(name)}: a column of that name would not be a channel; rename it."
            )


def _provenance(profile: Profile) -> str:
    """Say where a profile comes from, for people."""
    meta = profile.meta
    parts = [
        str(profile.material_name or meta.get("source") or "unknown material"),
        str(meta.get("method")),
    ]
    if profile.photons is not None:
        parts.append(f"{profile.photons} photons, seed {meta.get('seed')}")
    return ", ".join([*parts, f"sssfit {meta.get('version')}"])
