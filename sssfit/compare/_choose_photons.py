"""How few photons would have done: walks of growing length, fitted as the choice was."""

import time
import warnings
from dataclasses import dataclass

from sssfit.compare._all_light import radius_of
from sssfit.compare._choose_options import Option
from sssfit.compare._choose_views import Views
from sssfit.errors import FitError, SssfitWarning
from sssfit.grid import RadialGrid
from sssfit.material import Material
from sssfit.simulate import simulate_montecarlo

COUNTS = (10_000, 100_000, 1_000_000, 10_000_000)


@dataclass(frozen=True, slots=True)
class PhotonNeed:
    """Photons of a walk whose profile, fitted in the same way, stays within the tolerance.

    Parameters
    ----------
    photons : int, optional
        The fewest of ``COUNTS``; None where none would do.
    counts : tuple of int
        What was tried, up to that.
    errors : tuple of float
        Of the worst view by each, in the figure the tolerance is of; inf where the profile cannot
        be fitted.
    seconds : tuple of float [s]
        That each took, compilation included.
    truth_method : str
        How the profile that the choice was made on was found.
    truth_seconds : float [s]
        That it took.
    """

    photons: int | None
    counts: tuple[int, ...]
    errors: tuple[float, ...]
    seconds: tuple[float, ...]
    truth_method: str
    truth_seconds: float


def photons_needed(
    material: Material | None, option: Option, views: Views, seed: int, truth_seconds: float
) -> PhotonNeed | None:
    """Trace 1e4 photons, ten times as many, ..., until the option is within the tolerance.

    None without a material to walk through.
    """
    if material is None:
        return None
    walked = views.profile.photons
    if walked is not None:
        # The truth is itself a walk: of the same seed, a shorter one would be a part of it.
        seed ^= 1
    errors: list[float] = []
    seconds: list[float] = []
    enough = walked
    counts = [each for each in COUNTS if walked is None or each < walked]
    for photons in counts:
        begun = time.perf_counter()
        errors.append(_error(material, option, views, photons, seed))
        seconds.append(time.perf_counter() - begun)
        if errors[-1] <= views.tolerance:
            enough = photons
            break
    method = str(views.profile.meta.get("method"))
    return PhotonNeed(
        enough, tuple(counts[: len(errors)]), tuple(errors), tuple(seconds), method, truth_seconds
    )


def _error(material: Material, option: Option, views: Views, photons: int, seed: int) -> float:
    """Return the error of the worst view; what would be warned of is in it."""
    truth = views.profile
    radius_mm = radius_of(RadialGrid(float(truth.r_edges_mm[1]), truth.n_annuli))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        walk = simulate_montecarlo(
            material, photons=photons, seed=seed, radius_mm=radius_mm, threads=views.threads
        )
        try:
            return views.score_of_option(option, walk, wider=1.0).error
        except FitError:  # a dark channel that no photon came back in
            return float("inf")
