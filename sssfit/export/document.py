"""A kernel as a JSON document: the kernel file itself, with what it is in words."""

import json

from sssfit.export._comment import description
from sssfit.kernel import SeparableKernel


def json_document(kernel: SeparableKernel) -> str:
    """Return the kernel as indented JSON, a ``comment`` (list of lines) first; always the same."""
    whole = {"comment": description(kernel), **kernel.to_dict()}
    terms = whole.pop("terms")
    head = json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False)
    lines = ",\n  ".join(json.dumps(each, allow_nan=False) for each in terms)
    return head.removesuffix("\n}") + f',\n "terms": [\n  {lines}\n ]\n}}\n'
