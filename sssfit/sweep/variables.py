"""The arrays that a store may have, by name; `sssfit.sweep.layout` says which ones a plan's has."""

from dataclasses import dataclass

# Arrays with a value for each ring are a chunk a point; the others are a chunk for all points of
# the last axis: 14 chunks a point took 24 ms to write.
_OF_RINGS = ("r_mm", "channel")


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


ALWAYS = (
    Variable("annulus_energy", _OF_RINGS, "energy reflected in each ring"),
    Variable("annulus_energy_stderr", _OF_RINGS, "its standard error, or error estimate"),
    Variable("beyond_grid", ("channel",), "energy reflected beyond the last ring"),
    Variable("beyond_grid_stderr", ("channel",), "its standard error"),
    Variable("diffuse_reflectance", ("channel",), "energy reflected diffusely"),
    Variable("diffuse_reflectance_stderr", ("channel",), "its standard error"),
    Variable("specular_reflectance", (), "energy reflected at the surface"),
    Variable("unfinished", ("channel",), "energy of walks that reached the most collisions"),
)
ABSORBED = Variable("absorbed", ("layer", "channel"), "energy absorbed in each layer")
TRANSMITTED = (
    Variable("annulus_transmittance", _OF_RINGS, "energy transmitted in each ring"),
    Variable("annulus_transmittance_stderr", _OF_RINGS, "its standard error, or error estimate"),
    Variable("beyond_grid_transmittance", ("channel",), "energy transmitted beyond the last ring"),
    Variable("transmittance", ("channel",), "energy transmitted"),
    Variable("transmittance_stderr", ("channel",), "its standard error"),
)
SEED = Variable("seed", (), "random seed of the point's walk", "int64", None)
KERNEL = Variable("kernel", (), "JSON of the kernel that was fitted", "str", None)
# Not 0 once a point is finished; 64 bits of SHA-256 of what the point's arrays hold.
FINGERPRINT = Variable("fingerprint", (), "hash of a finished point, 0 before", "int64", None)
NAMES = frozenset(
    each.name for each in (*ALWAYS, ABSORBED, *TRANSMITTED, SEED, KERNEL, FINGERPRINT)
)
