"""sssfit: from a translucent material to the kernel of a real-time shader.

Three calls take a material to a picture::

    import sssfit
    profile = sssfit.simulate("skin1")
    kernel = sssfit.fit(profile, "svd", rank=3)
    picture = sssfit.render(image, kernel)

Each of the three is also a package (``from sssfit.fit import fit_svd``). The packages, in the order
of the work:

- ``sssfit.material``: absorption and scattering coefficients, loaded and checked.
- ``sssfit.simulate``: material to diffuse reflectance profile R_d(r).
- ``sssfit.profile``: the profile itself, stored as energy in annuli.
- ``sssfit.fit``: profile to kernel, separable or a table of taps (``sssfit.kernel``).
- ``sssfit.render``: kernels applied to pictures.
- ``sssfit.chart``: records to figures.

The names of ``__all__`` are loaded at their first use (PEP 562), because the command line imports
this module first, and ``--help`` must not wait for numpy or numba.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sssfit.errors import SssfitError, SssfitWarning
    from sssfit.fit import fit
    from sssfit.formats.pictures import load_image, save_image
    from sssfit.kernel import SeparableKernel
    from sssfit.kinds import load
    from sssfit.material import Layer, Material, load_material, material_names
    from sssfit.profile import Profile
    from sssfit.render import render
    from sssfit.scene.record import Scene
    from sssfit.simulate import simulate

__version__ = "0.1.0"

__all__ = [
    "Layer",
    "Material",
    "Profile",
    "Scene",
    "SeparableKernel",
    "SssfitError",
    "SssfitWarning",
    "fit",
    "load",
    "load_image",
    "load_material",
    "material_names",
    "render",
    "save_image",
    "simulate",
]

_CALLABLE_ROOMS = ("fit", "render", "simulate")
_HOMES = {
    "Layer": "material",
    "Material": "material",
    "Profile": "profile",
    "Scene": "scene.record",
    "SeparableKernel": "kernel",
    "SssfitError": "errors",
    "SssfitWarning": "errors",
    "load": "kinds",
    "load_image": "formats.pictures",
    "load_material": "material",
    "material_names": "material",
    "save_image": "formats.pictures",
}

if not TYPE_CHECKING:  # for a type checker every misspelt name would be there too

    def __getattr__(name: str) -> Any:
        """Load a public name at its first use; a callable room is its package."""
        if name in _CALLABLE_ROOMS:
            return import_module(f"sssfit.{name}")
        from sssfit.methods import named

        value = globals()[name] = named(__name__, name, _HOMES)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
