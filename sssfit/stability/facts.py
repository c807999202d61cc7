"""What rules look at: a kernel, and the profile that it was fitted to."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sssfit.arrays import FloatArray
from sssfit.kernel import Kernel
from sssfit.profile import Profile
from sssfit.stability.noise_floor import noise_ratio


@dataclass(frozen=True, slots=True, eq=False)
class Facts:
    """What rules look at.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    profile : Profile, optional
        What it was fitted to, where it is known.
    """

    kernel: Kernel
    profile: Profile | None

    @property
    def settings(self) -> Mapping[str, Any]:
        """The settings of the fit."""
        settings: Mapping[str, Any] = self.kernel.meta.get("settings") or {}
        return settings

    @property
    def is_smoothed(self) -> bool:
        """Whether the fit took most of the noise out of the profile."""
        return bool(self.settings.get("smooth"))

    @property
    def noise(self) -> FloatArray | None:
        """`noise_ratio` of the profile on the kernel's pixels (C,); None where nothing is noisy."""
        if self.profile is None or self.profile.photons is None:
            return None
        return noise_ratio(self.profile, self.kernel.mm_per_pixel)
