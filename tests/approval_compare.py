"""Compare an output with the approved one: words exactly, numbers as far as machines agree.

Another processor rounds sums otherwise: a number agrees within 1e-6 of it, or one unit of its last
digit where three are printed at least, decimals among them. How many digits are printed is held
too, up to seven, and whole numbers are exact.
"""

import difflib
import math
import re
from decimal import Decimal

# A number that stands alone: not the 2 of svd2, nor a part of a fingerprint.
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d[\d,]*\d|\d)?(?:\.\d+|(?<=\d))(?:e[-+]?\d+)?(?![\w])")
_RELATIVE = 1e-6
_ROUNDING = 1e-12  # what two computations of one number differ by, each printed in full
_NOTHING = 1e-11  # a sum that is 0 but for rounding
_MANY, _ENOUGH = 9, 7


def agrees(found: str, expected: str) -> bool:
    """Whether a line is the approved one."""
    if found == expected:
        return True
    if _NUMBER.split(found) != _NUMBER.split(expected):
        return False
    pairs = zip(_NUMBER.findall(found), _NUMBER.findall(expected), strict=True)
    return all(_is_same(*pair) for pair in pairs)


def _is_same(found: str, expected: str) -> bool:
    if found == expected:
        return True
    found, expected = found.replace(",", ""), expected.replace(",", "")
    ours, theirs = float(found), float(expected)
    digits, wanted = _digits(found), _digits(expected)
    if max(abs(ours), abs(theirs)) < _NOTHING:
        return True
    if max(digits, wanted) > _MANY:
        if math.isclose(ours, theirs, rel_tol=_ROUNDING, abs_tol=_NOTHING):
            return True
        if min(digits, wanted) < _ENOUGH:
            return False
    elif digits != wanted or "." not in expected:
        return False
    if math.isclose(ours, theirs, rel_tol=_RELATIVE, abs_tol=_NOTHING):
        return True
    return 3 <= wanted <= _MANY and abs(Decimal(found) - Decimal(expected)) <= _unit(expected)


def _digits(number: str) -> int:
    """How many digits are printed, without leading zeros."""
    mantissa = number.lower().partition("e")[0]
    return len(re.sub(r"[^\d]", "", mantissa).lstrip("0"))


def _unit(number: str) -> Decimal:
    """One unit of the last digit."""
    exponent = Decimal(number).as_tuple().exponent
    assert isinstance(exponent, int)
    return Decimal(1).scaleb(exponent)


def differences(found: list[str], expected: list[str]) -> list[str]:
    """Lines of a difference that a person can read; none where all agrees."""
    if len(found) == len(expected) and all(map(agrees, found, expected)):
        return []
    # Lines that agree but for rounding are not shown as different.
    matched = [
        expected[k] if k < len(expected) and agrees(each, expected[k]) else each
        for k, each in enumerate(found)
    ]
    return list(difflib.unified_diff(expected, matched, "approved", "found now", lineterm="", n=2))
