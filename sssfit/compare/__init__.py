"""What is lost: one profile, kernel or picture held against another, in figures."""

from sssfit.compare.guide import Guide, compute_guide
from sssfit.compare.models import ModelComparison, ModelCurve, compare_models
from sssfit.compare.spectrum import Spectrum, compute_spectrum

__all__ = [
    "Guide",
    "ModelComparison",
    "ModelCurve",
    "Spectrum",
    "compare_models",
    "compute_guide",
    "compute_spectrum",
]
