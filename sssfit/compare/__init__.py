"""What is lost: one profile, kernel or picture held against another, in figures."""

from sssfit.compare.models import ModelComparison, ModelCurve, compare_models

__all__ = ["ModelComparison", "ModelCurve", "compare_models"]
