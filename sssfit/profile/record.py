"""A diffuse reflectance profile R_d(r), stored as the energy in annuli around a pencil beam.

It stores energies, not densities, so F(r) = int_0^r 2 pi r' R_d(r') dr' is known exactly at the
annulus edges, independent of R_d inside (near the beam it behaves like 1/r), and kernels made from
it conserve energy by construction. The annulus tallies are those of Wang, Jacques and Zheng,
"MCML - Monte Carlo modeling of light transport in multi-layered tissues", 1995.

``pixels`` has its integrals, ``npz`` its file format, ``checks`` the conditions on its fields.
"""

import dataclasses
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, ReadOnly, is_whole, number_array, plain
from sssfit.errors import MaterialError, ProfileError
from sssfit.files import write_atomically
from sssfit.material import Material
from sssfit.material.checks import is_name
from sssfit.messages import (
    SHARE,
    by_channel,
    counted,
    html_table,
    number,
    of_material,
    printable,
    shown,
)
from sssfit.profile import checks, npz
from sssfit.profile import pixels as integrals
from sssfit.profile.directions import directed_figures
from sssfit.profile.npz import FORMAT, is_profile_file
from sssfit.profile.pixels import full_kernel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FORMAT", "Profile", "full_kernel", "is_profile_file"]

_SHARES = (0.5, 0.9, 0.99)  # shares of the energy whose radii `Profile.to_dict` reports


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Profile(ReadOnly):
    """Energy that leaves a material in annuli around the point where a pencil beam enters.

    A beam of weight 1 enters at normal incidence; all energies are fractions of it. n annuli, C
    channels, the channel axis last. Arrays are stored as read-only float64.

    Parameters
    ----------
    r_edges_mm : array (n+1,) [mm]
        Radii of the annulus edges; the first is 0, strictly increasing.
    annulus_energy : array (n, C) [1]
        Diffusely reflected energy in each annulus.
    annulus_energy_stderr : array (n, C) [1]
        Standard error of each; of the exact solver its estimated error; NaN if there is none.
    beyond_grid, beyond_grid_stderr : array (C,) [1]
        Energy reflected beyond the last edge, and its standard error (NaN if there is none).
    specular_reflectance : float [1]
        Mirror reflection at entry, not part of the diffuse energies.
    absorbed : array (layers, C) [1]
        Energy absorbed in each layer, from the top down; no layers if it is unknown.
    unfinished : array (C,) [1]
        Energy of walks stopped at the collision cap.
    annulus_transmittance : array (n, C) [1] or None
        Energy that leaves through the bottom, by annulus; None for a semi-infinite material.
    meta : mapping
        Provenance as JSON values: ``format`` ("sssfit.profile/1", or
        /2 if angles or an aperture are given), ``channels`` (C names),
        ``material``, ``method``, ``photons`` (number of walks, None if nothing is sampled),
        ``seed``, ``version``, settings.
    beyond_grid_transmittance : array (C,) [1] or None
        Energy that leaves through the bottom beyond the last edge; None if
        ``annulus_transmittance`` is None, or if it is unknown.
    annulus_transmittance_stderr : array (n, C) [1] or None
    beyond_grid_transmittance_stderr : array (C,) [1] or None
        Their standard errors.
    exit_angle_edges_rad : array (A+1,) [rad] or None
        Edges of bins of the angle to the normal in which light leaves, outside; 0 to pi/2.
    angle_reflected, angle_reflected_stderr : array (n+1, A, C) [1] or None
        Diffusely reflected energy by annulus and angle, the last row beyond the grid, and its
        standard error; (1, A, C) if the annuli are not told apart.
    angle_transmitted, angle_transmitted_stderr : array (n+1, A, C) [1] or None
        Likewise through the bottom.
    outside_aperture : array (C,) [1] or None
        Energy reflected outside the numerical aperture of a detector, and then in no annulus.

    Raises
    ------
    ProfileError
        A field has the wrong shape or is not a number, or ``meta`` does not match the fields.
    """

    r_edges_mm: FloatArray
    annulus_energy: FloatArray
    annulus_energy_stderr: FloatArray
    beyond_grid: FloatArray
    beyond_grid_stderr: FloatArray
    specular_reflectance: float
    absorbed: FloatArray
    unfinished: FloatArray
    annulus_transmittance: FloatArray | None
    meta: Mapping[str, Any]
    beyond_grid_transmittance: FloatArray | None = None
    annulus_transmittance_stderr: FloatArray | None = None
    beyond_grid_transmittance_stderr: FloatArray | None = None
    exit_angle_edges_rad: FloatArray | None = None
    angle_reflected: FloatArray | None = None
    angle_reflected_stderr: FloatArray | None = None
    angle_transmitted: FloatArray | None = None
    angle_transmitted_stderr: FloatArray | None = None
    outside_aperture: FloatArray | None = None

    def __post_init__(self) -> None:
        given = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        for name, value in checks.checked(given).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        reflected = by_channel(self.channels, self.diffuse_reflectance.tolist(), ".4f")
        return f"<{self._in_words()}: R_d {reflected}>"

    def _repr_html_(self) -> str:
        columns = (
            (self.diffuse_reflectance, ".6f"),
            (self.diffuse_reflectance_stderr, ".2g"),
            (self.beyond_grid, SHARE),
            (self.energy_radii_mm([0.5])[0], ".4g"),
        )
        rows = [
            [name, *(number(values[c], form) for values, form in columns)]
            for c, name in enumerate(self.channels)
        ]
        heads = ["channel", "diffuse reflectance", "std. error", "beyond grid", "half within, mm"]
        return html_table(self._in_words(), heads, rows)

    def _in_words(self) -> str:
        """Return one line with material, method, photons and grid."""
        method = self.meta.get("method") or "unknown method"
        walked = "" if self.photons is None else f", {self.photons:.3g} photons"
        return (
            f"Profile of {of_material(self.material_name)} by {method}{walked}, "
            f"{counted(self.n_annuli, 'annulus')} to {self.r_edges_mm[-1]:.4g} mm"
        )

    def plot(self) -> "Figure":
        """Draw the profile, for a notebook; see `sssfit.chart.profile.profile_figure`.

        Returns
        -------
        matplotlib.figure.Figure
            8 x 6 inches; `sssfit.chart.page.save_figure` writes it.
        """
        from sssfit.chart.profile import profile_figure

        return profile_figure(self)

    @property
    def n_annuli(self) -> int:
        """Number of annuli on the grid."""
        return len(self.annulus_energy)

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return int(self.annulus_energy.shape[1])

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(self.meta["channels"])

    @property
    def photons(self) -> int | None:
        """Number of photon walks behind the energies; None if nothing was sampled."""
        return self.meta.get("photons")

    @property
    def shares_photons(self) -> bool:
        """Whether each photon of a walk counts in many annuli, as under a beam.

        Errors of their sums then do not follow from those of the annuli.
        """
        return self.photons is not None and "beam" in self.meta

    @property
    def sha256(self) -> str:
        """Fingerprint of the data used by fits and true pictures; kernels record it.

        It covers radii, energies on the grid and beyond, and channels, but not the provenance, so
        equal light gives equal fingerprints from any program and version.
        """
        digest = hashlib.sha256(json.dumps(self.channels).encode())
        for each in (self.r_edges_mm, self.annulus_energy, self.beyond_grid):
            digest.update(each.astype("<f8").tobytes())
        return digest.hexdigest()

    @property
    def total_on_grid(self) -> FloatArray:
        """Energy reflected within the last edge (C,)."""
        total: FloatArray = self.annulus_energy.sum(axis=0)
        return total

    @property
    def diffuse_reflectance(self) -> FloatArray:
        """Energy reflected diffusely, on the grid and beyond (C,), without specular reflection.

        As in MCML, it includes light that the lower interfaces of a stack reflect without a
        collision.
        """
        return self.total_on_grid + self.beyond_grid

    @property
    def diffuse_reflectance_stderr(self) -> FloatArray:
        """Standard error of `diffuse_reflectance` (C,); see `cumulative_stderr`.

        A beam does not change it.
        """
        if self.shares_photons:
            return self._recorded_stderr("diffuse_reflectance_stderr")
        energy = np.vstack((self.annulus_energy, self.beyond_grid))
        stderr = np.vstack((self.annulus_energy_stderr, self.beyond_grid_stderr))
        of_total: FloatArray = _stderr_of_sums(energy, stderr, self.photons)[-1]
        return of_total

    @property
    def transmittance(self) -> FloatArray | None:
        """Energy that leaves through the bottom, on the grid and beyond (C,), or None.

        It includes light that crosses a slab without a collision.
        """
        if self.annulus_transmittance is None:
            return None
        total: FloatArray = self.annulus_transmittance.sum(axis=0)
        beyond = self.beyond_grid_transmittance
        return total if beyond is None else total + beyond

    @property
    def transmittance_stderr(self) -> FloatArray | None:
        """Standard error of `transmittance` (C,), or None; as `diffuse_reflectance_stderr`."""
        on_grid, beyond = self.annulus_transmittance_stderr, self.beyond_grid_transmittance_stderr
        if self.annulus_transmittance is None or on_grid is None or beyond is None:
            return None
        if self.shares_photons:
            return self._recorded_stderr("transmittance_stderr")
        energy = self.annulus_transmittance
        if self.beyond_grid_transmittance is not None:
            energy = np.vstack((energy, self.beyond_grid_transmittance))
            on_grid = np.vstack((on_grid, beyond))
        of_total: FloatArray = _stderr_of_sums(energy, on_grid, self.photons)[-1]
        return of_total

    def _recorded_stderr(self, name: str) -> FloatArray:
        """Return the standard error of all light on a side (C,) that `under_beam` has recorded."""
        return np.array(self.meta.get(name) or [np.nan] * self.n_channels, dtype=np.float64)

    @property
    def material_name(self) -> str | None:
        """Name of the material, or of another source of the profile; None if unknown.

        A profile may have a name and no coefficients. Names that are invalid in files count as
        none.
        """
        record = self.meta.get("material")
        name = record.get("name") if isinstance(record, Mapping) else None
        return name if is_name(name) else None

    @property
    def label(self) -> str:
        """What messages and kernels call it: its material, or the file that it came from."""
        return self.material_name or printable(str(self.meta.get("source") or "unknown material"))

    @property
    def material(self) -> Material | None:
        """The material that the profile records as its source; None if there is none."""
        record = self.meta.get("material")
        if not isinstance(record, dict):
            return None
        try:
            return Material.from_dict(record)
        except MaterialError:
            return None

    @property
    def energy_balance(self) -> FloatArray:
        """Sum of all energies - 1 (C,): 0 except for roulette's noise and rounding.

        Specular + diffuse + absorbed + unfinished (+ transmitted, + outside the aperture) - 1; NaN
        if the absorbed energy is unknown.
        """
        if len(self.absorbed) == 0:
            return np.full(self.n_channels, np.nan)
        reflected = self.specular_reflectance + self.diffuse_reflectance
        balance: FloatArray = reflected + self.absorbed.sum(axis=0) + self.unfinished - 1.0
        if self.outside_aperture is not None:
            balance = balance + self.outside_aperture
        transmitted = self.transmittance
        return balance if transmitted is None else balance + transmitted

    @property
    def cumulative(self) -> FloatArray:
        """F(r) = int_0^r 2 pi r' R_d dr' at the annulus edges (n+1, C); the first row is 0."""
        return integrals.cumulative(self.annulus_energy)

    @property
    def cumulative_stderr(self) -> FloatArray:
        """Standard error of `cumulative` (n+1, C).

        A photon of N lands in at most one annulus, so annuli are anticorrelated and their variances
        do not add. The walk's s_i^2 = (S2_i/N - e_i^2)/(N-1) gives the sum of squared weights
        S2_i = N ((N-1) s_i^2 + e_i^2), which do add: Var F_k = (sum_{i<k} S2_i/N - F_k^2)/(N-1).
        Without photons the variances are added. Under a beam, which spreads each photon over many
        annuli, the errors are unknown: NaN.
        """
        stderr = _stderr_of_sums(self.annulus_energy, self.annulus_energy_stderr, self.photons)
        if self.shares_photons:
            stderr = np.full_like(stderr, np.nan)
        return np.concatenate((np.zeros((1, self.n_channels)), stderr))

    @property
    def reflectance_per_mm2(self) -> FloatArray:
        """Mean of R_d over each annulus (n, C) [1/mm^2]: energy over area."""
        return self.annulus_energy / integrals.annulus_areas(self.r_edges_mm)[:, None]

    @property
    def reflectance_per_mm2_stderr(self) -> FloatArray:
        """Standard error of `reflectance_per_mm2` (n, C) [1/mm^2]."""
        return self.annulus_energy_stderr / integrals.annulus_areas(self.r_edges_mm)[:, None]

    def cumulative_at(self, r_mm: npt.ArrayLike) -> FloatArray:
        """Return F at any radius: exact at the edges, smooth and monotone between them.

        Takes radii (...) [mm] from 0 up and returns (..., C); beyond the last edge F keeps its last
        value. Raises ProfileError for a radius that is negative, NaN or no number.
        """
        radii_mm = np.minimum(number_array("r_mm", r_mm, ProfileError), self.r_edges_mm[-1])
        if not (radii_mm >= 0).all():
            raise ProfileError("r_mm holds a negative radius or NaN; expected radii from 0 up.")
        return integrals.cumulative_at(self.r_edges_mm, self.annulus_energy, radii_mm)

    def flat_annuli(self) -> tuple[FloatArray, FloatArray]:
        """Return the flat annuli from which lines and pixels are integrated.

        The profile's annuli, cut into equal parts by the monotone interpolation of F: the innermost
        ten into 64 each, where R_d ~ 1/r is steep, those farther out into fewer, but at least two.
        Energies between the original edges are unchanged. Returns the edges (m+1,) [mm] and the
        densities between them (m, C) [1/mm^2].
        """
        return integrals.flat_annuli(self.r_edges_mm, self.annulus_energy)

    def line_kernel(self, mm_per_pixel: float, half_pixels: int | None = None) -> FloatArray:
        """Pre-integrated kernel: R_d integrated over y, and over each pixel in x.

        a_k = int_{(k-1/2)p}^{(k+1/2)p} int R_d(x, y) dy dx: eq. S.5 of the supplement of Jimenez et
        al., "Separable Subsurface Scattering", 2015, in closed form from the areas that disks share
        with a strip. Energy beyond the grid is not included.

        Parameters
        ----------
        mm_per_pixel : float [mm]
            Pixel size p; the middle pixel is centred on the beam.
        half_pixels : int, optional
            Pixels h on either side; by default the fewest that cover the grid.

        Returns
        -------
        array (2h+1, C) [1]
            Energy in each strip.

        Raises
        ------
        ProfileError
            The pixel size or half width is invalid, or the kernel would take more than 2 GB per
            channel.
        """
        return integrals.line_kernel(
            self.r_edges_mm, self.annulus_energy, mm_per_pixel, half_pixels
        )

    def quadrant_kernel(
        self,
        mm_per_pixel: float,
        half_pixels: int | None = None,
        *,
        channel: int | None = None,
    ) -> FloatArray:
        """Energy in square pixels, one quadrant of the kernel with both its axes.

        Pixel (i, k) covers [(i-1/2)p, (i+1/2)p] x [(k-1/2)p, (k+1/2)p]; [0, 0] is the centre pixel
        and holds all of its energy. Symmetric; `full_kernel` unfolds it. The row sums of a kernel
        that covers the grid are those of `line_kernel`. Pixels below twice the first annulus exceed
        the resolution of the profile: of skin1's exact profile the centre pixel is right to 0.1 %
        there, but lacks 0.5 to 1.2 % at the annulus' own width and 1.1 to 2.7 % at half of it.

        Parameters
        ----------
        mm_per_pixel : float [mm]
            Pitch p.
        half_pixels : int, optional
            Pixels h beyond the centre; by default the fewest that cover the grid.
        channel : int, optional
            Return only this channel, without a channel axis; a third of the memory for RGB.

        Returns
        -------
        array (h+1, h+1, C), or (h+1, h+1) with ``channel`` [1]
            Energy in each pixel.

        Raises
        ------
        ProfileError
            The pixel size, half width or channel is invalid, or the kernel would take more than
            2 GB per channel.
        """
        if channel is None:
            energy = self.annulus_energy
        elif is_whole(channel) and channel in range(self.n_channels):
            energy = self.annulus_energy[:, channel : channel + 1]
        else:
            raise ProfileError(f"channel = {shown(channel)}; expected 0 to {self.n_channels - 1}.")
        quadrant = integrals.quadrant_kernel(self.r_edges_mm, energy, mm_per_pixel, half_pixels)
        return quadrant if channel is None else quadrant[:, :, 0]

    def energy_radii_mm(self, shares: Sequence[float]) -> FloatArray:
        """Return the radii that contain ``shares`` of each channel's on-grid energy.

        The smooth interpolation of F(r) is inverted inside the annulus that holds the share.

        Parameters
        ----------
        shares : sequence of float (k,) [1]
            Shares of `total_on_grid`, each in (0, 1].

        Returns
        -------
        array (k, C) [mm]
            NaN for a channel without energy on the grid.

        Raises
        ------
        ProfileError
            A share is not above 0 and at most 1.
        """
        return integrals.energy_radii_mm(self.r_edges_mm, self.annulus_energy, shares)

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit show --json``, as lists and numbers, None if unknown.

        ``material`` has coefficients, albedo and transport mean free path of each layer; no
        layers if only a name is known.
        """
        meta, width_mm = self.meta, np.diff(self.r_edges_mm)
        radii_mm = self.energy_radii_mm(_SHARES)
        return plain(
            {
                "kind": "profile",
                "format": meta["format"],
                "material": self._material_figures(),
                "method": meta.get("method"),
                "channels": self.channels,
                "photons": self.photons,
                "seed": meta.get("seed"),
                "version": meta.get("version"),
                "annuli": self.n_annuli,
                "dr_mm": float(self.r_edges_mm[1]),
                "uniform": bool(np.allclose(width_mm, width_mm[0])),
                "radius_mm": float(self.r_edges_mm[-1]),
                "diffuse_reflectance": self.diffuse_reflectance,
                "diffuse_reflectance_stderr": self.diffuse_reflectance_stderr,
                "specular_reflectance": self.specular_reflectance,
                "beyond_grid": self.beyond_grid,
                "absorbed": self.absorbed.sum(axis=0) if len(self.absorbed) else None,
                "transmittance": self.transmittance,
                "transmittance_stderr": self.transmittance_stderr,
                "unfinished": self.unfinished,
                "energy_balance": self.energy_balance,
                "energy_balance_stderr": meta.get("energy_balance_stderr"),
                **{
                    f"radius_of_{100 * share:g}_percent_mm": each
                    for share, each in zip(_SHARES, radii_mm, strict=True)
                },
                "empty_annuli": self._empty_annuli(),
                "settings": meta.get("settings", {}),
                **({"beam": meta["beam"]} if "beam" in meta else {}),
                **directed_figures(self),
            }
        )

    def _material_figures(self) -> dict[str, Any] | None:
        """Return name and layers, from the top down; None without a name."""
        if (material := self.material) is not None:
            return {
                **material.to_dict(),
                "albedo": [layer.albedo for layer in material.layers],
                "mean_free_path_mm": [layer.mean_free_path_mm for layer in material.layers],
            }
        if self.material_name is None:
            return None
        source = printable(str(self.meta["material"].get("source") or ""))
        return {"name": self.material_name, "source": source, "layers": []}

    def _empty_annuli(self) -> Any:
        """Return the number of annuli (C,) without energy from any photon; None without photons."""
        if self.photons is None:
            return None
        return ((self.annulus_energy == 0) & (self.annulus_energy_stderr == 0)).sum(axis=0)

    def write(self, stream: BinaryIO) -> None:
        """Write the profile to a binary stream; the same content gives the same bytes."""
        arrays = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        stream.write(npz.pack(arrays, arrays.pop("meta")))

    def save(self, path: str | Path) -> None:
        """Write the profile to ``path`` (by convention ``NAME.profile.npz``), whole or not at all.

        Raises
        ------
        FileError
            The file cannot be written; an older file at ``path`` stays unchanged.
        """
        write_atomically(path, self.write)

    @classmethod
    def read(cls, source: str | Path | BinaryIO, origin: str | None = None) -> Self:
        """Read a profile from a path or a binary stream (which need not be able to seek).

        Error messages call it ``origin``, by default the path, or "the profile" for a stream.

        Raises
        ------
        ProfileError
            The file is missing, damaged, foreign, or of another version; the one-line message names
            the origin.
        """
        if origin is None:
            origin = str(source) if isinstance(source, str | Path) else "the profile"
        origin = printable(str(origin))
        arrays, meta = npz.unpack(source, origin)
        fields: dict[str, Any] = {"annulus_transmittance": None, **arrays, "meta": meta}
        try:
            return cls(**fields)
        except ProfileError as error:
            raise ProfileError(f"{origin}: {error}") from None

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a profile file; see `read`."""
        return cls.read(path)


def _stderr_of_sums(energy: FloatArray, stderr: FloatArray, photons: int | None) -> FloatArray:
    """Return the standard error of the running sums (n, C); see `Profile.cumulative_stderr`."""
    if photons is None:
        return np.sqrt(np.cumsum(stderr**2, axis=0))
    if photons == 1:
        return np.full(energy.shape, np.nan)
    mean_square = np.cumsum((photons - 1) * stderr**2 + energy**2, axis=0)
    variance = (mean_square - np.cumsum(energy, axis=0) ** 2) / (photons - 1)
    return np.sqrt(np.maximum(variance, 0.0))  # rounding may leave -1e-17 if all weights are equal
