"""Values as people type them."""

import pytest

from sssfit.errors import ArgumentError
from sssfit.text import (
    base_colour,
    length_mm,
    lengths_mm,
    number,
    numbers,
    part,
    parts,
    share,
    shift,
    whole_number,
)

GOOD = [
    (length_mm, (" 250um ",), 0.25),
    (length_mm, ("3cm",), 30.0),
    (length_mm, ("1e-3m",), 1.0),
    (length_mm, ("auto", "auto"), "auto"),
    (lengths_mm, ("0.37,0.14,0.07cm",), [3.7, 1.4, 0.7]),
    (lengths_mm, ("1mm, 2cm",), [1.0, 20.0]),
    (number, (" -1e-3 ",), -1e-3),
    (numbers, ("1,2.5",), [1.0, 2.5]),
    (whole_number, ("1e7", 2, 10**12), 10**7),
    (whole_number, ("10_000", 2, 10**12), 10_000),
    (share, ("0.5%",), 0.005),
    (share, (" .25 ",), 0.25),
    *((part, (each,), found) for each, found in (("20%", 0.2), ("0", 0.0), ("100 %", 1.0))),
    (parts, ("78%,.7, 1",), [0.78, 0.7, 1.0]),
    (shift, ("2, -1",), (-1, 2)),
    (base_colour, ("44%,0.2",), [0.44, 0.2]),
    (base_colour, (" #c58c6b ",), "#c58c6b"),
]
BAD = [
    *(
        (length_mm, (each,))
        for each in ("", "0", "-1mm", "1km", "1 2", "nan", "inf", "1e999", "auto")
    ),
    (length_mm, ("wide", "auto")),
    *((lengths_mm, (each,)) for each in ("1,2cm,3", "1,,2", "1mm,2")),
    *((whole_number, (each, 2, 100)) for each in ("1", "101", "2.5", "many", "nan", "inf")),
    *((number, (each,)) for each in ("", "nan", "inf", "1,2", "many")),
    *((numbers, (each,)) for each in ("1,,2", "1,nan")),
    *((share, (each,)) for each in ("0", "1", "100%", "half", "nan")),
    *((part, (each,)) for each in ("-1%", "1.01", "101%", "half", "nan")),
    *((parts, (each,)) for each in ("20%,", "0.2,2", "a%")),
    *((shift, (each,)) for each in ("", "1", "1,2,3", "1,.5", "1,", "1e3,0", "a,b")),
    *((base_colour, (each,)) for each in ("#c58c6", "#xyzxyz", "red", "1,,2")),
]


@pytest.mark.parametrize(("read", "given", "found"), GOOD)
def test_what_is_meant_is_read(read, given, found):
    assert read(*given) == (found if isinstance(found, str) else pytest.approx(found))


@pytest.mark.parametrize(("read", "given"), BAD)
def test_anything_else_is_refused_in_one_line_that_repeats_it(read, given):
    with pytest.raises(ArgumentError) as failure:
        read(*given)
    line = str(failure.value)
    assert "\n" not in line
    assert any(repr(part) in line for part in (given[0], *given[0].split(",")))
