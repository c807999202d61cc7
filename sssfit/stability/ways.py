"""Methods with their settings, side by side in every stress that has room for them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sssfit.fit import fit_separable, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.kernel import Kernel
from sssfit.methods import FITS, TAPS
from sssfit.profile import Profile


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A method with its settings, as charts name it."""

    label: str
    method: str
    settings: Mapping[str, Any]
    taps: int | None = None

    @property
    def is_seeded(self) -> bool:
        """Whether the fit starts at random places."""
        return FITS[self.method].is_seeded

    @property
    def key(self) -> tuple[object, ...]:
        """What ways to the same kernel have in common; their labels may differ."""
        return self.method, tuple(sorted(self.settings.items())), self.taps

    def fit(self, profile: Profile, mm_per_pixel: float, **given: Any) -> Kernel:
        """Fit a profile.

        Raises
        ------
        SssfitError
            The fit is refused.
        """
        settings = {"mm_per_pixel": mm_per_pixel, **self.settings, **given}
        if self.method in TAPS:
            return fit_taps(profile, self.method, **settings).kernel
        kernel = fit_separable(profile, self.method, **settings).kernel
        return kernel if self.taps is None else on_taps(kernel, self.taps)


def cascade(fetches: int) -> Way:
    """Return the cascade of a budget."""
    return Way(f"cascade {fetches}", "cascade", {"fetches": fetches})


CASCADE = cascade(24)
# The cascade and the published methods, side by side in every stress that has room for them.
WAYS = (
    Way("pre-integrated", "preintegrated", {}),
    Way("artist", "artist", {}),
    Way("guided", "guided", {"k": 2.0}),
    Way("svd 1", "svd", {"rank": 1}),
    Way("svd 3", "svd", {"rank": 3}),
    Way("gaussians 4", "gaussians", {"terms": 4}),
    Way("gaussians 6", "gaussians", {"terms": 6}),
    CASCADE,
)
