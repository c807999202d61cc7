"""A table of taps, stage by stage: what each adds to the picture of one point of light.

``sssfit.chart`` draws the record.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, check_record, plain
from sssfit.errors import KernelError
from sssfit.kernel import Taps
from sssfit.profile import Profile
from sssfit.render.taps import reach_pixels, response

_MOST_PIXELS = 120  # from the middle outwards; a chart prints no more


@dataclass(frozen=True, slots=True, eq=False)
class TapsView:
    """The stages of a table of taps around one lit pixel, on 2 h + 1 pixels a side.

    Parameters
    ----------
    taps : Taps
    profile : Profile or None
        What it is compared with.
    stages : array (L+1, 2h+1, 2h+1, C)
        What the irradiance and each stage add to the picture; their sum is the kernel.
    truth : array (h+1, h+1, C), optional
        A quadrant of the profile's own kernel; None without a profile.
    """

    taps: Taps
    profile: Profile | None
    stages: FloatArray
    truth: FloatArray | None

    @property
    def half_pixels(self) -> int:
        """Pixels h on either side of the middle one."""
        return len(self.stages[0]) // 2

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels of the table."""
        return self.taps.channels

    def to_dict(self) -> dict[str, Any]:
        """Return the figures that ``sssfit chart --json`` prints."""
        return plain(
            {
                "material": self.taps.meta.get("material"),
                "structure": self.taps.structure,
                "channels": self.taps.channels,
                "fetches": self.taps.fetches,
                "passes": self.taps.passes,
                "energy": self.taps.energy,
                "stage_energy": self.taps.blend,
            }
        )


def view_taps(taps: Taps, profile: Profile | None = None) -> TapsView:
    """Compute what each stage makes of one lit pixel.

    Parameters
    ----------
    taps : Taps
    profile : Profile, optional
        The profile that it was fitted to.

    Raises
    ------
    KernelError
        The profile has other channels.
    """
    check_record("taps", taps, Taps, KernelError)
    check_record("profile", profile, Profile | None, KernelError)
    if profile is not None and profile.channels != taps.channels:
        raise KernelError(
            f"the table of taps has the channels {', '.join(taps.channels)} and the profile "
            f"{', '.join(profile.channels)}; give the profile that it was fitted to."
        )
    reach = reach_pixels(taps)
    half = min(reach, _MOST_PIXELS)
    kept = slice(reach - half, reach + half + 1)
    stages = np.stack([response(_only(taps, row))[kept, kept] for row in range(len(taps.blend))])
    truth = None if profile is None else profile.quadrant_kernel(taps.mm_per_pixel, half)
    return TapsView(taps, profile, stages, truth)


def _only(taps: Taps, row: int) -> Taps:
    """Return the table with one row of its blend."""
    blend = np.zeros_like(taps.blend)
    blend[row] = taps.blend[row]
    return dataclasses.replace(taps, blend=blend)
