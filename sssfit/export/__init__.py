"""Kernels as text for other programs: shader source (``shader``) and documents (``document``)."""

from sssfit.export.document import json_document
from sssfit.export.shader import hlsl, is_hlsl_file

__all__ = ["hlsl", "is_hlsl_file", "json_document"]
