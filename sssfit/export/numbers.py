"""Numbers of shader source: single precision, as few digits as are read back to the same bits."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

_WIDEST_VECTOR = 4  # float4; kernels with more channels become arrays of floats


def vector_kind(channels: int) -> tuple[str, str]:
    """Return the type of a value per channel, and the last index of arrays where it needs one."""
    if channels > _WIDEST_VECTOR:
        return "float", f"[{channels}]"
    return (f"float{channels}" if channels > 1 else "float"), ""


def array(declared: str, rows: npt.NDArray[np.float64], kind: str) -> Iterator[str]:
    """Yield the lines of a constant array with a value per channel in each row."""
    yield f"static const {declared} = {{"
    yield from (f"    {value(row, kind)}," for row in rows)
    yield "};"


def value(values: npt.NDArray[np.float64], kind: str) -> str:
    """Return one value per channel as text: a vector, a single number, or a list."""
    numbers = ", ".join(literal(each) for each in values)
    if kind != "float":
        return f"{kind}({numbers})"
    return numbers if values.size == 1 else f"{{{numbers}}}"


def literal(value: float) -> str:
    """Return a single-precision literal; subnormal numbers become 0, as on GPUs."""
    single = np.float32(value)
    if abs(single) < np.finfo(np.float32).tiny:
        return "0.0"
    text = np.format_float_scientific(single, trim="0", exp_digits=1)
    plain = np.format_float_positional(single, trim="0")
    return plain if len(plain) <= len(text) else text
