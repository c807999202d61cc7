"""A contact sheet: what a screen shows of every kernel, beside what it gets wrong.

The rows are those of figure S.3 of Jimenez et al. 2015, "Separable Subsurface Scattering",
supplement, and the artist's fit to the line integral. ``sssfit.chart`` draws the record.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, plain
from sssfit.compare.candidates import MOST_TERMS, Candidate
from sssfit.compare.pictures import Panel, check_colours, make_panel, picture_error
from sssfit.compare.references import references
from sssfit.fit import Pitch, pitch_of, support_of
from sssfit.kernel import SeparableKernel
from sssfit.measure.cost import cost_of
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.profile import Profile
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene

SCENES = ("disk", "edge", "head")
PIXELS = 200  # 60 mm at that pitch: between the eyes and the mouth


@dataclass(frozen=True, slots=True, eq=False)
class SheetRow:
    """One way to render, on every scene.

    Parameters
    ----------
    label : str
    passes : int, optional
        One-dimensional passes of its kernel; None for input and truth.
    panels : tuple of Panel
        One a scene.
    """

    label: str
    passes: int | None
    panels: tuple[Panel, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return label, passes and the figures of the score, a value for each scene."""
        keys = (*COLOUR_FIGURES, "relative_l2")
        scores = {key: [getattr(each.score, key) for each in self.panels] for key in keys}
        return plain({"label": self.label, "passes": self.passes, **scores})


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """Kernels of one profile, on made pictures of one size.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel : float [mm]
    pixels : int
        Rows and columns of each picture.
    support_mm : float [mm]
        Half width of the kernels.
    scenes : tuple of str
    exposures : tuple of float
        Exposure of each scene: `auto_exposure` of its truth.
    rows : tuple of SheetRow
        Input first, truth last.
    production : mapping
        Near, far and weight of the row that is set by hand.
    """

    profile: Profile
    mm_per_pixel: float
    pixels: int
    support_mm: float
    scenes: tuple[str, ...]
    exposures: tuple[float, ...]
    rows: tuple[SheetRow, ...]
    production: Mapping[str, tuple[float, ...]]

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of the sheet as JSON has them, a row for each kernel."""
        return plain(
            {
                "material": self.profile.material_name,
                "mm_per_pixel": self.mm_per_pixel,
                "pixels": self.pixels,
                "support_mm": self.support_mm,
                "scenes": self.scenes,
                "exposures": self.exposures,
                "production": self.production,
                "rows": [each.to_dict() for each in self.rows],
            }
        )


def compute_sheet(
    profile: Profile,
    *,
    mm_per_pixel: Pitch | None = None,
    pixels: int = PIXELS,
    scenes: Sequence[str] = SCENES,
    most_terms: int = MOST_TERMS,
    threads: int | None = None,
) -> Sheet:
    """Render made pictures with every kernel of figure S.3, and with the true one.

    Parameters
    ----------
    profile : Profile
        Has 1 or 3 channels.
    mm_per_pixel : float or "profile", optional [mm]
        By default 0.3; see ``sssfit.fit.make_target``.
    pixels : int
        Rows and columns.
    scenes : sequence of str
        Names in ``sssfit.scene.made.MADE``; the edge is upright, as in the paper's figure.
    most_terms : int
        Most terms of Gaussians and SVD.
    threads : int, optional

    Raises
    ------
    FitError, RenderError
        Invalid pixels, profile or scenes.
    """
    check_colours("the profile", profile.n_channels)
    support = support_of(profile)
    pitch = pitch_of(profile, mm_per_pixel)
    panels = _PanelRenderer(profile, tuple(scenes), pitch, pixels, threads)
    line = Candidate("Artist-friendly, line fit", "artist", 1)
    fitted = line.fit_dense(profile, pitch, support).kernel
    production = production_look(fitted)
    rows = [panels.row("Input, times albedo", panels.inputs())]
    for candidate in _kernels(min(most_terms, fitted.pixels // 2 + 1), line, production):
        kernel = candidate.fit_dense(profile, pitch, support).kernel
        rows.append(panels.row(candidate.label, panels.rendered(kernel), cost_of(kernel).passes))
    rows.append(panels.row("True kernel", panels.truths))
    return Sheet(
        profile=profile,
        mm_per_pixel=pitch,
        pixels=pixels,
        support_mm=support,
        scenes=tuple(scenes),
        exposures=panels.exposures,
        rows=tuple(rows),
        production=production,
    )


def _kernels(
    most: int, line: Candidate, production: Mapping[str, tuple[float, ...]]
) -> Iterator[Candidate]:
    """Yield the separable kernels in the order of the paper's figure.

    The paper's close fit was made by eye: ours is the one nearest to look at.
    """
    for n in range(1, most + 1):
        yield Candidate(f"Gaussians, N = {n}", "gaussians", n, {"terms": n})
    for n in range(1, most + 1):
        yield Candidate(f"SVD, rank {n}", "svd", n, {"rank": n})
    yield line
    yield Candidate("Artist-friendly, close fit", "artist", 1, {"target": picture_error})
    yield Candidate("Artist-friendly, production", "artist", 1, production)
    for k in (0.0, 2.0):
        yield Candidate(f"Guided, k = {k:g}", "guided", 1, {"k": k})
    yield Candidate("Pre-integrated", "preintegrated", 1)


def production_look(line: SeparableKernel) -> dict[str, tuple[float, ...]]:
    """Return what stands for an artist's own settings: crisper near the beam, a wider glow.

    The paper gives no values. Here near is the fit's narrowest for all channels, so that detail
    keeps its colour, and far is twice the fit's variance; weights stay. Two digits, as typed.

    Parameters
    ----------
    line : SeparableKernel
        By `fit_artist`, from its line integral.

    Returns
    -------
    dict
        near_mm2, far_mm2 [mm^2] and weight, a value for each channel.
    """
    lit: dict[str, Any] = dict(line.parameters)
    usual = next(iter(lit.values()))  # for a channel without light, which no value changes
    each = [lit.get(name, usual) for name in line.channels]
    nearest = min(channel["near_mm2"] for channel in each)
    return {
        "near_mm2": tuple(_typed(nearest) for _ in each),
        "far_mm2": tuple(_typed(2.0 * channel["far_mm2"]) for channel in each),
        "weight": tuple(_typed(channel["weight"]) for channel in each),
    }


def _typed(value: float) -> float:
    """Round to two significant digits."""
    return float(f"{value:.2g}")


class _PanelRenderer:
    """Scenes with their truths, and the panels of pictures of them."""

    def __init__(
        self,
        profile: Profile,
        names: tuple[str, ...],
        mm_per_pixel: float,
        pixels: int,
        threads: int | None,
    ) -> None:
        self._albedo = profile.diffuse_reflectance
        self._threads = threads
        asked = [
            make_scene(name, height=pixels, width=pixels, mm_per_pixel=mm_per_pixel)
            for name in names
        ]
        self._outlines = [scene.mask for scene in asked]
        self._references = references(asked, profile, threads=threads)
        scenes = [each.scene for each in self._references]
        self._parts = [(_middle(s.height, pixels), _middle(s.width, pixels)) for s in scenes]
        self.truths = [each.truth for each in self._references]
        self.exposures = tuple(each.exposure for each in self._references)

    def inputs(self) -> list[FloatArray]:
        """Return what a surface without scattering, of the same albedo, would show."""
        return [each.scene.irradiance * self._albedo for each in self._references]

    def rendered(self, kernel: SeparableKernel) -> list[FloatArray]:
        """Return the pictures by a kernel."""
        return [
            np.asarray(
                render_separable(each.scene, kernel, border=each.border, threads=self._threads),
                dtype=np.float64,
            )
            for each in self._references
        ]

    def row(
        self, label: str, pictures: Sequence[FloatArray], passes: int | None = None
    ) -> SheetRow:
        """Compare a picture of each scene with its truth."""
        panels = [
            make_panel(
                picture,
                each.truth,
                exposure=each.exposure,
                mask=outline,
                counts=each.scene.mask,
                shown_part=part,
            )
            for picture, each, outline, part in zip(
                pictures, self._references, self._outlines, self._parts, strict=True
            )
        ]
        return SheetRow(label, passes, tuple(panels))


def _middle(size: int, pixels: int) -> slice:
    """Return the middle pixels of an enlarged picture: those that were asked for."""
    first = (size - pixels) // 2
    return slice(first, first + pixels)
