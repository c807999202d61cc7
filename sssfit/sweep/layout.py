"""What a store has for each point: the arrays, their dimensions and units."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.profile import Profile
from sssfit.sweep.plan import Plan
from sssfit.sweep.tasks import Done

# Arrays with a value for each ring are a chunk a point; the others are a chunk for all points of
# the last axis: 14 chunks a point took 24 ms to write.
_OF_RINGS = ("r_mm", "channel")
_MOST_IN_CHUNK = 256  # points of the last axis


@dataclass(frozen=True, slots=True)
class Variable:
    """An array of the store: its name, the dimensions after those of the axes, and a description.

    ``units`` is None for what has none, such as a text.
    """

    name: str
    dimensions: tuple[str, ...]
    long_name: str
    kind: str = "float64"
    units: str | None = "1"

    @property
    def is_of_rings(self) -> bool:
        """Whether each point has a chunk of its own."""
        return self.dimensions == _OF_RINGS or self.kind == "str"


_VARIABLES = (
    Variable("annulus_energy", _OF_RINGS, "energy reflected in each ring"),
    Variable("annulus_energy_stderr", _OF_RINGS, "its standard error, or error estimate"),
    Variable("beyond_grid", ("channel",), "energy reflected beyond the last ring"),
    Variable("beyond_grid_stderr", ("channel",), "its standard error"),
    Variable("diffuse_reflectance", ("channel",), "energy reflected diffusely"),
    Variable("diffuse_reflectance_stderr", ("channel",), "its standard error"),
    Variable("specular_reflectance", (), "energy reflected at the surface"),
    Variable("unfinished", ("channel",), "energy of walks that reached the most collisions"),
)
_ABSORBED = Variable("absorbed", ("layer", "channel"), "energy absorbed in each layer")
_TRANSMITTED = (
    Variable("annulus_transmittance", _OF_RINGS, "energy transmitted in each ring"),
    Variable("annulus_transmittance_stderr", _OF_RINGS, "its standard error, or error estimate"),
    Variable("beyond_grid_transmittance", ("channel",), "energy transmitted beyond the last ring"),
    Variable("transmittance", ("channel",), "energy transmitted"),
    Variable("transmittance_stderr", ("channel",), "its standard error"),
)
SEED = Variable("seed", (), "random seed of the point's walk", "int64", None)
_KERNEL = Variable("kernel", (), "JSON of the kernel that was fitted", "str", None)
# Not 0 once a point is finished; 64 bits of SHA-256 of what the point's arrays hold.
FINGERPRINT = Variable("fingerprint", (), "hash of a finished point, 0 before", "int64", None)
_KNOWS_ABSORBED = ("montecarlo", "exact")


def variables_of(plan: Plan) -> list[Variable]:
    """Return the arrays of a plan's points, without the fingerprint."""
    found = [*_VARIABLES]
    found += [_ABSORBED] * (plan.method in _KNOWS_ABSORBED)
    found += _TRANSMITTED if _is_finite(plan) else ()
    return found + [_KERNEL] * (plan.fit is not None)


def _is_finite(plan: Plan) -> bool:
    """Return whether light may come through: the last layer ends, or a thickness is set for it."""
    last = len(plan.base.layers) - 1
    is_set = any(key.name == "thickness_mm" and key.layer == last for key in plan.keys)
    return is_set or math.isfinite(plan.base.layers[last].thickness_mm)


def sizes_of(plan: Plan) -> dict[str, int]:
    """Return the length of each dimension that no axis has."""
    return {
        "r_mm": plan.grid.annuli,
        "edge": plan.grid.annuli + 1,
        "channel": plan.base.n_channels,
        "layer": len(plan.base.layers),
    }


def chunk_points(plan: Plan, variable: Variable) -> int:
    """Return the points of the last axis that share a chunk."""
    return 1 if variable.is_of_rings else min(plan.shape[-1], _MOST_IN_CHUNK)


def bytes_of(plan: Plan) -> int:
    """Return what a store takes on disk, without its texts and heads: no array is compressed."""
    sizes = sizes_of(plan)
    each = [
        8 * int(np.prod([sizes[name] for name in variable.dimensions], dtype=np.int64))
        for variable in (*variables_of(plan), FINGERPRINT)
        if variable.kind != "str"
    ]
    return plan.count * sum(each)


def values_of(plan: Plan, done: Done, variables: list[Variable]) -> dict[str, Any]:
    """Return a point's value of each array; NaN for what its profile does not have."""
    sizes = sizes_of(plan)
    found: dict[str, Any] = {}
    for each in variables:
        value = done.kernel if each.name == "kernel" else _figure(done.profile, each.name)
        shape = tuple(sizes[name] for name in each.dimensions)
        found[each.name] = np.full(shape, np.nan) if value is None else value
    return found


def _figure(profile: Profile | None, name: str) -> Any:
    value = getattr(profile, name)
    return None if name == "absorbed" and len(value) == 0 else value


def content_of(values: Mapping[str, Any]) -> bytes:
    """Return what a fingerprint is the hash of: all of a point's values in the order of names."""
    return b"".join(
        values[name].encode()
        if isinstance(values[name], str)
        else np.asarray(values[name], "<f8").tobytes()
        for name in sorted(values)
    )
