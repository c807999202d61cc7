"""Samples over error: adaptive samplers at several targets, and what control variates save.

At the same target a sampler that takes changes of light for noise has many more samples, and a
smaller error with them. At the same error the saving is what is left of that.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.errors import ArgumentError
from sssfit.messages import shown, table
from sssfit.methods import RENDERERS
from sssfit.motion.run import FRAMES, moving_light
from sssfit.profile import Profile
from sssfit.scene.record import Scene

TARGETS = (3e-4, 6e-4, 1.2e-3, 2.4e-3, 4.8e-3, 9.6e-3)
ADAPTIVE = ("without", "variates", "ahead")
_PLACES = 25  # errors at which curves are compared


@dataclass(frozen=True, slots=True, eq=False)
class SampleCurves:
    """Samples and errors of samplers over targets.

    Parameters
    ----------
    scene, light : str
    targets : array (T,)
        Ascending.
    samples, rmse : mapping of str to array (T,)
        By the renderer's name.
    fixed_rmse : float
        Error of one fixed sample a pixel; that of n has it over sqrt(n).
    """

    scene: str
    light: str
    targets: FloatArray
    samples: Mapping[str, FloatArray]
    rmse: Mapping[str, FloatArray]
    fixed_rmse: float

    def samples_at(self, name: str, rmse: FloatArray) -> FloatArray:
        """Return the samples a pixel that an error takes, NaN beyond the curve."""
        if name == "fixed":
            return (self.fixed_rmse / rmse) ** 2
        order = np.argsort(self.rmse[name])
        x, y = np.log(self.rmse[name][order]), np.log(self.samples[name][order])
        return np.exp(np.interp(np.log(rmse), x, y, left=np.nan, right=np.nan))

    def savings(self, name: str, against: str = "without") -> tuple[FloatArray, FloatArray]:
        """Return errors (N,) that both samplers have, and the share of samples saved at each."""
        of = [self.rmse[each] for each in (name, against) if each != "fixed"]
        low, high = max(each.min() for each in of), min(each.max() for each in of)
        errors = np.geomspace(low, high, _PLACES) if low < high else np.empty(0)
        # The ends are a curve's own, to rounding.
        errors = np.clip(errors, low, high)
        saved = 1.0 - self.samples_at(name, errors) / self.samples_at(against, errors)
        return errors, saved

    def to_dict(self) -> dict[str, Any]:
        """Return the figures for JSON."""
        rows = {
            name: {"samples": self.samples[name], "rmse": self.rmse[name]} for name in self.samples
        }
        return plain(
            {
                "irradiance": self.scene,
                "light": self.light,
                "targets": self.targets,
                "fixed_rmse": self.fixed_rmse,
                **rows,
            }
        )

    def text(self) -> str:
        """Return a row a target: samples and error of every sampler."""
        heads = ["target variance"]
        for name in self.samples:
            heads += [f"{RENDERERS[name].summary}: samples", "rmse"]
        rows = [
            [
                f"{target:g}",
                *(
                    f"{each:.4g}"
                    for name in self.samples
                    for each in (self.samples[name][k], self.rmse[name][k])
                ),
            ]
            for k, target in enumerate(self.targets)
        ]
        return table(heads, rows)


def sample_curves(
    profile: Profile,
    scene: Scene,
    *,
    light: str = "strobe",
    length: int = FRAMES,
    targets: Sequence[float] = TARGETS,
    ways: Collection[str] = ADAPTIVE,
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> SampleCurves:
    """Run adaptive samplers at several targets.

    Parameters
    ----------
    profile, scene, light, length, seed, threads
        As `moving_light`.
    targets : sequence of float
        Two or more target variances.
    ways : collection of str
        Samplers among "without", "variates" and "ahead".
    progress : callable, optional
        Told (done, of how many, the next target).

    Raises
    ------
    ArgumentError, RenderError
        As `moving_light`; or there are fewer than two targets.
    """
    ordered = sorted(set(targets))
    if len(ordered) < 2:
        raise ArgumentError(f"targets = {shown(list(targets))}; expected two different ones.")
    names = [each for each in ADAPTIVE if each in ways or each == "variates"]
    given: dict[str, Any] = {"light": light, "length": length, "seed": seed, "threads": threads}
    runs = []
    for done, target in enumerate(ordered):
        if progress is not None:
            progress(done, len(ordered), f"target {target:g}")
        own = [*names, "fixed"] if done == 0 else names
        runs.append(moving_light(profile, scene, target_variance=target, ways=own, **given))
    fixed = runs[0].track("fixed")
    return SampleCurves(
        scene=scene.name,
        light=light,
        targets=np.array(ordered),
        samples={n: np.array([run.track(n).mean_fetches for run in runs]) for n in names},
        rmse={n: np.array([run.track(n).rmse for run in runs]) for n in names},
        fixed_rmse=fixed.rmse * float(np.sqrt(fixed.mean_fetches)),
    )
