"""What is lost: one profile, kernel or picture compared with another, in figures."""

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
