"""Separable kernels: the filter of a shader, as signed pairs of one-dimensional passes.

The 2D kernel of channel c is K[i, j] = sum_t s_tc w_tc[i] w_tc[j], s = +1 or -1: every term is a
horizontal pass and the same pass vertically. Weights are energies of pixels (integrals, not
samples), so their sums are energies too. A kernel is made for one pixel size, in mm per pixel.

``json`` has the file format, ``sssfit/kernel.schema.json`` its JSON Schema; ``checks`` validates
its fields.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self

import numpy as np

from sssfit.arrays import FloatArray, ReadOnly, is_whole, plain
from sssfit.errors import KernelError
from sssfit.files import write_atomically
from sssfit.kernel import checks
from sssfit.kernel import json as kernel_json
from sssfit.kernel.json import FORMAT, is_kernel_file
from sssfit.messages import by_channel, counted, html_table, number, of_material, printable, shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sssfit.profile import Profile

__all__ = ["FORMAT", "SeparableKernel", "is_kernel_file"]

PROVENANCE = ("material", "profile_method", "photons", "seed", "version", "profile_sha256")


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class SeparableKernel(ReadOnly):
    """A signed sum of separable terms per channel, on pixels.

    T terms, P = 2 h + 1 pixels, C channels, the channel axis last. Arrays are stored as read-only
    float64.

    Parameters
    ----------
    method : str
        The fit that made it, by its name on the command line.
    mm_per_pixel : float [mm]
        Pixel size; pixel h is centred on the axis.
    channels : tuple of str
        Names of the C channels.
    signs : array (T, C)
        +1 or -1.
    weights : array (T, P, C)
        The passes; symmetric about the middle pixel.
    relative_frobenius_error : array (C,)
        ||K - target|| / ||target|| over the support; NaN if it was not fitted to a profile.
    energy_error : array (C,)
        Relative difference of the kernel's energy from the profile's diffuse reflectance, which
        includes the light beyond the grid and the support. NaN as above.
    scale : array (C,)
        Factor that restores the profile's energy: 1, unless the fit was normalised. Then the
        kernel's energy is 1, and this is the albedo by which an engine multiplies.
    parameters : mapping
        Results of the method by channel, for JSON: variances, weights, widths.
    meta : mapping
        Provenance, for JSON; any of it may be missing: material (a name), material_sha256,
        profile_sha256 (`Profile.sha256`), profile_method, photons, seed, version, settings.

    Raises
    ------
    KernelError
        A field has the wrong shape, is not a number, is beyond single precision, or cannot be
        stored as JSON.
    """

    method: str
    mm_per_pixel: float
    channels: tuple[str, ...]
    signs: FloatArray
    weights: FloatArray
    relative_frobenius_error: FloatArray
    energy_error: FloatArray
    scale: FloatArray
    parameters: Mapping[str, Any]
    meta: Mapping[str, Any]

    def __post_init__(self) -> None:
        given = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for name, value in checks.checked(given).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        errors = by_channel(self.channels, self.relative_frobenius_error.tolist(), ".3g%|unknown")
        return f"<{self._in_words()}: error {errors}>"

    def _repr_html_(self) -> str:
        columns = (
            (self.energy, ".6f"),
            (self.scale, ".6g"),
            (self.relative_frobenius_error, ".3g%|unknown"),
            (self.energy_error, "+.2g%|unknown"),
        )
        rows = [
            [name, *(number(values[c], form) for values, form in columns)]
            for c, name in enumerate(self.channels)
        ]
        heads = ["channel", "energy", "scale", "Frobenius error", "energy error"]
        return html_table(self._in_words(), heads, rows)

    def _in_words(self) -> str:
        """Return one line with material, method, terms and pixels."""
        return (
            f"SeparableKernel of {of_material(self.meta.get('material'))} by {self.method}, "
            f"{counted(self.rank, 'term')}, {counted(self.pixels, 'pixel')} "
            f"of {self.mm_per_pixel:.4g} mm"
        )

    def plot(self, profile: "Profile | None" = None) -> "Figure":
        """Draw the kernel, for a notebook; see `sssfit.chart.kernel.kernel_figure`.

        Parameters
        ----------
        profile : Profile, optional
            The profile that it was fitted to, drawn beside it.

        Returns
        -------
        matplotlib.figure.Figure
            8 inches wide; `sssfit.chart.page.save_figure` writes it.

        Raises
        ------
        KernelError
            The profile has other channels.
        """
        from sssfit.chart.kernel import kernel_figure
        from sssfit.compare.kernel_view import view_kernel

        return kernel_figure(view_kernel(self, profile))

    @property
    def rank(self) -> int:
        """Number of separable terms T."""
        return len(self.weights)

    @property
    def half_pixels(self) -> int:
        """Pixels h on either side of the middle one."""
        return (self.pixels - 1) // 2

    @property
    def pixels(self) -> int:
        """Number of pixels P of a pass."""
        return int(self.weights.shape[1])

    @property
    def support_mm(self) -> float:
        """Distance of the outermost pixel centre from the axis [mm]."""
        return self.half_pixels * self.mm_per_pixel

    @property
    def energy(self) -> FloatArray:
        """Sum of the 2D kernel over all pixels (C,), without ``scale``."""
        total: FloatArray = np.sum(self.signs * np.sum(self.weights, axis=1) ** 2, axis=0)
        return total

    @property
    def line(self) -> FloatArray:
        """Sum of the 2D kernel along one axis (P, C), its response to a line."""
        sums = self.signs * np.sum(self.weights, axis=1)
        along: FloatArray = np.einsum("tc,tpc->pc", sums, self.weights)
        return along

    def quadrant(self, channel: int) -> FloatArray:
        """Return one quadrant of the 2D kernel with both its axes, (h+1, h+1)."""
        self._check_channel(channel)
        half = self.weights[:, self.half_pixels :, channel]
        quadrant: FloatArray = (half * self.signs[:, channel, None]).T @ half
        return quadrant

    def full(self, channel: int) -> FloatArray:
        """Return the 2D kernel of a channel, (P, P)."""
        self._check_channel(channel)
        passes = self.weights[:, :, channel]
        kernel: FloatArray = (passes * self.signs[:, channel, None]).T @ passes
        return kernel

    def _check_channel(self, channel: int) -> None:
        count = len(self.channels)
        if not is_whole(channel) or not -count <= channel < count:
            raise KernelError(f"channel = {shown(channel)}; expected 0 to {count - 1}.")

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of the kernel's file."""
        return kernel_json.content(self)

    def figures(self) -> dict[str, Any]:
        """Return the figures of ``sssfit show --json``, as lists and numbers, None if unknown.

        Terms have their signs, energies (sign times the squared sum of the pass) and the weights of
        the middle pixel, (terms, channels). `to_dict` is the file, with all weights.
        """
        return plain(
            {
                "kind": "kernel",
                "format": FORMAT,
                **{name: self.meta.get(name) for name in PROVENANCE},
                "settings": self.meta.get("settings") or {},
                "method": self.method,
                "rank": self.rank,
                "pixels": self.pixels,
                "mm_per_pixel": self.mm_per_pixel,
                "support_mm": self.support_mm,
                "channels": self.channels,
                "energy": self.energy,
                "scale": self.scale,
                "relative_frobenius_error": self.relative_frobenius_error,
                "energy_error": self.energy_error,
                "sign": self.signs,
                "term_energy": self.signs * self.weights.sum(axis=1) ** 2,
                "middle_weight": self.weights[:, self.half_pixels],
                "parameters": self.parameters,
            }
        )

    def write(self, stream: BinaryIO) -> None:
        """Write JSON to a binary stream; the same kernel gives the same bytes."""
        stream.write(kernel_json.pack(self))

    def save(self, path: str | Path) -> None:
        """Write the kernel to ``path`` (by convention ``NAME.kernel.json``), whole or not at all.

        Raises
        ------
        FileError
            The file cannot be written; an older file at ``path`` stays unchanged.
        """
        write_atomically(path, self.write)

    @classmethod
    def read(cls, source: str | Path | BinaryIO, origin: str | None = None) -> Self:
        """Read a kernel from a path or a binary stream; numbers are read back bit for bit.

        Raises
        ------
        KernelError
            The file is missing, damaged, foreign, or of another version; the one-line message names
            the origin.
        """
        if origin is None:
            origin = str(source) if isinstance(source, str | Path) else "the kernel"
        origin = printable(str(origin))
        fields = kernel_json.unpack(source, origin)
        try:
            return cls(**fields)
        except KernelError as error:
            raise KernelError(f"{origin}: {error}") from None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a kernel file; see `read`."""
        return cls.read(path)
