"""The generator of MCML that docs/walk_mcml.py has, against its C code read line by line."""

import runpy
from pathlib import Path

import numpy as np

DOCS = Path(__file__).parent.parent / "docs"
LARGEST = 1_000_000_000


def knuths(seed, count):
    """`ran3` of Press et al. 1992, section 7.1, with its array from 1 to 55."""
    last = (161_803_398 - seed) % LARGEST
    ma, mk = [0] * 56, 1
    ma[55] = last
    for i in range(1, 55):
        ii = (21 * i) % 55
        ma[ii] = mk
        mk = last - mk + (LARGEST if last < mk else 0)
        last = ma[ii]
    for _ in range(4):
        for i in range(1, 56):
            ma[i] -= ma[1 + (i + 30) % 55]
            ma[i] += LARGEST if ma[i] < 0 else 0
    first, second, found = 0, 31, []
    for _ in range(count):
        first, second = first % 55 + 1, second % 55 + 1
        ma[first] -= ma[second]
        ma[first] += LARGEST if ma[first] < 0 else 0
        found.append(float(np.float32(ma[first] * 1e-9)))
    return found


def test_numbers_are_those_of_the_c_code():
    made = runpy.run_path(str(DOCS / "walk_mcml.py"))
    state = made["subtractive"].py_func(1)
    drawn = [made["drawn"].py_func(state) for _ in range(500)]
    assert drawn == knuths(1, 500)
    # each is the difference of those 55 and 24 before it, which an unbiased generator's are not
    late = np.array(drawn)
    apart = np.abs((late[55:] - late[:-55] + late[31:-24]) % 1.0)
    assert np.minimum(apart, 1.0 - apart).max() < 1e-6
