"""What a store has for each point: the arrays, their dimensions and units."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sssfit.methods import TRANSPORT
from sssfit.profile import Profile
from sssfit.sweep.plan import Plan
from sssfit.sweep.tasks import Done
from sssfit.sweep.variables import ABSORBED, ALWAYS, FINGERPRINT, KERNEL, TRANSMITTED, Variable

_MOST_IN_CHUNK = 256  # points of the last axis


def variables_of(plan: Plan) -> list[Variable]:
    """Return the arrays of a plan's points, without the fingerprint."""
    found = [*ALWAYS]
    found += [ABSORBED] * (plan.method in TRANSPORT)  # others do not know it
    found += TRANSMITTED if _is_finite(plan) else ()
    return found + [KERNEL] * (plan.fit is not None)


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
