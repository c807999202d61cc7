"""Checks of a material's values, with one line of error for each.

Every message names the key with its index, the value, what was expected and what to do. The records
of ``sssfit.material`` call these checks when they are made; reading a file puts its name in front.
"""

import contextlib
import math
import re
from collections.abc import Callable, Iterator, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import MaterialError
from sssfit.messages import counted, shown

if TYPE_CHECKING:
    from sssfit.material import Layer


DENSE_PER_MM = 10.0  # cream, the densest of Jensen et al. 2001, has 7.38; skin1 in 1/cm has 7.7
# Only ratios of indices count: relative to air or water as 1, a vacuum is below 1.
MIN_ETA, MAX_ETA = 0.5, 4
_MIN, _MAX = 1e-9, 1e9  # 1/mm and mm: 1000 km and an atom's width are beyond any material
_NAME = r"[A-Za-z0-9][A-Za-z0-9._+-]{0,99}"

# For each number of a material: whether it is valid, and the expectation for messages.
_RULES: dict[str, tuple[Callable[[float], bool], str]] = {
    "eta": (
        lambda v: MIN_ETA <= v <= MAX_ETA,
        f"one refractive index from {MIN_ETA} to {MAX_ETA}, such as 1.4",
    ),
    "g": (
        lambda v: -1 < v <= 1,
        "a number above -1 and up to 1 (no scattering); 0 if sigma_s is a reduced one (sigma_s')",
    ),
    "sigma": (lambda v: 0 <= v <= _MAX, f"a number from 0 to {_MAX:g}, in 1/mm"),
    "thickness_mm": (
        lambda v: _MIN <= v <= _MAX or v == math.inf,
        f"a length from {_MIN:g} to {_MAX:g} mm; leave it out for a semi-infinite layer",
    ),
}


@contextlib.contextmanager
def located(where: str) -> Iterator[None]:
    """Put the place before the message of a ``MaterialError``."""
    try:
        yield
    except MaterialError as error:
        raise MaterialError(f"{where}{error}") from None


def number(key: str, value: object, rule: str = "") -> float:
    """Return ``value`` as a float that satisfies its rule (``_RULES[rule or key]``)."""
    allowed, expected = _RULES[rule or key]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, Real):
        raise MaterialError(f"{key} = {shown(value)} is not a number; expected {expected}.")
    try:
        result = float(value)
    except OverflowError:
        result = math.nan
    if not allowed(result):
        raise MaterialError(f"{key} = {shown(value)} is out of range; expected {expected}.")
    return result + 0.0  # -0.0 becomes 0.0: one fingerprint for both


def numbers(key: str, values: Any, rule: str = "") -> FloatArray:
    """Return a list of numbers, each under its rule, as a read-only array."""
    is_array = isinstance(values, np.ndarray) and values.ndim > 0
    items = list(values) if is_array or isinstance(values, (list, tuple)) else []
    if not items:
        raise MaterialError(
            f"{key} = {shown(values)}; expected a list with one number per channel, such as "
            "[0.1, 0.2, 0.3]."
        )
    result = np.array([number(f"{key}[{k}]", item, rule or key) for k, item in enumerate(items)])
    result.setflags(write=False)
    return result


def check_lengths(layer: "Layer") -> None:
    """Check that the lists of one layer agree."""
    n_channels = layer.sigma_a_per_mm.size
    for key in ("sigma_s_per_mm", "g"):
        size = getattr(layer, key).size
        if size != n_channels:
            raise MaterialError(
                f"{key} has {counted(size, 'value')} and sigma_a_per_mm has {n_channels}; give "
                "one per "
                "channel."
            )


def check_clear_or_not(layer: "Layer") -> None:
    """Raise an error for a channel that is almost clear."""
    sigma_t = layer.sigma_t_per_mm
    for c in np.flatnonzero((sigma_t > 0) & (sigma_t < _MIN)):
        raise MaterialError(
            f"sigma_a_per_mm[{c}] + sigma_s_per_mm[{c}] = {sigma_t[c]:g} is next to nothing; "
            f"expected {_MIN:g} per mm or more, or 0 for a clear layer."
        )


def check_not_per_cm(layer: "Layer") -> None:
    """Raise an error for a reduced extinction above known materials, which is likely in 1/cm."""
    sigma_t = layer.reduced_sigma_t_per_mm
    for c in np.flatnonzero(sigma_t > DENSE_PER_MM):
        raise MaterialError(
            f"sigma_a_per_mm[{c}] + (1 - g) sigma_s_per_mm[{c}] = {sigma_t[c]:g} per mm is above "
            f"{DENSE_PER_MM:g}; divide by 10 if these are 1/cm; if the material really is that "
            "dense, say dense = true at the top of the file."
        )


def is_name(name: object) -> TypeGuard[str]:
    """Return whether a value is a text that can be part of a file name."""
    return isinstance(name, str) and re.fullmatch(_NAME, name) is not None


def check_texts(name: object, source: object) -> None:
    """Check that the name is valid in a file name and the source can be written to a file."""
    if not is_name(name):
        raise MaterialError(
            f"name = {shown(name)} cannot be part of a file name; use at most 100 letters, digits "
            "and . _ + -, a letter or digit first."
        )
    if not isinstance(source, str):
        raise MaterialError(f"source = {shown(source)} is not a text; write it in quotes.")
    try:
        source.encode()
    except UnicodeEncodeError:
        raise MaterialError(
            f"source = {shown(source)} has characters that UTF-8 does not; type them again."
        ) from None


def check_layers(layers: object, kind: type) -> None:
    """Check for a list of layers and nothing else."""
    if not isinstance(layers, (list, tuple)):
        raise MaterialError(f"layers = {shown(layers)}; expected a list of layers.")
    for k, layer in enumerate(layers):
        if not isinstance(layer, kind):
            raise MaterialError(f"layers[{k}] = {shown(layer)}; expected a Layer.")


def check_stack(layers: Sequence["Layer"], channels: Sequence[str], eta_below: float) -> None:
    """Check the layers against the channels and one another."""
    if not layers:
        raise MaterialError("layers is empty; a material has at least one.")
    for k, layer in enumerate(layers):
        where = f"layers[{k}]." if len(layers) > 1 else ""
        if layer.g.size != len(channels):
            raise MaterialError(
                f"{where}sigma_a_per_mm has {counted(layer.g.size, 'value')} for "
                f"{counted(len(channels), 'channel')} "
                f"({shown(', '.join(channels))}); give one per channel."
            )
        if k < len(layers) - 1 and math.isinf(layer.thickness_mm):
            raise MaterialError(
                f"{where}thickness_mm is missing or infinite; only the last layer may be "
                "semi-infinite."
            )
    _check_extinction(layers, channels)
    if math.isinf(layers[-1].thickness_mm) and eta_below != 1:
        raise MaterialError(
            f"eta_below = {eta_below:g}, but nothing lies below a semi-infinite layer; give the "
            "last layer a thickness_mm or leave eta_below out."
        )


def _check_extinction(layers: Sequence["Layer"], channels: Sequence[str]) -> None:
    """Check for channels that are clear in all layers, and for a clear layer without a bottom."""
    sigma_t = np.array([layer.sigma_t_per_mm for layer in layers])
    everywhere = " in every layer" if len(layers) > 1 else ""
    if not sigma_t.any(axis=0).all():
        c = int(np.argmin(sigma_t.any(axis=0)))
        raise MaterialError(
            f"sigma_a_per_mm[{c}] + sigma_s_per_mm[{c}] = 0{everywhere}; channel "
            f"{shown(channels[c])} needs something that absorbs or scatters."
        )
    if math.isinf(layers[-1].thickness_mm) and not sigma_t[-1].all():
        c = int(np.argmin(sigma_t[-1]))
        raise MaterialError(
            f"layers[{len(layers) - 1}].sigma_a_per_mm[{c}] + sigma_s_per_mm[{c}] = 0 in a "
            f"semi-infinite layer; leave the layer out and say eta_below = {layers[-1].eta:g}."
        )
