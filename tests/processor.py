"""One processor for all tests: what is approved and documented to the last digits holds on any x86.

The fit of a cascade is an iteration that rounding can lead to another optimum, so its figures tell
on which processor they were made. numpy has loops for AVX-512, OpenBLAS kernels for each family of
processors; both are held to those of AVX2. Numba's code has the same bits on all.

Importing this sets the environment, which numpy and scipy read when they are imported, and so do
the tests' child processes.
"""

import os
import platform
from importlib.metadata import version

# Without effect where there is no AVX-512; names have been levels since numpy 2.4.
_LEVELS = "X86_V4 AVX512_ICL AVX512_SPR"
_SETS = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR"

if platform.machine() in ("x86_64", "AMD64"):
    is_of_levels = tuple(map(int, version("numpy").split(".")[:2])) >= (2, 4)
    os.environ["NPY_DISABLE_CPU_FEATURES"] = _LEVELS if is_of_levels else _SETS
    os.environ["OPENBLAS_CORETYPE"] = "Haswell"
