"""Numbers of shader source: single precision, as few digits as are read back to the same bits."""

import numpy as np


def literal(value: float) -> str:
    """Return a single-precision literal; subnormal numbers become 0, as on GPUs."""
    single = np.float32(value)
    if abs(single) < np.finfo(np.float32).tiny:
        return "0.0"
    text = np.format_float_scientific(single, trim="0", exp_digits=1)
    plain = np.format_float_positional(single, trim="0")
    return plain if len(plain) <= len(text) else text
