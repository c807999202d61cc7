"""Which coefficient of a material a plan sets: ``eta``, ``layers[1].sigma_a_per_mm.R``.

A key is an optional layer, a name of `UNITS`, and an optional channel. Without a channel all of
them get the value. ``albedo`` keeps the layer's extinction.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from sssfit.errors import MaterialError, PlanError
from sssfit.material import Layer, Material
from sssfit.messages import did_you_mean, shown

# The units of what can be set, as coordinates of a store have them.
UNITS = {
    "eta": "1",
    "g": "1",
    "albedo": "1",
    "sigma_a_per_mm": "1/mm",
    "sigma_s_per_mm": "1/mm",
    "thickness_mm": "mm",
    "eta_above": "1",
    "eta_below": "1",
}
_OF_HEAD = ("eta_above", "eta_below")
_OF_LAYER = ("eta", "thickness_mm")
_KEY = re.compile(r"(?:layers\[(\d{1,3})\]\.)?(\w+)(?:\.(.+))?", re.ASCII)


class Key(NamedTuple):
    """A coefficient: its layer and channel are numbers, the channel None for all of them."""

    layer: int
    name: str
    channel: int | None


def key_of(text: str, material: Material) -> Key:
    """Read a key.

    Raises
    ------
    PlanError
        The material has no such coefficient.
    """
    found = _KEY.fullmatch(text)
    if found is None or found[2] not in UNITS:
        near = did_you_mean(found[2] if found else text, [*UNITS])
        raise PlanError(
            f"key = {shown(text)} is no coefficient; {near}expected one of {', '.join(UNITS)}, "
            "with layers[0]. in front and .CHANNEL behind where one is meant."
        )
    layer, name, channel = found[1], found[2], found[3]
    count = len(material.layers)
    if name in _OF_HEAD and layer is not None:
        raise PlanError(f"key = {shown(text)}; {name} is the material's, leave its layer out.")
    if name in (*_OF_HEAD, *_OF_LAYER) and channel is not None:
        raise PlanError(f"key = {shown(text)}; {name} is the same for all channels.")
    if layer is None and count > 1 and name not in _OF_HEAD:
        raise PlanError(
            f"key = {shown(text)}; {material.name} has {count} layers: say which, such as "
            f"layers[0].{name}."
        )
    if int(layer or 0) >= count:
        there = "layers[0] only" if count == 1 else f"layers[0] to layers[{count - 1}]"
        raise PlanError(f"key = {shown(text)}; {material.name} has {there}.")
    if channel is not None and channel not in material.channels:
        raise PlanError(
            f"key = {shown(text)}; {material.name} has the channels {', '.join(material.channels)}."
        )
    where = None if channel is None else material.channels.index(channel)
    return Key(int(layer or 0), name, where)


def with_values(material: Material, values: Mapping[Key, float]) -> Material:
    """Return a material with coefficients replaced.

    Raises
    ------
    MaterialError
        A value is out of range.
    """
    layers = [_layer_with(each, k, values) for k, each in enumerate(material.layers)]
    head: dict[str, Any] = {
        key.name: value for key, value in values.items() if key.name in _OF_HEAD
    }
    return replace(material, layers=tuple(layers), **head)


def _layer_with(layer: Layer, number: int, values: Mapping[Key, float]) -> Layer:
    """Return a layer with its own of the values; the albedo comes last."""
    own = {key: value for key, value in values.items() if key.layer == number}
    fields: dict[str, Any] = {
        name: np.array(getattr(layer, name)) for name in ("g", "sigma_a_per_mm", "sigma_s_per_mm")
    }
    for key, value in own.items():
        if key.name in _OF_LAYER:
            fields[key.name] = value
        elif key.name in fields:
            fields[key.name][slice(None) if key.channel is None else key.channel] = value
    for key, value in own.items():
        if key.name == "albedo":
            if not 0.0 <= value <= 1.0:
                raise MaterialError(f"albedo = {value:g} is out of range; expected 0 to 1.")
            at = slice(None) if key.channel is None else key.channel
            sigma_t = fields["sigma_a_per_mm"][at] + fields["sigma_s_per_mm"][at]
            fields["sigma_s_per_mm"][at] = value * sigma_t
            fields["sigma_a_per_mm"][at] = sigma_t - value * sigma_t
    return replace(layer, **fields) if own else layer
