"""Plans: which materials a sweep simulates, and how; checked before the first one is simulated.

A plan names a base material, axes, and formulas that set coefficients from them::

    material = "skin1"
    method = "exact"

    [[axes]]
    key = "albedo"
    from = 0.1
    to = 0.99
    count = 20

    [[axes]]
    key = "eta"
    values = [1.3, 1.4, 1.5]

Its points are all combinations, the last axis fastest. ``plan_file`` reads the TOML.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any

from sssfit.errors import MaterialError, PlanError, SimulationError
from sssfit.grid import RadialGrid, make_grid
from sssfit.material import Material
from sssfit.messages import counted, shown
from sssfit.simulate._finished import end_condition
from sssfit.simulate.montecarlo import check_media
from sssfit.sweep.axes import Axis
from sssfit.sweep.expression import Expression
from sssfit.sweep.keys import Key, key_of, with_values
from sssfit.sweep.plan_checks import (
    WALK,
    checked_axes,
    checked_base,
    checked_fit,
    checked_formulas,
    checked_method,
    checked_seed,
    checked_settings,
    in_keys,
)
from sssfit.sweep.variables import NAMES

# A spectral library of 64 bands by 10 x 10 x 10 is 64 000.
MOST_POINTS = 100_000
_RESERVED = ("channel", "layer", "r_mm", "edge", "r_edges_mm")


@dataclass(frozen=True)
class Plan:
    """A sweep: the points are all combinations of the axes' values, the last axis fastest.

    Parameters
    ----------
    base : Material
        Its coefficients hold where no axis or formula sets them.
    axes : tuple of Axis
    method : str
        A name of ``sssfit.methods.SIMULATIONS``.
    settings : mapping
        Keyword arguments of the method: photons, tolerance. Numbers of numpy become Python's.
    formulas : mapping
        An expression of the axes' names and columns, or a number, for each key that it sets.
    dr_mm, radius_mm : float, optional [mm]
        The grid that all points share; by default rings of a 20th of the shortest mean free path
        of any point, and 32 of the longest.
    fit : mapping, optional
        Keyword arguments of ``sssfit.fit.fit_result`` for each profile.
    seed : int
        From 0 to 2^63 - 1. Every point's own seed is made of it and the point's number; see
        `point_seed`.

    Raises
    ------
    PlanError
        Anything is invalid; one line that says what. What a point's values or the grid have wrong
        is found by `grid`, which makes all points.
    """

    base: Material
    axes: tuple[Axis, ...]
    method: str = WALK
    settings: Mapping[str, Any] = field(default_factory=dict)
    formulas: Mapping[str, str] = field(default_factory=dict)
    dr_mm: float | None = None
    radius_mm: float | None = None
    fit: Mapping[str, Any] | None = None
    seed: int = 1

    def __post_init__(self) -> None:
        method = checked_method(self.method)
        plain = {
            "base": checked_base(self.base),
            "axes": checked_axes(self.axes),
            "settings": checked_settings(self.settings, method),
            "formulas": checked_formulas(self.formulas),
            "fit": checked_fit(self.fit),
            "seed": checked_seed(self.seed),
        }
        for name, each in plain.items():
            object.__setattr__(self, name, each)
        self._check_names()
        if self.count > MOST_POINTS:
            raise PlanError(
                f"the axes have {' x '.join(f'{each:,}' for each in self.shape)} = {self.count:,} "
                f"points; expected at most {MOST_POINTS:,}: shorten an axis, or sweep in parts."
            )
        _ = self.keys, self.photons

    def __getstate__(self) -> dict[str, Any]:
        """Leave the formulas' trees out of what is sent to workers; they make their own."""
        return {key: each for key, each in vars(self).items() if key != "keys"}

    def _check_names(self) -> None:
        names = [*chain(*([each.name, *each.columns] for each in self.axes))]
        for name in names:
            if names.count(name) > 1:
                raise PlanError(
                    f"two axes or columns are called {name}; give each a name of its own."
                )
            if name in _RESERVED:
                raise PlanError(f"{name} is a dimension of the store; give the axis another name.")
            if name in NAMES:
                raise PlanError(
                    f"{name} is an array of results in the store; give the axis or column another "
                    "name."
                )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(each.values) for each in self.axes)

    @property
    def shape_in_words(self) -> str:
        """The shape with the axes' names: "3 values of eta x 2 values of g"."""
        return " x ".join(
            f"{counted(len(each.values), 'value')} of {each.name}" for each in self.axes
        )

    @property
    def count(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @property
    def photons(self) -> int | None:
        """Photons of each point; None where nothing is sampled."""
        if self.method != WALK:
            return None
        return end_condition(self.settings.get("photons"), None).photons

    @cached_property
    def keys(self) -> dict[Key, Expression]:
        """What is set, and from what."""
        known = self.values(0)
        given = [(each.key, each.name) for each in self.axes if each.key]
        found: dict[Key, Expression] = {}
        texts: list[str] = []
        for text, formula in [*given, *self.formulas.items()]:
            key = key_of(text, self.base)
            for other_text, other in zip(texts, found, strict=True):
                _check_apart((text, other_text), key, other)
            found[key] = Expression(formula, known)
            texts.append(text)
        if not found:
            raise PlanError("no axis has a key and [set] is empty: all points would be the same.")
        used = {*chain(*(each.names for each in found.values()))}
        for axis in self.axes:
            if used.isdisjoint([axis.name, *axis.columns]):
                raise PlanError(
                    f"axis {axis.name} sets nothing; give it a key, or use it in [set]."
                )
        return found

    def position(self, index: int) -> tuple[int, ...]:
        """Return where a point lies on each axis."""
        found = []
        for size in reversed(self.shape):
            index, k = divmod(index, size)
            found.append(k)
        return tuple(reversed(found))

    def values(self, index: int) -> dict[str, float]:
        """Return the value of every name at a point."""
        found: dict[str, float] = {}
        for axis, k in zip(self.axes, self.position(index), strict=True):
            found |= axis.at(k)
        return found

    def label(self, index: int) -> str:
        """Return a point's coordinates in words: "albedo = 0.5, eta = 1.4"."""
        at = zip(self.axes, self.position(index), strict=True)
        return ", ".join(f"{axis.name} = {axis.values[k]:.6g}" for axis, k in at)

    def material(self, index: int) -> Material:
        """Return the material of a point.

        Raises
        ------
        PlanError
            A value is out of range; the message names the point.
        """
        values = self.values(index)
        try:
            set_to = {key: formula(values) for key, formula in self.keys.items()}
            return with_values(self.base, set_to)
        except (MaterialError, PlanError) as error:
            raise PlanError(f"point {self.label(index)}: {error}") from None

    def point_seed(self, index: int) -> int:
        """Return a point's own seed: the first 63 bits of SHA-256 of "seed/index".

        With one seed for all, neighbours would share their noise, and its trend along an axis
        would look like one of the material.
        """
        digest = hashlib.sha256(f"{self.seed}/{index}".encode()).digest()
        return int.from_bytes(digest[:8], "big") >> 1

    @cached_property
    def grid(self) -> RadialGrid:
        """The grid that all points share. Makes and checks every point's material.

        Raises
        ------
        PlanError
            A point has no valid material, the method does not cover it, or the grid is too fine.
        """
        narrowest: float | None = None
        widest = 0.0
        for index in range(self.count):
            material = self.material(index)
            try:
                if self.method == WALK:
                    check_media([material])
                grid = make_grid(material, dr_mm=self.dr_mm, radius_mm=self.radius_mm)
            except SimulationError as error:
                raise PlanError(f"point {self.label(index)}: {in_keys(error)}") from None
            narrowest = grid.dr_mm if narrowest is None else min(narrowest, grid.dr_mm)
            widest = max(widest, grid.radius_mm)
        try:
            return make_grid(self.base, dr_mm=narrowest, radius_mm=self.radius_mm or widest)
        except SimulationError as error:
            raise PlanError(f"the grid that all points share: {in_keys(error)}") from None

    def to_dict(self) -> dict[str, Any]:
        """Return all that determines the bits of the results, as JSON values."""
        return {
            "material": self.base.to_dict(),
            "method": self.method,
            "settings": dict(self.settings),
            "axes": [each.to_dict() for each in self.axes],
            "set": dict(self.formulas),
            "dr_mm": self.grid.dr_mm,
            "annuli": self.grid.annuli,
            "fit": None if self.fit is None else dict(self.fit),
            "seed": self.seed,
        }

    @property
    def sha256(self) -> str:
        """Fingerprint of `to_dict`."""
        return hashlib.sha256(json.dumps(self.to_dict(), sort_keys=True).encode()).hexdigest()


def _check_apart(texts: tuple[str, str], key: Key, other: Key) -> None:
    """Raise an error for two keys that set the same number."""
    sets = (
        {"sigma_a_per_mm", "sigma_s_per_mm"} if each == "albedo" else {each}
        for each in (key.name, other.name)
    )
    if key.layer != other.layer or set.isdisjoint(*sets):
        return
    if None in (key.channel, other.channel) or key.channel == other.channel:
        text, before = map(shown, texts)
        said = "is set twice" if text == before else f"sets a number that {before} sets as well"
        raise PlanError(f"key = {text} {said}; leave one out.")
