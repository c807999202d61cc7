"""Tables of taps: a kernel as a shader runs it, a few fetches a pass, several stages added up.

Stage l reads the picture of the stage before it (a cascade, ``chained``) or the irradiance E (the
terms of a separable kernel), and the kernel is the sum

    M = sum_{l=0..L} m_l E_l,    E_0 = E,    E_l = B_l E_{l-1}  or  E_l = B_l E,

with the blend m_l by channel, which adds up to the energy. Signs live in the blend. A stage's fetch
at a fractional offset is bilinear. Stages of level v work on pictures halved v times: a texel of
those is the mean of four, and their sum comes back by bilinear fetches.

A disk is one stage alone: single fetches on a spiral, which each pixel and frame turns by an angle
of its own (`sssfit.render.disk`).

``taps_json`` has the file format, ``sssfit/taps.schema.json`` its JSON Schema.
"""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, BinaryIO, Self

import numpy as np

from sssfit.arrays import (
    FloatArray,
    ReadOnly,
    check_label,
    check_names,
    check_provenance,
    json_object,
    number_array,
    plain,
)
from sssfit.errors import KernelError
from sssfit.files import write_atomically
from sssfit.kernel import taps_json
from sssfit.kernel.checks import MAX_MM, MIN_MM, MOST, checked_pitch
from sssfit.kernel.record import PROVENANCE, SeparableKernel
from sssfit.kernel.structure import (
    MOST_IN_PASS,
    MOST_LEVELS,
    MOST_ON_DISK,
    MOST_STAGES,
    Cost,
    Shape,
    cost_of_chain,
    cost_of_disk,
    cost_of_terms,
    directions,
    text_of,
)
from sssfit.kernel.taps_json import is_taps_file
from sssfit.messages import by_channel, counted, html_table, number, of_material, printable, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sssfit.profile import Profile

__all__ = ["Stage", "Taps", "is_taps_file"]

KINDS = ("pair", "star", "disk", "line")
_ERRORS = ("spectral", "energy")
# Fetches with one weight: a pair of passes and a line have the middle and mirrored pairs, a star
# the middle, four diagonal neighbours and four on the axes, a disk single fetches.
_COPIES = {"pair": 2.0, "star": 4.0, "disk": 1.0, "line": 2.0}
_MOST_OFFSETS = {"pair": MOST_IN_PASS, "disk": MOST_ON_DISK, "line": MOST_IN_PASS}
# Angles below which a stage is its own mirror image: the passes of a pair are perpendicular.
_TURNS = {"pair": 90.0, "line": 180.0}
_ROUNDING = 1e-9  # of sums that are computed in another order
# Of a texel of three channels, as stored.
BYTES = {
    "float32": 16,
    "half": 8,
    "half-truncated": 8,
    "r11g11b10": 4,
    "rgba8": 4,
    "srgb8": 4,
}
_IN_TEXEL = 3  # channels, beside coverage
_MOST_TEXELS = 1e7  # of a pass to one side: 240 MB of three channels


def textures_for(channels: int) -> int:
    """Return how many textures hold a picture: each has three channels, used or not."""
    return math.ceil(channels / _IN_TEXEL)


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Stage(ReadOnly):
    """One blur of a table of taps.

    Parameters
    ----------
    level : int
        How many times its picture is halved.
    kind : {"pair", "star", "disk", "line"}
        "pair" is a pass along x and the same pass along y; "star" one pass of nine fetches; "disk"
        one pass of single fetches on a golden-angle spiral; "line" one pass in one direction.
    offsets_mm : array (n,) [mm]
        For a pair or line rising, without the middle; for a star the distances (diagonal, axis),
        where the diagonal fetches lie at (+-o, +-o); for a disk the radii of its fetches, from the
        inside out.
    weights : array (n+1, C)
        The middle first; the middle and all fetches of its passes add up to 1. A disk whose middle
        row is 0 does not fetch the pixel itself.
    angle_degrees : float
        Angle of a pair's first pass, below 90, or of a line, below 180: from x to the right towards
        y down. 0 otherwise.
    """

    level: int
    kind: str
    offsets_mm: FloatArray
    weights: FloatArray
    angle_degrees: float = 0.0

    @classmethod
    def of_term(cls, offsets_mm: FloatArray, weights: FloatArray) -> tuple[Self, FloatArray]:
        """Return two passes with weights (n+1, C) that add up to 1, and what they added up to (C,).

        Where all are 0, because a channel does not have the term, its light stays where it is.
        """
        sums = weights[0] + 2.0 * weights[1:].sum(axis=0)
        empty = sums == 0.0
        shares = np.where(empty, np.eye(len(weights))[:, :1], weights / np.where(empty, 1.0, sums))
        return cls(0, "pair", offsets_mm, shares), sums

    @property
    def shape(self) -> Shape:
        """The stage without its numbers."""
        pairs = 1 if self.kind == "star" else len(self.offsets_mm)
        return Shape(self.kind, pairs, self.level, self.angle_degrees)

    @property
    def directions(self) -> tuple[tuple[float, float], ...]:
        """Unit vectors (down, right) of the passes of a pair or a line, in their order."""
        return directions(self.shape)

    @property
    def is_upright(self) -> bool:
        """Whether it is a pair of passes along the axes."""
        return self.shape.is_upright

    @property
    def copies(self) -> float:
        """Fetches that one weight beside the middle stands for, but for a disk's own middle."""
        return _COPIES[self.kind]

    @property
    def variance_mm2(self) -> FloatArray:
        """Variance along an axis, or of a line along itself (C,) [mm^2], from the offsets."""
        # Of a star's fetches all four diagonal ones move along an axis, and two of the others; a
        # disk's, over all its turns, by r^2 / 2.
        each = {"pair": [2.0], "line": [2.0], "star": [4.0, 2.0], "disk": [0.5]}
        moment: FloatArray = (np.array(each[self.kind]) * self.offsets_mm**2) @ self.weights[1:]
        return moment

    def line(self, offsets_mm: FloatArray, weights: FloatArray, mm_per_texel: float) -> FloatArray:
        """Return weights on texels (2m+1, C) of mirrored bilinear fetches along a line.

        A fetch at offset o between texels i and i + 1 gives them 1 - f and f, f = o - i.

        Parameters
        ----------
        offsets_mm : array (n,) [mm]
        weights : array (n, C)
        mm_per_texel : float [mm]
            Size of a texel of the stage's own picture.

        Raises
        ------
        KernelError
            There are no offsets, the arrays differ in length or are not finite, an offset is below
            0, or one reaches more than 10 million texels.
        """
        texels, weights = _on_texels(offsets_mm, weights, mm_per_texel)
        whole = np.floor(texels)
        part = (texels - whole)[:, None]
        reach = int(whole.max()) + 1
        half = np.zeros((reach + 1, weights.shape[1]))
        np.add.at(half, whole.astype(np.intp), weights * (1.0 - part))
        np.add.at(half, whole.astype(np.intp) + 1, weights * part)
        half[0] *= 2.0  # both fetches of a pair touch the middle texel
        return np.concatenate((half[:0:-1], half))

    def pass_weights(self, mm_per_texel: float) -> FloatArray:
        """Return the pass of a pair on texels of its picture, (2m+1, C).

        Parameters
        ----------
        mm_per_texel : float [mm]

        Raises
        ------
        KernelError
            As of `line`.
        """
        line = self.line(self.offsets_mm, self.weights[1:], mm_per_texel)
        line[len(line) // 2] += self.weights[0]
        return line


def _on_texels(
    offsets_mm: object, weights: object, mm_per_texel: object
) -> tuple[FloatArray, FloatArray]:
    """Return offsets in texels (n,) and weights (n, C) of `Stage.line`, or raise KernelError."""
    pitch_mm = number_array("mm_per_texel", mm_per_texel, KernelError)
    if pitch_mm.shape != () or not 0.0 < pitch_mm < math.inf:
        raise KernelError(f"mm_per_texel = {shown(mm_per_texel)}; expected a length above 0.")
    offsets = number_array("offsets_mm", offsets_mm, KernelError)
    shares = number_array("weights", weights, KernelError)
    if offsets.ndim != 1 or shares.ndim != 2 or len(offsets) != len(shares) or not shares.size:
        raise KernelError(
            f"offsets_mm has shape {offsets.shape} and weights {shares.shape}; expected (n,) and "
            "(n, channels)."
        )
    if not (np.isfinite(shares).all() and (offsets >= 0.0).all()):
        raise KernelError("offsets_mm and weights must be finite, and offsets not below 0.")
    if not offsets.max() <= _MOST_TEXELS * pitch_mm:
        raise KernelError(
            f"offsets_mm reaches {offsets.max():.3g} mm with texels of {pitch_mm:.3g} mm; expected "
            f"at most {_MOST_TEXELS:g} texels."
        )
    return offsets / pitch_mm, shares


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Taps(ReadOnly):
    """A kernel as a shader runs it: stages of few fetches and how their pictures are added up.

    L stages, C channels, the channel axis last. Arrays are stored as read-only float64.

    Parameters
    ----------
    method : str
        The fit that made it, by its name on the command line.
    mm_per_pixel : float [mm]
        Pixel size that it was made for; offsets are in mm and serve others too.
    channels : tuple of str
        Names of the C channels.
    chained : bool
        Whether a stage reads the picture of the stage before it, or the irradiance.
    stages : tuple of Stage
        In the order of their passes; levels never fall, and rise by one.
    blend : array (L+1, C)
        Share of the irradiance (row 0) and of each stage's picture; adds up to the energy.
    errors : mapping
        Arrays (C,), NaN if unknown: ``spectral``, the norm of the difference from the profile's
        kernel under the spectrum that was fitted, as a share of its norm, and ``energy``, relative
        to the diffuse reflectance.
    meta : mapping
        Provenance as of `SeparableKernel`.

    Raises
    ------
    KernelError
        A field has the wrong shape, is not a number, or contradicts another.
    """

    method: str
    mm_per_pixel: float
    channels: tuple[str, ...]
    chained: bool
    stages: tuple[Stage, ...]
    blend: FloatArray
    errors: Mapping[str, FloatArray]
    meta: Mapping[str, Any]

    def __post_init__(self) -> None:
        for name, value in _checked(self).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        errors = by_channel(self.channels, self.errors["spectral"].tolist(), ".3g%|unknown")
        return f"<{self._in_words()}: error {errors}>"

    def _repr_html_(self) -> str:
        columns = (
            (self.energy, ".6f"),
            (self.errors["spectral"], ".3g%|unknown"),
            (self.errors["energy"], "+.2g%|unknown"),
        )
        rows = [
            [name, *(number(values[c], form) for values, form in columns)]
            for c, name in enumerate(self.channels)
        ]
        return html_table(
            self._in_words(), ["channel", "energy", "spectral error", "energy error"], rows
        )

    def _in_words(self) -> str:
        """Return one line with material, method, stages and cost."""
        return (
            f"Taps of {of_material(self.meta.get('material'))} by {self.method}, "
            f"{self.structure}, {counted(self.fetches, 'fetch', '.4g')} of {self.mm_per_pixel:.4g} "
            "mm pixels"
        )

    def plot(self, profile: "Profile | None" = None) -> "Figure":
        """Draw the table stage by stage, for a notebook; see `sssfit.chart.taps.taps_figure`.

        Parameters
        ----------
        profile : Profile, optional
            The profile that it was fitted to, drawn beside it.

        Returns
        -------
        matplotlib.figure.Figure
            `sssfit.chart.page.save_figure` writes it.

        Raises
        ------
        KernelError
            The profile has other channels.
        """
        from sssfit.chart.taps import taps_figure
        from sssfit.compare.taps_view import view_taps

        return taps_figure(view_taps(self, profile))

    @property
    def structure(self) -> str:
        """The stages as text, such as 1-1|2-2|2-2."""
        return text_of([each.shape for each in self.stages])

    @property
    def energy(self) -> FloatArray:
        """Sum of the kernel (C,)."""
        total: FloatArray = self.blend.sum(axis=0)
        return total

    @property
    def cost(self) -> Cost:
        """Fetches, passes and pictures moved per pixel."""
        rows = [bool(row.any()) for row in self.blend]
        if self.is_disk:
            middle = rows[0] or bool(self.stages[0].weights[0].any())
            return cost_of_disk(len(self.stages[0].offsets_mm) + middle)
        if self.chained:
            return cost_of_chain([each.shape for each in self.stages], rows)
        offsets = [tuple(each.offsets_mm.tolist()) for each in self.stages]
        return cost_of_terms(offsets, shows_irradiance=rows[0])

    @property
    def fetches(self) -> float:
        """Texture fetches a pixel."""
        return self.cost.fetches

    @property
    def passes(self) -> int:
        """Passes of the stages: two of a pair, one of a star or a disk."""
        return self.cost.passes

    def bytes_per_pixel(self, texel: str = "half") -> float:
        """Return bytes read and written a pixel, each picture once a pass; see `textures_for`.

        Parameters
        ----------
        texel : str
            Format of the pictures between the passes, one of ``BYTES``.

        Raises
        ------
        KernelError
            The format is another.
        """
        if not isinstance(texel, str) or texel not in BYTES:
            raise KernelError(f"texel = {shown(texel)}; expected {', '.join(BYTES)}.")
        return BYTES[texel] * self.cost.pictures * textures_for(len(self.channels))

    @property
    def has_negative_weights(self) -> bool:
        """Whether a fetch of any pass has a weight below 0; the blend's signs do not count."""
        return any(bool((each.weights < 0.0).any()) for each in self.stages)

    @property
    def is_disk(self) -> bool:
        """Whether it is single fetches on a disk, turned for each pixel and frame."""
        return self.stages[0].kind == "disk"

    @property
    def is_separable(self) -> bool:
        """Whether `separable_kernel` exists: all stages are upright pairs on the full picture."""
        return all(each.is_upright and each.level == 0 for each in self.stages)

    def separable_kernel(self) -> SeparableKernel:
        """Return the same kernel as a sum of separable terms, on pixels of its pitch.

        Exact, with the bilinear fetches: the pass of term l is that of all stages up to l, one
        after the other.

        Raises
        ------
        KernelError
            A stage is a star, a line or a disk, is turned, or works on a halved picture.
        """
        if not self.is_separable:
            raise KernelError(
                f"{self.structure} has stars, lines, turned stages or halved pictures or is a "
                "disk; only pairs of passes along the axes of the full picture are a sum of "
                "separable terms."
            )
        passes = [np.ones((1, len(self.channels)))]
        for stage in self.stages:
            own = stage.pass_weights(self.mm_per_pixel)
            passes.append(_convolved(passes[-1], own) if self.chained else own)
        half = max(len(each) for each in passes) // 2
        padded = np.zeros((len(passes), 2 * half + 1, len(self.channels)))
        for row, each in zip(padded, passes, strict=True):
            reach = len(each) // 2
            # Convolutions are symmetric up to rounding only.
            row[half - reach : half + reach + 1] = 0.5 * (each + each[::-1])
        kept = self.blend.any(axis=1)
        return SeparableKernel(
            method=self.method,
            mm_per_pixel=self.mm_per_pixel,
            channels=self.channels,
            signs=np.where(self.blend < 0.0, -1.0, 1.0)[kept],
            weights=(padded * np.sqrt(np.abs(self.blend))[:, None, :])[kept],
            relative_frobenius_error=np.full(len(self.channels), np.nan),
            energy_error=self.errors["energy"],
            scale=np.ones(len(self.channels)),
            parameters={},
            meta=self.meta,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of the file."""
        return taps_json.content(self)

    def figures(self) -> dict[str, Any]:
        """Return the figures of ``sssfit show --json``, as lists and numbers, None if unknown."""
        cost = self.cost
        return plain(
            {
                "kind": "taps",
                "format": taps_json.FORMAT,
                **{name: self.meta.get(name) for name in PROVENANCE},
                "settings": self.meta.get("settings") or {},
                "method": self.method,
                "structure": self.structure,
                "chained": self.chained,
                "mm_per_pixel": self.mm_per_pixel,
                "channels": self.channels,
                "fetches": cost.fetches,
                "passes": cost.passes,
                "all_passes": cost.all_passes,
                "bytes_per_pixel": self.bytes_per_pixel(),
                "energy": self.energy,
                "spectral_error": self.errors["spectral"],
                "energy_error": self.errors["energy"],
                "reach_mm": [float(each.offsets_mm.max()) for each in self.stages],
                "blend": self.blend,
            }
        )

    def write(self, stream: BinaryIO) -> None:
        """Write JSON to a binary stream; the same table gives the same bytes."""
        stream.write(taps_json.pack(self))

    def save(self, path: str | Path) -> None:
        """Write the table to ``path`` (by convention ``NAME.taps.json``), whole or not at all.

        Raises
        ------
        FileError
            The file cannot be written; an older file at ``path`` stays unchanged.
        """
        write_atomically(path, self.write)

    @classmethod
    def read(cls, source: str | Path | BinaryIO, origin: str | None = None) -> Self:
        """Read a table from a path or a binary stream; numbers are read back bit for bit.

        Raises
        ------
        KernelError
            The file is missing, damaged, foreign, or of another version; the one-line message names
            the origin.
        """
        if origin is None:
            origin = str(source) if isinstance(source, str | Path) else "the table of taps"
        origin = printable(str(origin))
        fields, said = taps_json.unpack(source, origin)
        try:
            fields["stages"] = tuple(Stage(**each) for each in fields["stages"])
            taps = cls(**fields)
            taps_json.check_derived(said, taps)
        except KernelError as error:
            raise KernelError(f"{origin}: {error} Fit it again.") from None
        return taps

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a file of taps; see `read`."""
        return cls.read(path)


def _convolved(first: FloatArray, second: FloatArray) -> FloatArray:
    """Convolve passes (P, C) and (Q, C) channel by channel."""
    pairs = zip(first.T, second.T, strict=True)
    return np.stack([np.convolve(a, b) for a, b in pairs], axis=1)


def _checked(taps: Taps) -> dict[str, Any]:
    """Return the fields as stored, or raise KernelError."""
    check_label("method", taps.method, KernelError)
    check_names(taps.channels, KernelError)
    if type(taps.chained) is not bool:
        raise KernelError(f"chained = {shown(taps.chained)}; expected True or False.")
    if not isinstance(taps.stages, list | tuple):
        raise KernelError(f"stages = {shown(taps.stages)}; expected a list of stages.")
    stages = tuple(_checked_stage(k, each, taps) for k, each in enumerate(taps.stages))
    _check_levels(stages, chained=taps.chained)
    blend = number_array("blend", taps.blend, KernelError)
    expected = len(stages) + 1, len(taps.channels)
    if blend.shape != expected:
        raise KernelError(f"blend has shape {blend.shape}; expected {expected}.")
    if not (np.abs(blend) <= MOST).all():
        raise KernelError(f"blend holds numbers that are not between -{MOST:g} and {MOST:g}.")
    meta = json_object("meta", taps.meta, KernelError)
    check_provenance(meta, KernelError)
    return {
        "mm_per_pixel": checked_pitch(taps.mm_per_pixel),
        "channels": tuple(taps.channels),
        "stages": stages,
        "blend": blend,
        "errors": MappingProxyType(_checked_errors(taps)),
        "meta": meta,
    }


def _checked_errors(taps: Taps) -> dict[str, FloatArray]:
    if not isinstance(taps.errors, Mapping) or taps.errors.keys() != set(_ERRORS):
        raise KernelError(f"errors = {shown(taps.errors)}; expected {' and '.join(_ERRORS)}.")
    found, expected = {}, (len(taps.channels),)
    for name in _ERRORS:
        values = number_array(f"errors.{name}", taps.errors[name], KernelError)
        if values.shape != expected:
            raise KernelError(f"errors.{name} has shape {values.shape}; expected {expected}.")
        found[name] = values
    return found


def _checked_stage(k: int, stage: Stage, taps: Taps) -> Stage:
    """Check the numbers of a stage, and return it with read-only arrays."""
    path = f"stages[{k}]"
    if not isinstance(stage, Stage) or type(stage.level) is not int:
        raise KernelError(f"{path} = {shown(stage)}; expected a Stage with a whole level.")
    if stage.kind not in KINDS:
        raise KernelError(f"{path}.kind = {shown(stage.kind)}; expected {' or '.join(KINDS)}.")
    offsets = number_array(f"{path}.offsets_mm", stage.offsets_mm, KernelError)
    weights = number_array(f"{path}.weights", stage.weights, KernelError)
    most = _MOST_OFFSETS.get(stage.kind, 2)
    many = 2 if stage.kind == "star" else min(max(offsets.size, 1), most)
    if offsets.shape != (many,):
        raise KernelError(
            f"{path}.offsets_mm has shape {offsets.shape}; expected "
            f"{'(2,)' if stage.kind == 'star' else f'1 to {most} offsets'}."
        )
    if not ((offsets >= MIN_MM) & (offsets <= MAX_MM)).all():
        raise KernelError(f"{path}.offsets_mm = {shown(offsets.tolist())}; expected lengths in mm.")
    steps = np.diff(offsets)
    falls = {"star": None, "disk": steps < 0.0}.get(stage.kind, steps <= 0.0)
    if falls is not None and falls.any():
        raise KernelError(f"{path}.offsets_mm = {shown(offsets.tolist())}; expected rising ones.")
    expected = many + 1, len(taps.channels)
    if weights.shape != expected:
        raise KernelError(f"{path}.weights has shape {weights.shape}; expected {expected}.")
    sums = weights[0] + _COPIES[stage.kind] * weights[1:].sum(axis=0)
    if not (np.abs(weights) <= MOST).all() or not (np.abs(sums - 1.0) <= _ROUNDING).all():
        raise KernelError(
            f"{path}.weights add up to {shown(sums.tolist())} over all fetches; expected 1."
        )
    angle = _checked_angle(f"{path}.angle_degrees", stage)
    return dataclasses.replace(stage, offsets_mm=offsets, weights=weights, angle_degrees=angle)


def _checked_angle(name: str, stage: Stage) -> float:
    angle, turn = stage.angle_degrees, _TURNS.get(stage.kind)
    is_number = isinstance(angle, int | float) and not isinstance(angle, bool)
    if not is_number or not (angle == 0.0 if turn is None else 0.0 <= angle < turn):
        expected = "0" if turn is None else f"a number from 0 to below {turn:g}"
        raise KernelError(f"{name} = {shown(angle)}; expected {expected} for a {stage.kind}.")
    return float(angle)


def _check_levels(stages: tuple[Stage, ...], *, chained: bool) -> None:
    """Check that every level has a stage, in order, and that terms have none but the first."""
    if not 1 <= len(stages) <= MOST_STAGES:
        raise KernelError(
            f"the table has {counted(len(stages), 'stage')}; expected 1 to {MOST_STAGES}."
        )
    levels = [each.level for each in stages]
    rises = {b - a for a, b in zip([0, *levels], levels, strict=False)}
    if not rises <= {0, 1} or max(levels) >= MOST_LEVELS:
        raise KernelError(
            f"the stages have the levels {shown(levels)}; expected 0 first, rising by at most 1, "
            f"below {MOST_LEVELS}."
        )
    if any(each.kind == "disk" for each in stages) and (len(stages) > 1 or chained):
        raise KernelError("a disk is the only stage, and reads the irradiance; found others.")
    if not chained and any(levels):
        raise KernelError(f"stages that read the irradiance have the level 0; found {levels}.")
    if not chained and not all(each.is_upright or each.kind == "disk" for each in stages):
        raise KernelError(
            "stages that read the irradiance are pairs of passes along the axes; found others."
        )
