"""Profiles as tables (CSV): reads those of other programs and measurements, writes ours.

A table has comment lines that begin with #, a header line and a line for each radius, with columns
separated by commas. ``r_mm`` is the radius in mm (``r_um``, ``r_cm``, ``r_m`` in those units, and
``r`` in a unit that the caller gives), a column named ``X_stderr`` holds the standard errors of the
column ``X`` (nan: none), and every other column is a channel. The quantity of the table is the
meaning of its numbers. It is either given or named in a comment, ``# quantity = energy``:

density
    R_d at the radius, per square of the radius' unit unless the caller gives another: in 1/cm^2
    with ``r_cm``. It is assumed for the whole annulus around the radius. Annuli meet half-way
    between the radii; the first begins at 0, and the last extends equally to both sides of its
    radius. The energy of an annulus is R_d times its area.
energy
    The share of the incident light that leaves in an annulus, whose outer edge is the radius and
    whose inner edge is that of the line before (0 for the first). A last line whose radius is inf
    holds the energy beyond.

Light beyond a table without such a line is taken as 0, with the standard error 0 if the column has
standard errors: the total's is then that of its annuli.

Radii may be unequally spaced. We write energies with every digit, so radii, energies and standard
errors are read back to the same bits. A table cannot hold specular reflectance, absorption and
transmittance.
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

from sssfit import __version__
from sssfit.arrays import FloatArray, check_names, check_record
from sssfit.errors import MaterialError, ProfileError, SssfitWarning
from sssfit.files import has_mark
from sssfit.messages import counted, note, printable, shown
from sssfit.profile import FORMAT, Profile
from sssfit.profile import pixels as integrals
from sssfit.text import decimal_shifted, finite_number, read_text

QUANTITIES = ("density", "energy")

_MARK = "# sssfit.profile.csv/1"
_STDERR = "_stderr"
_SAID = re.compile(r"#\s*quantity\s*=\s*(\w+)")
_MOST = 1e12  # mm, the limit of a grid; and the limit of any number, so that nothing overflows
_ABOVE_ONE = 1e-6  # tolerance for rounding in sums that are 1
# Powers of ten from a unit to mm.
_TO_MM = {"um": -3, "mm": 0, "cm": 1, "m": 3}
UNITS = tuple(_TO_MM)
_RADIUS = re.compile(r"r(?:_(um|mm|cm|m))?")


def load_csv(
    path: str | Path,
    *,
    quantity: str | None = None,
    unit: str | None = None,
    density_unit: str | None = None,
) -> Profile:
    """Read a profile from a table; see `parse_csv`."""
    text = read_text(path, str(path), expected="a table of a profile (CSV)", error=ProfileError)
    with text.hinting(ProfileError) as content:
        return parse_csv(
            content, str(path), quantity=quantity, unit=unit, density_unit=density_unit
        )


def parse_csv(
    text: str,
    origin: str,
    *,
    quantity: str | None = None,
    unit: str | None = None,
    density_unit: str | None = None,
) -> Profile:
    r"""Read a profile from the text of a table; the module docstring describes the format.

    Parameters
    ----------
    text : str
        The whole file, lines ending in newline characters.
    origin : str
        Path of its file, which begins every message; its last part becomes ``meta["source"]``.
    quantity : "density" or "energy", optional
        Meaning of the numbers; by default the one that the table names.
    unit : "um", "mm", "cm" or "m", optional
        Unit of a column of radii named ``r``; other names include the unit.
    density_unit : the same, optional
        Unit of densities, per square; by default the unit of the radii.

    Returns
    -------
    Profile
        A profile of unknown material. Absorption is unknown (``absorbed`` has no layers, the energy
        balance is NaN), and the specular reflectance is 0.

    Raises
    ------
    ProfileError
        The table is invalid; the one-line message has the origin, the line's number, the column,
        its value and the remedy. A channel that adds up to more than all light is an error that
        names the right units.

    Warns
    -----
    SssfitWarning
        Densities begin so far out that the energy inside is a guess.

    Examples
    --------
    >>> profile = parse_csv("r_mm,red\n0.5,0.1\n2,0.05\ninf,0.01\n", "a.csv", quantity="energy")
    >>> profile.r_edges_mm.tolist(), profile.diffuse_reflectance.round(12).tolist()
    ([0.0, 0.5, 2.0], [0.16])
    """
    table = _Table(text, printable(origin), unit)
    quantity = table.checked_quantity(quantity, density_unit or table.unit)
    channels = table.channels()
    per_unit = _density_unit(density_unit, quantity, table.unit)
    radii_mm, values = table.numbers(quantity, 0 if per_unit is None else -2 * _TO_MM[per_unit])
    n = len(radii_mm) - int(math.isinf(radii_mm[-1]))
    edges_mm = _edges_mm(radii_mm[:n], quantity)
    if quantity == "density":
        values = values * integrals.annulus_areas(edges_mm)[:, None]
    columns = {name: values[:, k] for k, name in enumerate(table.value_names)}
    none = np.full(len(values), np.nan)
    energy = np.stack([columns[name] for name in channels], axis=1)
    stderr = np.stack([columns.get(name + _STDERR, none) for name in channels], axis=1)
    is_beyond = len(values) > n
    has_errors = [name + _STDERR in columns for name in channels]
    try:
        profile = Profile(
            r_edges_mm=edges_mm,
            annulus_energy=energy[:n],
            annulus_energy_stderr=stderr[:n],
            beyond_grid=energy[n] if is_beyond else np.zeros(len(channels)),
            # Taken as 0 with certainty: the total's error is then that of the annuli.
            beyond_grid_stderr=stderr[n] if is_beyond else np.where(has_errors, 0.0, np.nan),
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
    _check_total(profile, table, per_unit)
    if not is_beyond and np.isfinite(profile.diffuse_reflectance_stderr).any():
        note(
            f"{table.origin} has no light beyond {edges_mm[-1]:g} mm: it is taken as 0, and "
            "standard errors of totals are those of the annuli alone."
        )
    if quantity == "density":
        _warn_of_gap(profile, radii_mm, table)
    return profile


def csv_text(profile: Profile) -> str:
    """Write a profile as a table of energies, which `parse_csv` reads back to the same bits.

    A channel without any standard error has no column of them.

    Raises
    ------
    ProfileError
        A channel's name cannot be the head of a column, or its energies could not be read back: one
        is below 0, or they add up to more than 1.
    """
    check_record("profile", profile, Profile, ProfileError)
    _check_names(profile.channels)
    _check_energies(profile)
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
    """Return whether a file is a table that `csv_text` wrote."""
    return has_mark(path, {_MARK.encode(): b""})


@dataclass(frozen=True, slots=True)
class _Line:
    """One line of a table: its number in the file, from 1, and its cells."""

    number: int
    cells: list[str]


class _Table:
    """A table's header and lines of cells, and its one-line errors."""

    def __init__(self, text: str, origin: str, unit: str | None) -> None:
        self.origin = origin
        raw = [(k, line.strip()) for k, line in enumerate(text.split("\n"), 1) if line.strip()]
        comments = [line for _, line in raw if line.startswith("#")]
        said = (_SAID.match(line) for line in comments)
        self._said = next((match[1] for match in said if match), None)
        lines = [self._split(k, line) for k, line in raw if not line.startswith("#")]
        if not lines:
            raise ProfileError(f"{origin} holds no table; expected a header such as r_mm,R,G,B.")
        self._head, self._lines = lines[0], lines[1:]
        self.radius_name = self._checked_head()
        self.unit = self._checked_unit(unit)
        self.value_names = [name for name in self._head.cells if name != self.radius_name]

    def _failure(self, line: _Line, said: str, column: str = "") -> ProfileError:
        where = f"line {line.number}, column {shown(column)}" if column else f"line {line.number}"
        return ProfileError(f"{self.origin}: {where}: {said}")

    def _split(self, number: int, line: str) -> _Line:
        """Cut a line into cells by the rules of CSV."""
        try:
            cells = next(csv.reader([line], skipinitialspace=True, strict=True))
        except csv.Error as error:
            said = f"not valid CSV: {printable(str(error))}."
            raise self._failure(_Line(number, []), said) from None
        return _Line(number, [cell.strip() for cell in cells])

    def _checked_head(self) -> str:
        """Return the name of the column of radii."""
        head = self._head
        example = "expected a header such as r_mm,R,G,B"
        if all(finite_number(cell) is not None for cell in head.cells):
            raise self._failure(head, f"numbers where names should be; {example}.")
        if len(head.cells) == 1:
            raise self._failure(
                head, f"{shown(head.cells[0])} is one column; {example}, separated by commas."
            )
        for name in head.cells:
            if not name:
                raise self._failure(head, "a column has no name; take out its comma, or name it.")
            if head.cells.count(name) > 1:
                raise self._failure(head, f"the column {shown(name)} is there twice; rename one.")
        radii = [name for name in head.cells if _RADIUS.fullmatch(name)]
        if len(radii) != 1:
            found = f"{' and '.join(radii)} are both radii" if radii else "no column is named r_mm"
            raise self._failure(head, f"{found}; {example} (r_um, r_cm and r_m are read too).")
        return radii[0]

    def _checked_unit(self, given: str | None) -> str:
        """Return the unit of the radii, from their column's name or from the caller."""
        named = self.radius_name.partition("_")[2]
        if given is not None and given not in _TO_MM:
            raise ProfileError(
                f"{self.origin}: unit = {shown(given)}; expected {', '.join(UNITS[:-1])} or m."
            )
        if named and given not in (None, named):
            raise self._failure(
                self._head,
                f"the column {self.radius_name} says {named}, and the unit given is {given}; "
                f"rename the column r_{given}, or leave the unit out.",
            )
        if not (named or given):
            raise self._failure(
                self._head,
                "the column r does not say its unit; name it r_mm, r_um, r_cm or r_m, or give "
                "`unit`. Densities are per square of that unit.",
            )
        return given or named

    def checked_quantity(self, given: str | None, per_unit: str) -> str:
        """Return the quantity of the numbers, from the caller or the table's own comment.

        ``per_unit`` is the unit of densities, per square.
        """
        quantity, radius = given or self._said, self.radius_name
        if quantity is None:
            raise ProfileError(
                f"{self.origin} does not say what its numbers are; give "
                f'`quantity = "density"` (R_d in 1/{per_unit}^2 at the radius {radius}) or '
                f'`quantity = "energy"` (of the annulus out to {radius}).'
            )
        if quantity not in QUANTITIES or (self._said or quantity) != quantity:
            other = self._said not in (None, quantity)
            said = f", where its comment says {shown(self._said)}" if other else ""
            raise ProfileError(
                f"{self.origin}: quantity = {shown(quantity)}{said}; expected density or energy, "
                "the same in both places."
            )
        return quantity

    def channels(self) -> list[str]:
        """Return the names of the columns that are channels."""
        channels = [name for name in self.value_names if not name.endswith(_STDERR)]
        for name in self.value_names:
            if name not in channels and name.removesuffix(_STDERR) not in channels:
                raise self._failure(
                    self._head,
                    f"the column {shown(name)} has standard errors of a column that does not "
                    "exist.",
                )
        try:
            check_names(channels)
        except MaterialError as error:
            raise self._failure(self._head, str(error)) from None
        return channels

    def numbers(self, quantity: str, power: int) -> tuple[FloatArray, FloatArray]:
        """Return all radii (m,) [mm], of which the last may be inf, and the other columns (m, k).

        The other columns are multiplied by a power of ten.
        """
        at = self._head.cells.index(self.radius_name)
        radii_mm: list[float] = []
        rows: list[list[float]] = []
        for k, line in enumerate(self._lines):
            if len(line.cells) != len(self._head.cells):
                raise self._failure(
                    line,
                    f"{counted(len(line.cells), 'cell')} where the header has "
                    f"{len(self._head.cells)}; "
                    "separate by commas, write decimals with a point.",
                )
            radii_mm.append(self._radius(line, line.cells[at], radii_mm, quantity))
            if math.isinf(radii_mm[-1]) and line is not self._lines[-1]:
                raise self._failure(
                    self._lines[k + 1], f"a line follows {self.radius_name} = inf, the last one."
                )
            cells = line.cells[:at] + line.cells[at + 1 :]
            named = zip(self.value_names, cells, strict=True)
            rows.append([self._value(line, name, cell, power) for name, cell in named])
        if len(rows) < 2:
            raise ProfileError(
                f"{self.origin} has {len(rows)} radius; a profile needs 2 or more."
                if rows
                else f"{self.origin} ends after its header; a profile needs 2 radii or more."
            )
        return np.array(radii_mm), np.array(rows)

    def _radius(self, line: _Line, cell: str, before: Sequence[float], quantity: str) -> float:
        """Read a radius and compare it with those before it."""
        name = self.radius_name
        if cell.lower() in ("inf", "+inf", "infinity"):
            if quantity == "density":
                raise self._failure(
                    line, "inf; what lies beyond can only be given as energy.", name
                )
            if not before:
                raise self._failure(line, "inf comes before any radius.", name)
            return math.inf
        radius_mm = self._number(line, name, cell, _TO_MM[self.unit])
        if not 0 <= radius_mm <= _MOST or (radius_mm == 0 and quantity == "energy"):
            expected = "the outer edge of an annulus, above 0" if quantity == "energy" else "0 up"
            raise self._failure(
                line, f"{shown(cell)}; expected a radius in {self.unit}, {expected}.", name
            )
        if before and radius_mm <= before[-1]:
            last = decimal_shifted(repr(before[-1]), -_TO_MM[self.unit])
            raise self._failure(
                line, f"{shown(cell)} is not above the {last!r} before it; sort by r.", name
            )
        return radius_mm

    def _value(self, line: _Line, name: str, cell: str, power: int) -> float:
        """Read an energy, a density or a standard error."""
        if name.endswith(_STDERR) and cell.lower() == "nan":
            return math.nan
        value = self._number(line, name, cell, power)
        if not 0 <= value <= _MOST:
            said = "is negative" if value < 0 else "is out of range"
            raise self._failure(line, f"{shown(cell)} {said}; expected 0 to {_MOST:g}.", name)
        return value

    def _number(self, line: _Line, name: str, cell: str, power: int) -> float:
        """Read a number, times ten to a power."""
        if not cell:
            raise self._failure(line, "the cell is empty; leave out lines that have gaps.", name)
        if finite_number(cell) is None:
            raise self._failure(line, f"{shown(cell)} is not a finite number such as 1.5e-3.", name)
        return decimal_shifted(cell, power)


def _density_unit(given: str | None, quantity: str, unit: str) -> str | None:
    """Return the unit of densities, per square; None for energies."""
    if quantity == "energy":
        if given is not None:
            raise ProfileError(
                "`density_unit` is for densities; energies have no unit: leave it out."
            )
        return None
    if given is not None and given not in _TO_MM:
        raise ProfileError(f"density_unit = {shown(given)}; expected {', '.join(UNITS[:-1])} or m.")
    return given or unit


def _edges_mm(radii_mm: FloatArray, quantity: str) -> FloatArray:
    """Return the edges of the annuli (n+1,) [mm] for finite radii (n,)."""
    if quantity == "energy":
        return np.append(0.0, radii_mm)
    between_mm = radii_mm[:-1] + 0.5 * np.diff(radii_mm)
    last_mm = radii_mm[-1] + (radii_mm[-1] - between_mm[-1])
    return np.concatenate(([0.0], between_mm, [last_mm]))


def _check_total(profile: Profile, table: _Table, per_unit: str | None) -> None:
    """Raise an error for a channel that reflects more than arrives, and name the right units."""
    total = profile.diffuse_reflectance
    worst = int(np.argmax(total))
    if total[worst] <= 1.0 + _ABOVE_ONE:
        return
    said = (
        f"{table.origin}: {shown(profile.channels[worst])} adds up to {total[worst]:.6g} of 1 "
        "that arrives"
    )
    if per_unit is not None:
        remedy = _fitting_units(float(total[worst]), table, per_unit)
    else:
        percent = ", divide by 100 if they are per cent" if total[worst] <= 100.0 else ""
        remedy = (
            'expected shares of the incident light. Give `quantity = "density"` if these are '
            f"densities{percent}."
        )
    raise ProfileError(f"{said}; {remedy}")


def _fitting_units(total: float, table: _Table, per_unit: str) -> str:
    """Return the units that give the largest total of densities up to 1, as text.

    Either the radii or the densities are in another unit; changing both changes nothing.
    """
    found: list[tuple[float, str]] = []
    for each in UNITS:
        named = f'`unit = "{each}"`' if table.radius_name == "r" else f"name the column r_{each}"
        how = f'{named}, `density_unit = "{per_unit}"`'
        radii = total * 100.0 ** (_TO_MM[each] - _TO_MM[table.unit])
        found.append((radii, f"radii in {each} and densities per {per_unit}^2 ({how})"))
        densities = total * 100.0 ** (_TO_MM[per_unit] - _TO_MM[each])
        found.append((densities, f'densities per {each}^2 (`density_unit = "{each}"`)'))
    fitting = [each for each in found if each[0] <= 1.0 + _ABOVE_ONE]
    best = max((value for value, _ in fitting), default=math.nan)
    units = " or ".join(what for value, what in fitting if value > 0.99 * best)
    return f"it would be {best:.4g} with {units}." if units else "expected R_d per area."


def _warn_of_gap(profile: Profile, radii_mm: FloatArray, table: _Table) -> None:
    """Warn of light before the first radius, if that is not the centre of a bin.

    R_d is assumed constant from the axis to the first radius. Near a beam it rises like 1/r, which
    gives twice the energy for the same value at the first radius.
    """
    first_mm, second_mm = radii_mm[:2].tolist()
    if first_mm <= 0.5 * (second_mm - first_mm) * (1.0 + 1e-6):
        return
    inside = np.pi * first_mm**2 * profile.reflectance_per_mm2[0]
    total = profile.diffuse_reflectance
    share = np.divide(inside, total, out=np.zeros_like(total), where=total > 0)
    worst = int(np.argmax(share))
    first = decimal_shifted(repr(first_mm), -_TO_MM[table.unit])
    warnings.warn(
        f"{table.origin} begins at r = {first:g} {table.unit}: light nearer to the beam is "
        f"missing. With constant R_d there, {shown(profile.channels[worst])} has "
        f"{inside[worst]:.3g} of its {total[worst]:.3g} inside; if it rises like 1/r, as near a "
        f"beam, another {inside[worst]:.3g} is missing.",
        SssfitWarning,
        stacklevel=3,
    )


def _check_names(channels: Sequence[str]) -> None:
    """Check for names that would not be read back as the same columns."""
    try:
        check_names(list(channels))
    except MaterialError as error:
        raise ProfileError(f"{error} (to head a column)") from None
    for name in channels:
        if name == "" or _RADIUS.fullmatch(name) or name.endswith(_STDERR):
            raise ProfileError(
                f"channel {shown(name)}: a column of that name would not be a channel; rename it."
            )


def _check_energies(profile: Profile) -> None:
    """Check for energies that could not be read back."""
    energy = np.vstack((profile.annulus_energy, profile.beyond_grid))
    if (energy < 0.0).any():
        k, c = (int(each[0]) for each in np.nonzero(energy < 0.0))
        raise ProfileError(
            f"channel {shown(profile.channels[c])} has the negative energy {energy[k, c]:.6g} in "
            f"line {k + 1} of the table; expected energies from 0 up: set negative noise "
            "to 0."
        )
    total = profile.diffuse_reflectance
    worst = int(np.argmax(total))
    if total[worst] > 1.0 + _ABOVE_ONE:
        raise ProfileError(
            f"channel {shown(profile.channels[worst])} adds up to {total[worst]:.6g} of 1 that "
            "arrives, which a table would not be read back with; check the profile's unit."
        )


def _provenance(profile: Profile) -> str:
    """Return the origin of a profile as text."""
    meta = profile.meta
    parts = [
        str(profile.material_name or meta.get("source") or "unknown material"),
        str(meta.get("method")),
    ]
    if profile.photons is not None:
        parts.append(f"{counted(profile.photons, 'photon')}, seed {meta.get('seed')}")
    return ", ".join([*parts, f"sssfit {meta.get('version')}"])
