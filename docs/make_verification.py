"""Write docs/verification.md: the walk against theory and other programs at full size.

    python docs/make_verification.py              1e8 photons, some twenty minutes on two cores
    python docs/make_verification.py 1e6          smaller, printed and not written

The same comparisons run as tests: small in `pytest`, full in `pytest -m slow`.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import checks  # noqa: E402
import checks_exact  # noqa: E402
import checks_layers  # noqa: E402
from sections import put_section  # noqa: E402

FULL = 100_000_000

HEAD = """# Verification

Made by `python docs/make_verification.py`: {photons:,} photons per walk ({loop:,} for comparisons
with the scalar loop), seed 1. The last column is the difference in standard errors; a test fails
beyond {limit}. Profiles are compared by chi-square over annuli that are merged until each holds
{hits} hits, and the p value is converted to standard errors with the same two-sided probability.

- Chandrasekhar's H function is computed in tests/reference.py from its integral equation.
- Giovanelli's figure has four published digits; half a unit of the last digit counts as its
  error.
- The single-scattering profile F1(r) has a closed form (tests/reference.py); the walk uses an
  albedo of 1e-6, where all but a millionth of the returning light has collided once.
- The scalar loop (tests/reference.py) follows one photon at a time in double precision.
- The layered walk is compared with the semi-infinite walk at a quarter of the photons, and with a
  scalar MCML (tests/reference.py) at a fifth of these; in the latter, energies are shares of the
  light that enters.
- The exact solver runs at a tolerance of {fine:g} against the walk; F is compared at every edge
  of the merged annuli from the third on, and the table lists the worst edge.
- MCML 1.2.2 is the original C program; tests/data/README.md gives the origin of its profiles.

| comparison | ours | theirs | standard errors apart |
|---|---|---|---|
"""

FINER = """
## The exact solver against itself

Largest |F - F_fine| / total over channels and annulus edges from the third on, at the default
tolerance of 1e-4, compared with a run at {fine:g}; and the error that the run itself claims.

| material | error | claimed |
|---|---|---|
"""

SIMILARITY = """
## What the similarity relation costs

The exact solver with sigma_s' = (1 - g) sigma_s compared with the layered walk with g, at eta
1.3, {photons:,} photons; the albedo is the reduced one. Misplaced is half the sum over annuli of
the absolute differences of their shares of the total. The last column is the error of F within
one reduced mean free path of the beam.

| g | albedo | walk | total | misplaced | F at 1 MFP |
|---|---|---|---|---|---|
"""


def figures(photons):
    """All comparisons, as they are done."""
    yield from checks.totals(photons)
    for eta in (1.0, 1.3, 1.5, 2.0):
        yield checks.single_scattering(photons, eta)
    for name in ("skin1", "ketchup"):
        yield from checks.against_scalar_loop(name, photons // 5)
    for name in ("skin1", "chicken1", "ketchup"):
        yield from checks.against_mcml(name, photons)
    yield from checks_layers.van_de_hulst(photons)
    for name in ("skin1", "ketchup", "marble"):
        yield from checks_layers.one_layer(name, photons // 4)
    for name in checks_layers.STACKS:
        yield from checks_layers.against_scalar_mcml(name, photons // 4)
    yield from checks_exact.against_walk(photons, tolerance=checks_exact.FINE)


def tables(photons):
    """Compare by other measures than standard errors."""
    page = FINER.format(fine=checks_exact.FINE)
    for name, apart, claimed in checks_exact.shares_apart():
        page += f"| {name} | {apart:.1e} | {claimed:.1e} |\n"
    page += SIMILARITY.format(photons=photons // 10)
    for row in checks_exact.similarity_rows(photons // 10):
        page += "| " + " | ".join(row) + " |\n"
    return page


def main():
    """Write the page at full size, print it at any other."""
    photons = int(float(sys.argv[1])) if len(sys.argv) > 1 else FULL
    page = HEAD.format(
        photons=photons,
        loop=photons // 5,
        limit=checks.LIMIT,
        hits=checks.MIN_HITS,
        fine=checks_exact.FINE,
    )
    for each in figures(photons):
        page += f"| {each.what} | {each.ours} | {each.theirs} | {each.sigmas:+.2f} |\n"
    page += tables(photons)
    if photons == FULL:
        put_section("verification.md", "docs/make_verification.py", page)
    else:
        sys.stdout.write(page)


if __name__ == "__main__":
    main()
