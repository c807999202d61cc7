"""What the solver for layers is asked: the slabs of one channel between two clear media."""

import math
from dataclasses import dataclass
from functools import cached_property

from sssfit.material import Material

_SEEN_THROUGH = 14.0  # optical depth: exp(-14) is 8e-7


@dataclass(frozen=True, slots=True)
class Slab:
    """One layer in one channel.

    Coefficients are in 1/mm; ``thickness`` is in mm and infinite for a layer without a bottom.
    """

    sigma_a: float
    sigma_s: float
    g: float
    eta: float
    thickness: float = math.inf

    @property
    def scatters(self) -> bool:
        """Whether light changes its direction inside."""
        return self.sigma_s > 0.0

    @property
    def is_clear(self) -> bool:
        """Whether light passes without loss."""
        return self.sigma_a + self.sigma_s == 0.0

    @property
    def sigma_t(self) -> float:
        """Extinction sigma_a + sigma_s [1/mm]."""
        return self.sigma_a + self.sigma_s

    @property
    def reduced_sigma_t(self) -> float:
        """Reduced extinction sigma_a + (1 - g) sigma_s [1/mm]."""
        return self.sigma_a + (1.0 - self.g) * self.sigma_s

    @property
    def diffuse_rate(self) -> float:
        """Effective attenuation of diffusion, sqrt(3 sigma_a sigma_t') [1/mm]."""
        return math.sqrt(3.0 * self.sigma_a * self.reduced_sigma_t)


@dataclass(frozen=True)
class SlabStack:
    """Slabs from the top down, and the refractive indices above and below them."""

    slabs: tuple[Slab, ...]
    eta_above: float = 1.0
    eta_below: float = 1.0

    @cached_property
    def scattering(self) -> tuple[Slab, ...]:
        """The slabs that scatter."""
        return tuple(each for each in self.slabs if each.scatters)

    @property
    def has_bottom(self) -> bool:
        """Whether light can leave below."""
        return math.isfinite(self.slabs[-1].thickness)

    @property
    def is_seen_through(self) -> bool:
        """Whether over a millionth of the light crosses all layers without being scattered."""
        depth = sum((each.sigma_a + each.sigma_s) * each.thickness for each in self.scattering)
        return self.has_bottom and depth < _SEEN_THROUGH

    @cached_property
    def indices(self) -> tuple[float, ...]:
        """The distinct indices that bound the panels of directions, ascending.

        None is above that of the densest slab: no light inside has a larger invariant.
        """
        etas = {each.eta for each in self.slabs}
        around = {self.eta_above} | ({self.eta_below} if self.has_bottom else set())
        # Indices closer than 1e-9 would make a panel of no width.
        distinct: list[float] = []
        for eta in sorted(etas | {each for each in around if each <= max(etas)}):
            if not distinct or eta - distinct[-1] > 1e-9:
                distinct.append(eta)
        return tuple(distinct)


def stacks_of(material: Material) -> list[SlabStack]:
    """Return the stack of each channel of a material."""
    return [
        SlabStack(
            tuple(
                Slab(
                    float(layer.sigma_a_per_mm[c]),
                    float(layer.sigma_s_per_mm[c]),
                    float(layer.g[c]),
                    layer.eta,
                    layer.thickness_mm,
                )
                for layer in material.layers
            ),
            material.eta_above,
            material.eta_below,
        )
        for c in range(material.n_channels)
    ]
