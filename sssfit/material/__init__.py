"""Materials: absorption and scattering per channel and layer, from TOML or made in Python."""

from sssfit.material.record import (
    Layer,
    Material,
    load_material,
    material_names,
    parse_material,
    read_material,
    shipped_names,
)

__all__ = [
    "Layer",
    "Material",
    "load_material",
    "material_names",
    "parse_material",
    "read_material",
    "shipped_names",
]
