"""Write the figures of docs/cascades.md on passes in other directions.

python docs/make_rotated.py
"""

from make_cascades import p99, row, whole_profile
from sections import put_section

from sssfit.fit import fit_taps

SINGLE = (
    ("single pair", {"directions": 2, "taps": 17}),
    ("hexagonal", {"directions": 3, "taps": 11}),
    ("octagonal", {"directions": 4, "taps": 9}),
)
CASCADES = ("1-1-2-2", "1-1x-2-2x", "1-1|2-2|2-2", "1-1x|2-2x|2-2x")

TEXT = """skin1, exact profile, 0.3 mm: the squared misfit that is minimised, of red, and the mean
over the eight pictures of the 99th percentile of Delta E. An x marks a stage along the diagonals:

| kernel | structure | fetches | passes | misfit of red | mean of p99 |
|---|---|---|---|---|---|
{rows}
"""


def rows(profile):
    """Yield a line for each kernel."""
    single = [(name, fit_taps(profile, "rotated", **own).kernel) for name, own in SINGLE]
    chains = [("cascade", fit_taps(profile, stages=each).kernel) for each in CASCADES]
    for name, kernel in (*single, *chains):
        misfit, shown = kernel.errors["spectral"][0] ** 2, p99(kernel, profile)
        cells = [kernel.structure.replace("|", "\\|"), f"{kernel.fetches:.1f}", str(kernel.passes)]
        yield row([name, *cells, f"{misfit:.1e}", f"{shown:.2f}"])


def main():
    """Write the section."""
    text = TEXT.format(rows="\n".join(rows(whole_profile("skin1"))))
    put_section("cascades.md", "docs/make_rotated.py", text)


if __name__ == "__main__":
    main()
