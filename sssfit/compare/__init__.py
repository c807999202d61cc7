"""What is lost: one profile, kernel or picture compared with another, in figures.

The names of ``__all__`` are loaded at their first use: a chart of a profile needs none of the fits
and renderers that others are made with, which take half a second to import.
"""

from typing import TYPE_CHECKING, Any

from sssfit.methods import named

if TYPE_CHECKING:
    from sssfit.compare.comparison import Comparison, KernelRow, pareto_front
    from sssfit.compare.guide import Guide, compute_guide
    from sssfit.compare.kernel_view import KernelView, view_kernel
    from sssfit.compare.models import ModelComparison, ModelCurve, compare_models, material_of_walk
    from sssfit.compare.pareto import compare_kernels
    from sssfit.compare.spectrum import Spectrum, compute_spectrum
    from sssfit.compare.taps_view import TapsView, view_taps
    from sssfit.measure.asymmetry import asymmetry_by_radius, radial_asymmetry
    from sssfit.measure.cost import Cost, cost_of, seconds_per_megapixel
    from sssfit.measure.score import ImageScore, auto_exposure, measure
    from sssfit.measure.structure import flip, ssim

__all__ = [
    "Comparison",
    "Cost",
    "Guide",
    "ImageScore",
    "KernelRow",
    "KernelView",
    "ModelComparison",
    "ModelCurve",
    "Spectrum",
    "TapsView",
    "asymmetry_by_radius",
    "auto_exposure",
    "compare_kernels",
    "compare_models",
    "compute_guide",
    "compute_spectrum",
    "cost_of",
    "flip",
    "material_of_walk",
    "measure",
    "pareto_front",
    "radial_asymmetry",
    "seconds_per_megapixel",
    "ssim",
    "view_kernel",
    "view_taps",
]

_HOMES = {
    "Comparison": "compare.comparison",
    "Cost": "measure.cost",
    "Guide": "compare.guide",
    "ImageScore": "measure.score",
    "KernelRow": "compare.comparison",
    "KernelView": "compare.kernel_view",
    "ModelComparison": "compare.models",
    "ModelCurve": "compare.models",
    "Spectrum": "compare.spectrum",
    "TapsView": "compare.taps_view",
    "asymmetry_by_radius": "measure.asymmetry",
    "auto_exposure": "measure.score",
    "compare_kernels": "compare.pareto",
    "compare_models": "compare.models",
    "compute_guide": "compare.guide",
    "compute_spectrum": "compare.spectrum",
    "cost_of": "measure.cost",
    "flip": "measure.structure",
    "material_of_walk": "compare.models",
    "measure": "measure.score",
    "pareto_front": "compare.comparison",
    "radial_asymmetry": "measure.asymmetry",
    "seconds_per_megapixel": "measure.cost",
    "ssim": "measure.structure",
    "view_kernel": "compare.kernel_view",
    "view_taps": "compare.taps_view",
}

if not TYPE_CHECKING:  # for a type checker every misspelt name would be there too

    def __getattr__(name: str) -> Any:
        """Load a public name at its first use."""
        value = globals()[name] = named(__name__, name, _HOMES)
        return value
