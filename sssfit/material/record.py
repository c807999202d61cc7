"""Materials: absorption and scattering of a medium, loaded from TOML and checked.

A ``Material`` is one or more ``Layer`` records from the top down, each with coefficients per colour
channel in 1/mm. Measured ones ship with sssfit (Jensen et al. 2001, Narasimhan et al. 2006);
your own file has the same form::

    name = "skin1"
    source = "Jensen et al. 2001"
    channels = ["R", "G", "B"]
    eta = 1.3
    g = 0.0
    sigma_a_per_mm = [0.032, 0.17, 0.48]
    sigma_s_per_mm = [0.74, 0.88, 1.01]

A stack has ``[[layers]]`` tables in place of the coefficients, from the top down, each with its
``thickness_mm``, and ``eta_above`` and ``eta_below`` above them.

Similarity theory reduces anisotropic scattering to sigma_s' = (1 - g) sigma_s; the mean free paths
here, which determine grids, are the reduced ones. Next: ``sssfit.grid``, ``sssfit.simulate``.
"""

import hashlib
import json
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from sssfit.arrays import FloatArray, ReadOnly, check_names, true_or_false
from sssfit.errors import MaterialError
from sssfit.material.checks import (
    DENSE_PER_MM,
    check_clear_or_not,
    check_layers,
    check_lengths,
    check_not_per_cm,
    check_stack,
    check_texts,
    located,
    number,
    numbers,
)
from sssfit.material.toml import (
    check_kind,
    default_channels,
    is_path,
    read_tables,
    read_text,
    write_toml,
)
from sssfit.messages import by_channel, did_you_mean, of_material, printable, shown
from sssfit.optics import normal_reflectance


@dataclass(frozen=True, slots=True, eq=False)
class Layer(ReadOnly):
    """One homogeneous layer of C channels.

    Parameters
    ----------
    eta : float
        Refractive index, 0.5 to 4, the same for all channels; only ratios of indices count.
    g : (C,) or float
        Mean cosine of scattering, above -1 to 1; above 0 is forward. One number applies to all
        channels. 1 means no scattering, and becomes sigma_s = 0 and g = 0 in that channel.
    sigma_a_per_mm, sigma_s_per_mm : (C,)
        Absorption and scattering coefficients [1/mm]. If both are 0, the layer is clear in that
        channel.
    thickness_mm : float
        Thickness [mm]; infinite (the default) for a last layer without a bottom.

    Raises
    ------
    MaterialError
        A value is not a number or out of range, or the lists differ in length.
    """

    eta: float
    g: FloatArray
    sigma_a_per_mm: FloatArray
    sigma_s_per_mm: FloatArray
    thickness_mm: float = math.inf

    def __post_init__(self) -> None:
        sigma_a = numbers("sigma_a_per_mm", self.sigma_a_per_mm, "sigma")
        is_list = isinstance(self.g, (list, tuple, np.ndarray))
        _store(self, eta=number("eta", self.eta), sigma_a_per_mm=sigma_a)
        _store(self, g=numbers("g", self.g if is_list else [number("g", self.g)] * sigma_a.size))
        _store(self, sigma_s_per_mm=numbers("sigma_s_per_mm", self.sigma_s_per_mm, "sigma"))
        _store(self, thickness_mm=number("thickness_mm", self.thickness_mm))
        check_lengths(self)
        scatters = self.g < 1
        _store(self, g=_read_only(np.where(scatters, self.g, 0.0)))
        _store(self, sigma_s_per_mm=_read_only(np.where(scatters, self.sigma_s_per_mm, 0.0)))
        check_clear_or_not(self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Layer) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict()))

    @property
    def sigma_t_per_mm(self) -> FloatArray:
        """Extinction sigma_a + sigma_s [1/mm], (C,)."""
        return self.sigma_a_per_mm + self.sigma_s_per_mm

    @property
    def albedo(self) -> FloatArray:
        """Single-scattering albedo sigma_s / sigma_t, (C,); 0 if the layer is clear."""
        sigma_t = self.sigma_t_per_mm
        return np.divide(
            self.sigma_s_per_mm, sigma_t, out=np.zeros_like(sigma_t), where=sigma_t > 0
        )

    @property
    def is_clear(self) -> bool:
        """Whether no channel is absorbed or scattered, as in glass."""
        return not self.sigma_t_per_mm.any()

    @property
    def reduced_sigma_s_per_mm(self) -> FloatArray:
        """Reduced scattering sigma_s' = (1 - g) sigma_s [1/mm], (C,)."""
        return (1 - self.g) * self.sigma_s_per_mm

    @property
    def reduced_sigma_t_per_mm(self) -> FloatArray:
        """Reduced extinction sigma_a + (1 - g) sigma_s [1/mm], (C,)."""
        return self.sigma_a_per_mm + self.reduced_sigma_s_per_mm

    @property
    def mean_free_path_mm(self) -> FloatArray:
        """Transport mean free path 1 / (sigma_a + (1 - g) sigma_s) [mm], (C,); inf if clear."""
        sigma_t = self.reduced_sigma_t_per_mm
        return np.divide(1.0, sigma_t, out=np.full_like(sigma_t, math.inf), where=sigma_t > 0)

    def to_dict(self) -> dict[str, Any]:
        """Return the layer as JSON values; an infinite thickness is None."""
        return {
            "eta": self.eta,
            "g": self.g.tolist(),
            "sigma_a_per_mm": self.sigma_a_per_mm.tolist(),
            "sigma_s_per_mm": self.sigma_s_per_mm.tolist(),
            "thickness_mm": self.thickness_mm if math.isfinite(self.thickness_mm) else None,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """A stack of layers under one name.

    Parameters
    ----------
    name : str
        Becomes part of file names: letters, digits and ``._+-``, a letter or digit first.
    channels : tuple of str
        1 to 64 distinct names, in the order of the coefficients.
    layers : tuple of Layer
        From the top down; only the last may be semi-infinite, and it must not be clear then.
    source : str
        Origin of the coefficients, for people; not part of ``sha256``.
    eta_above, eta_below : float
        Refractive indices of the media above the first and below the last layer.

    Raises
    ------
    MaterialError
        The layers do not fit the channels or one another, or a name is invalid.
    """

    name: str
    channels: tuple[str, ...]
    layers: tuple[Layer, ...]
    source: str = ""
    eta_above: float = 1.0
    eta_below: float = 1.0

    def __post_init__(self) -> None:
        check_texts(self.name, self.source)
        check_names(self.channels)
        check_layers(self.layers, Layer)
        _store(self, channels=tuple(self.channels), layers=tuple(self.layers))
        for key in ("eta_above", "eta_below"):
            _store(self, **{key: number(key, getattr(self, key), "eta")})
        check_stack(self.layers, self.channels, self.eta_below)

    def __repr__(self) -> str:
        if len(self.layers) > 1:
            thick = ", ".join(f"{each.thickness_mm:.3g}" for each in self.layers[:4])
            what = f"{len(self.layers)} layers of {thick}{', ...' if len(self.layers) > 4 else ''}"
        else:
            paths = by_channel(self.channels, self.layers[0].mean_free_path_mm.tolist(), ".3g")
            bottom = (
                "" if self.is_semi_infinite else f" {self.layers[0].thickness_mm:.3g} mm thick,"
            )
            what = f"eta {self.layers[0].eta:g},{bottom} transport mean free path {paths}"
        return f"<Material {of_material(self.name)}: {what} mm>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Material) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(self.sha256)

    @property
    def n_channels(self) -> int:
        """Number of channels C."""
        return len(self.channels)

    @property
    def is_semi_infinite(self) -> bool:
        """Whether this is one homogeneous layer without a bottom."""
        return len(self.layers) == 1 and math.isinf(self.layers[0].thickness_mm)

    @property
    def first_scattering_layer(self) -> int:
        """Number of clear layers on top; the walk starts below them."""
        return next(k for k, layer in enumerate(self.layers) if not layer.is_clear)

    @property
    def specular_reflectance(self) -> float:
        """Fresnel reflectance at normal incidence of all interfaces above the first turbid layer.

        ((n1 - n0) / (n1 + n0))^2 for one; clear layers on top add theirs, including multiple
        reflections: R = R1 + (1 - R1)^2 R2 / (1 - R1 R2), as MCML has it for one such layer (Wang,
        Jacques, Zheng 1995).
        """
        total = 0.0
        above = self.eta_above
        for layer in self.layers[: self.first_scattering_layer + 1]:
            one = normal_reflectance(layer.eta, above)
            total += (1.0 - total) ** 2 * one / (1.0 - total * one)
            above = layer.eta
        return total

    @property
    def sha256(self) -> str:
        """Fingerprint of name, channels, indices and coefficients, in any notation."""
        content = self.to_dict()
        del content["source"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Return the material as JSON values, for ``from_dict``."""
        return {
            "name": self.name,
            "source": self.source,
            "channels": list(self.channels),
            "eta_above": self.eta_above,
            "eta_below": self.eta_below,
            "layers": [layer.to_dict() for layer in self.layers],
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> "Material":
        """Rebuild a material from the result of ``to_dict``.

        Raises
        ------
        MaterialError
            ``content`` is not of that form, or its values fail the checks.
        """
        try:
            layers = tuple(_layer_from_dict(layer) for layer in content["layers"])
            return cls(**{**content, "layers": layers})
        except (KeyError, IndexError, TypeError) as error:
            raise MaterialError(
                f"a material's record is damaged ({printable(str(error))}); make a new one."
            ) from None

    def to_toml(self) -> str:
        """Return the material's TOML; ``parse_material`` reads back an equal material."""
        head: dict[str, Any] = {"name": self.name, "source": self.source}
        head["channels"] = self.channels
        for key in ("eta_above", "eta_below"):
            if getattr(self, key) != 1.0:
                head[key] = getattr(self, key)
        if any((layer.reduced_sigma_t_per_mm > DENSE_PER_MM).any() for layer in self.layers):
            head["dense"] = True
        return write_toml(head, [_layer_table(layer) for layer in self.layers])


def load_material(name_or_path: str | Path) -> Material:
    """Load a material that ships with sssfit, a TOML file, or standard input.

    Parameters
    ----------
    name_or_path : str or Path
        A shipped name (see ``material_names``); a path, recognised by ``.toml``, a separator, or an
        existing file; or ``-`` for standard input.

    Raises
    ------
    MaterialError
        The material is unknown, or its file cannot be read or is invalid.

    Examples
    --------
    >>> load_material("skin1").layers[0].sigma_s_per_mm.tolist()
    [0.74, 0.88, 1.01]
    """
    wanted = str(name_or_path)
    if wanted == "-":
        if sys.stdin is None:
            raise MaterialError("stdin is closed; name a material or a file instead of -.")
        return read_material(sys.stdin.buffer, "stdin")
    if not isinstance(name_or_path, Path) and wanted in shipped_names():
        folder = "layered/" if wanted in material_names(layered=True) else ""
        shipped = resources.files("sssfit.materials") / f"{folder}{wanted}.toml"
        found = parse_material(shipped.read_text("utf-8"), f"{wanted}.toml")
        if found.name != wanted:
            raise MaterialError(
                f"{wanted}.toml: name = {shown(found.name)}; expected that of its file, {wanted!r}."
            )
        return found
    if isinstance(name_or_path, Path) or is_path(wanted):
        return read_material(Path(wanted), wanted)
    raise MaterialError(
        f"there is no material {shown(wanted)}; {did_you_mean(wanted, shipped_names())}"
        "`material_names()` lists them, and your own file ends in .toml."
    )


def read_material(source: Path | BinaryIO, origin: str) -> Material:
    """Read a material's TOML from a path or a binary stream; errors are those of `parse_material`.

    Messages call it ``origin``.
    """
    with located(f"{printable(origin)}: "):
        text = read_text(source)
    if isinstance(source, Path):
        check_kind(source, text.content)
    with text.hinting(MaterialError) as content:
        return parse_material(content, origin)


# Materials of "Separable Subsurface Scattering", supplementary material G: Jensen et al. 2001.
_PAPER = (
    *("apple", "chicken1", "chicken2", "cream", "ketchup", "marble", "potato", "skimmilk"),
    *("skin1", "skin2", "wholemilk"),
)


def material_names(*, paper: bool = False, layered: bool = False) -> tuple[str, ...]:
    """Return the names of the half spaces that ship with sssfit, sorted.

    ``paper`` selects those in the supplement of "Separable Subsurface Scattering", ``layered`` the
    materials of several layers and the slabs in their place.
    """
    for word, value in (("paper", paper), ("layered", layered)):
        true_or_false(word, value, MaterialError)
    if paper:
        return _PAPER
    return _names_in("layered" if layered else ".")


@cache
def _names_in(folder: str) -> tuple[str, ...]:
    files = (resources.files("sssfit.materials") / folder).iterdir()
    return tuple(sorted(f.name[:-5] for f in files if f.name.endswith(".toml")))


def shipped_names() -> tuple[str, ...]:
    """Return the names of all materials that ship with sssfit: half spaces, then layered ones."""
    return material_names() + material_names(layered=True)


def parse_material(text: str, origin: str) -> Material:
    """Read a material from TOML text.

    Parameters
    ----------
    text : str
        The TOML.
    origin : str
        Its file, which begins every message; the stem of the file is the default name.

    Raises
    ------
    MaterialError
        The TOML is invalid; the one-line message has the origin, the key, its value, what was
        expected and what to do.
    """
    with located(f"{printable(origin)}: "):
        if not isinstance(text, str):
            raise MaterialError(f"{shown(text)} is not a text; expected the TOML of a material.")
        head, tables = read_tables(text)
        dense = head.pop("dense", False)
        layers = tuple(_layer_from_table(table, where, dense=dense) for where, table in tables)
        head.setdefault("name", Path(origin).stem)
        if "channels" not in head:
            head["channels"] = default_channels(layers[0].g.size)
        return Material(layers=layers, **head)


def _layer_from_table(table: Mapping[str, Any], where: str, *, dense: bool) -> Layer:
    """Build a layer of a file."""
    with located(where):
        layer = Layer(**table)
        if not dense:
            check_not_per_cm(layer)
        return layer


def _layer_from_dict(content: Mapping[str, Any]) -> Layer:
    thickness = content["thickness_mm"]
    return Layer(**{**content, "thickness_mm": math.inf if thickness is None else thickness})


def _layer_table(layer: Layer) -> dict[str, Any]:
    """Return a layer as written to a file: no infinite thickness, one g if all are equal."""
    table = {key: value for key, value in layer.to_dict().items() if value is not None}
    if len(set(table["g"])) == 1:
        table["g"] = table["g"][0]
    return table


def _read_only(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array


def _store(record: object, **values: Any) -> None:
    """Set fields of a frozen record during its construction."""
    for key, value in values.items():
        object.__setattr__(record, key, value)
