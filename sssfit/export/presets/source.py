"""What a preset is made from: a profile, and the material behind it if there is one."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.fit import fit_burley
from sssfit.kernel import SeparableKernel, Taps
from sssfit.material import Layer, Material
from sssfit.messages import counted, of_material, shown
from sssfit.optics import normal_transmittance
from sssfit.profile import Profile
from sssfit.simulate import simulate_exact

_CHANNELS = 3


@dataclass(frozen=True, eq=False)
class Source:
    """A profile of three channels, and its material.

    Parameters
    ----------
    profile : Profile
        All channels reflect light.
    material : Material or None
    """

    profile: Profile
    material: Material | None

    @property
    def title(self) -> str:
        """Name of the material, or "profile"."""
        return self.profile.material_name or "profile"

    @property
    def reflectance(self) -> FloatArray:
        """Diffuse reflectance R_d (3,), a share of the incident light.

        At most 1: the sum of the six Gaussians of skin, whose energy is 1, is 7e-16 above it.
        """
        return np.minimum(self.profile.diffuse_reflectance, 1.0)

    @functools.cached_property
    def shapes_per_mm(self) -> FloatArray:
        """Shape s (3,) [1/mm] of the normalised diffusion that fits the profile best."""
        found = fit_burley(self.profile).kernel.parameters
        return np.array([float(found[name]["s_per_mm"]) for name in self.profile.channels])

    def layer(self, why: str) -> Layer:
        """Return the medium, a half space without a bottom.

        Raises
        ------
        KernelError
            The profile has no coefficients, or the material has layers or a bottom; the message
            says ``why`` they are needed.
        """
        if self.material is None:
            raise KernelError(
                f"{self.title} is a profile without coefficients; {why}, so give its material."
            )
        if not self.material.is_semi_infinite:
            raise KernelError(
                f"{self.title} has layers or a bottom; {why}, and they describe one layer without "
                "a bottom."
            )
        return self.material.layers[0]

    @property
    def eta(self) -> float:
        """Refractive index of the material relative to what is above; 1.4 of an unknown one.

        A profile that was imported from an engine has it among its settings.
        """
        if self.material is None:
            return float(self.profile.meta.get("settings", {}).get("eta", 1.4))
        return self.material.layers[0].eta / self.material.eta_above

    @property
    def entering_colour(self) -> FloatArray:
        """R_d / (1 - R_sp) (3,): the share of the light that enters which comes back."""
        return self.reflectance / normal_transmittance(self.eta)


def source_of(record: Material | Profile | SeparableKernel | Taps | Source) -> Source:
    """Return the source of a preset.

    Parameters
    ----------
    record : Material, Profile or Source
        For a material the exact profile is computed, which takes seconds; a source stays as it is.

    Raises
    ------
    KernelError
        It is a kernel, which a preset's parameters cannot carry; it has not three channels; a
        channel reflects nothing; or a material has layers and no profile of its own.
    """
    if isinstance(record, Source):
        return record
    if isinstance(record, SeparableKernel | Taps):
        raise KernelError(
            f"a kernel of {of_material(record.meta.get('material'))} is a table, which a preset's "
            "few parameters cannot carry; give its profile or its material."
        )
    if not isinstance(record, Material | Profile):
        raise KernelError(f"{shown(record)} is neither a material nor a profile.")
    if len(record.channels) != _CHANNELS:
        raise KernelError(
            f"{_title(record)} has {counted(len(record.channels), 'channel')}; engines take "
            "three: red, green and blue."
        )
    if isinstance(record, Profile):
        return _checked(Source(record, record.material))
    if not record.is_semi_infinite:
        raise KernelError(
            f"{record.name} has layers or a bottom; simulate its profile and give that."
        )
    return _checked(Source(simulate_exact(record), record))


def check_medium(record: object, name: str) -> None:
    """Refuse what has layers or a bottom for a preset of a medium, by its name.

    Raises
    ------
    KernelError
        A material, or that of a profile or of a source, is no half space.
    """
    material = record.material if isinstance(record, Profile | Source) else record
    if isinstance(material, Material) and not material.is_semi_infinite:
        raise KernelError(
            f"{material.name} has layers or a bottom, and {name} describes one layer without a "
            "bottom; give a half space that looks alike, or the profile to a preset that takes "
            "one, such as unreal or hdrp."
        )


def _title(record: Material | Profile) -> str:
    return record.name if isinstance(record, Material) else record.label


def _checked(source: Source) -> Source:
    """Return a source of which every channel reflects light, or raise."""
    for name, total in zip(source.profile.channels, source.reflectance, strict=True):
        if total <= 0.0:
            raise KernelError(
                f"{source.title}: channel {name} reflects nothing, so it has no width to convert."
            )
    return source
