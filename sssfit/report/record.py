"""What a report holds: pictures, kernels with their exports, the comparison, charts' records."""

import dataclasses
from typing import Any

from sssfit import __version__
from sssfit.compare.budget import Budget
from sssfit.compare.comparison import Comparison
from sssfit.compare.convergence import Convergence
from sssfit.compare.models import ModelComparison
from sssfit.compare.spectrum import Spectrum
from sssfit.messages import counted
from sssfit.profile import Profile
from sssfit.profile.pixels import flat_annuli
from sssfit.render import render
from sssfit.report.kernels import ShownKernel
from sssfit.report.pack import packed_numbers, packed_picture
from sssfit.report.pictures import Shown

ERROR, COST = "delta-e", "fetches"
# Of the pictures that a page without WebGL2 has: so that a page with a noisy picture of a user's
# own, .8 MB, stays below 5 MB.
_DRAWN_CHARACTERS = 500_000


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Report:
    """All that a page shows of a material.

    Parameters
    ----------
    name : str
        The page's title: the material's name, or that of the profile's file.
    profile : Profile
        What truths and kernels are made from.
    pictures : tuple of Shown
    kernels : tuple of ShownKernel
        Every kernel of the comparison, in its order.
    comparison : Comparison
        On the picture that the page opens with, and on disk and edge.
    spectrum : Spectrum
    models : ModelComparison, optional
    budgets : tuple of Budget
    convergence : Convergence, optional
        None of these for a profile, or for a material that they do not cover.
    commands : tuple of str
        The command lines that make the figures again.
    notes : tuple of str
        What was told while it was made: what was left out, or scaled down.
    """

    name: str
    profile: Profile
    pictures: tuple[Shown, ...]
    kernels: tuple[ShownKernel, ...]
    comparison: Comparison
    spectrum: Spectrum
    models: ModelComparison | None
    budgets: tuple[Budget, ...]
    convergence: Convergence | None
    commands: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def front(self) -> list[str]:
        """Labels of the kernels that no other beats on the first picture, cheapest first."""
        first = self.comparison.pictures[0].name
        return [row.label for row in self.comparison.front(first, ERROR, COST)]

    def to_dict(self) -> dict[str, Any]:
        """Return what the page's scripts read, all of it JSON."""
        return {
            "name": self.name,
            "front": self.front,
            "profile": self._annuli(),
            "pictures": [each.to_dict() for each in self.pictures],
            "kernels": [each.to_dict() for each in self.kernels],
            "drawn": self._drawn(),
            "rows": self.comparison.to_dict()["rows"],
        }

    def _annuli(self) -> dict[str, Any]:
        """Return the flat annuli of the profile, from which a page computes other truths."""
        edges, densities = flat_annuli(self.profile.r_edges_mm, self.profile.annulus_energy)
        return {
            "radii": packed_numbers(edges[1:]),
            "densities": packed_numbers(densities),
            "reflectance": self.profile.diffuse_reflectance.tolist(),
        }

    def _drawn(self) -> dict[str, Any]:
        """Return the first picture by the best kernels, for a page without WebGL2."""
        by_label = {each.label: each.taps for each in self.kernels}
        first = self.pictures[0].reference
        found: dict[str, Any] = {}
        left = _DRAWN_CHARACTERS
        for label in reversed(self.front):
            made = packed_picture(render(first.scene, by_label[label], border=first.border))
            left -= len(made["data"])
            if found and left < 0:
                break
            found[label] = made
        return dict(reversed(found.items()))

    def text(self) -> str:
        """Return what ``sssfit report`` prints."""
        kernels = counted(len(self.kernels), "kernel")
        pictures = counted(len(self.pictures), "picture")
        return f"{kernels} on {pictures}; on the Pareto front: {', '.join(self.front)}"

    def figures(self) -> dict[str, Any]:
        """Return the figures that ``sssfit report --json`` prints."""
        return {
            "name": self.name,
            "kernels": [each.label for each in self.kernels],
            "pictures": [each.key for each in self.pictures],
            "front": self.front,
        }

    def provenance(self) -> list[tuple[str, str]]:
        """Return names and values of what the figures depend on."""
        meta = self.profile.meta
        found = [
            ("sssfit", __version__),
            ("profile", str(meta.get("method") or "unknown")),
            ("sha256 of the profile", self.profile.sha256),
            ("sha256 of the material", str(meta.get("material_sha256") or "unknown")),
            ("photons of the profile", str(meta.get("photons") or "none, not sampled")),
            ("seed of the profile", str(meta.get("seed") if meta.get("photons") else "none")),
            ("pixel of the kernels", f"{self.comparison.mm_per_pixel:g} mm"),
            ("threads of the timings", str(self.comparison.threads)),
        ]
        if self.models is not None:
            walk = self.models.walk.profile
            words = f"{walk.photons:,} photons, seed {walk.meta.get('seed')}"
            found.append(("walk of models and budget", words))
        return [*found, *(("note", each) for each in self.notes)]
