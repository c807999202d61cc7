"""A kernel as shader source: constant arrays with a comment that explains them.

Numbers are in single precision, with the fewest digits that are read back to the same bits.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from sssfit.export.document import description
from sssfit.files import has_mark
from sssfit.kernel import SeparableKernel

MARK = "// sssfit.hlsl/1"  # the mark of our files, which may be replaced
_WIDEST_VECTOR = 4  # float4; kernels with more channels become arrays of floats


def hlsl(kernel: SeparableKernel) -> str:
    """Return HLSL: constant arrays of the signs and weights of each term.

    Weights are indexed by term and pixel. One to four channels are float to float4; more channels
    take a third index.
    """
    terms, pixels, channels = kernel.weights.shape
    is_vector = channels <= _WIDEST_VECTOR
    kind = f"float{channels}" if 1 < channels <= _WIDEST_VECTOR else "float"
    last = "" if is_vector else f"[{channels}]"
    lines = [MARK, *(f"// {line}" for line in description(kernel))]
    lines += [
        f"static const uint SSS_TERMS = {terms};",
        f"static const uint SSS_PIXELS = {pixels};",
        f"static const float SSS_MM_PER_PIXEL = {_number(kernel.mm_per_pixel)};",
        f"static const {kind} SSS_SCALE{last} = {_value(kernel.scale, kind)};",
        f"static const {kind} SSS_SIGN[{terms}]{last} = {{",
        *(f"    {_value(signs, kind)}," for signs in kernel.signs),
        "};",
        f"static const {kind} SSS_WEIGHTS[{terms}][{pixels}]{last} = {{",
    ]
    for weights in kernel.weights:
        lines += ["    {", *(f"        {_value(each, kind)}," for each in weights), "    },"]
    return "\n".join([*lines, "};", ""])


def is_hlsl_file(path: Path) -> bool:
    """Return whether a file is shader source that `hlsl` wrote."""
    return has_mark(path, {MARK.encode(): b""})


def _value(values: npt.NDArray[np.float64], kind: str) -> str:
    """Return one value per channel as text: a vector, a single number, or a list."""
    numbers = ", ".join(_number(each) for each in values)
    if kind != "float":
        return f"{kind}({numbers})"
    return numbers if values.size == 1 else f"{{{numbers}}}"


def _number(value: float) -> str:
    """Return a single-precision literal; subnormal numbers become 0, as on GPUs."""
    single = np.float32(value)
    if abs(single) < np.finfo(np.float32).tiny:
        return "0.0"
    text = np.format_float_scientific(single, trim="0", exp_digits=1)
    plain = np.format_float_positional(single, trim="0")
    return plain if len(plain) <= len(text) else text
