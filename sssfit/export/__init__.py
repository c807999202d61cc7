"""Kernels as text for other programs: shader source (``shader``) and documents (``document``)."""

from sssfit.export.document import json_document
from sssfit.export.shader import hlsl

__all__ = ["hlsl", "json_document"]
