"""A dense kernel as shader source: constant arrays with a comment that explains them."""

from pathlib import Path

from sssfit.export.document import description
from sssfit.export.numbers import array, literal, value, vector_kind
from sssfit.files import has_mark
from sssfit.kernel import SeparableKernel

MARK = "// sssfit.hlsl/1"  # the mark of our files, which may be replaced


def hlsl(kernel: SeparableKernel) -> str:
    """Return HLSL: constant arrays of the signs and weights of each term.

    Weights are indexed by term and pixel. One to four channels are float to float4; more channels
    take a third index.
    """
    terms, pixels, channels = kernel.weights.shape
    kind, last = vector_kind(channels)
    lines = [MARK, *(f"// {line}" for line in description(kernel))]
    lines += [
        f"static const uint SSS_TERMS = {terms};",
        f"static const uint SSS_PIXELS = {pixels};",
        f"static const float SSS_MM_PER_PIXEL = {literal(kernel.mm_per_pixel)};",
        f"static const {kind} SSS_SCALE{last} = {value(kernel.scale, kind)};",
        *array(f"{kind} SSS_SIGN[{terms}]{last}", kernel.signs, kind),
        f"static const {kind} SSS_WEIGHTS[{terms}][{pixels}]{last} = {{",
    ]
    for weights in kernel.weights:
        lines += ["    {", *(f"        {value(each, kind)}," for each in weights), "    },"]
    return "\n".join([*lines, "};", ""])


def is_hlsl_file(path: Path) -> bool:
    """Return whether a file is shader source that `hlsl` wrote."""
    return has_mark(path, {MARK.encode(): b""})
