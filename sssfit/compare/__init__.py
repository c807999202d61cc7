"""What is lost: one profile, kernel or picture held against another, in figures."""

from sssfit.compare.asymmetry import asymmetry_by_radius, radial_asymmetry
from sssfit.compare.comparison import Comparison, KernelRow
from sssfit.compare.cost import Cost, cost_of, seconds_per_megapixel
from sssfit.compare.front import pareto_front
from sssfit.compare.guide import Guide, compute_guide
from sssfit.compare.kernel_view import KernelView, view_kernel
from sssfit.compare.metrics import ImageScore, auto_exposure, measure
from sssfit.compare.models import ModelComparison, ModelCurve, compare_models
from sssfit.compare.pareto import compare_kernels
from sssfit.compare.spectrum import Spectrum, compute_spectrum
from sssfit.compare.structure import flip, ssim

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
    "asymmetry_by_radius",
    "auto_exposure",
    "compare_kernels",
    "compare_models",
    "compute_guide",
    "compute_spectrum",
    "cost_of",
    "flip",
    "measure",
    "pareto_front",
    "radial_asymmetry",
    "seconds_per_megapixel",
    "ssim",
    "view_kernel",
]
