"""Write what the original MCML's generator does to layers, into docs/layers.md.

python docs/make_generator.py

MCML's walk (`walk_mcml`) with its own generator and with another one, and the profiles that its C
program made, against the exact solver.
"""

import numpy as np
from make_layers import STACKS, material_of
from sections import DOCS, put_section
from walk_mcml import subtractive, twister, walk

from sssfit.material import load_material
from sssfit.simulate import simulate_exact

# Photons of each stack: fewer where they take hundreds of collisions.
PHOTONS = {
    "leaf, .25 mm, g .8": 4_000_000,
    "skin, two layers, g .8": 2_000_000,
    "absorber on top": 2_000_000,
    "half space, g .8": 1_000_000,
}
SEED = 1
PROFILES = DOCS.parent / "tests" / "data" / "mcml_skin1_chicken1_ketchup.npz"
WALKED = "skin1", "chicken1", "ketchup"

TEXT = """MCML 1.2.2 draws from a subtractive generator, `ran3`: each number is the difference of
those 55 and 24 draws before it. MCML's walk, written again with that generator and with a Mersenne
twister, against the exact solver (tolerance 2e-5), diffuse reflectance without the specular part:

| stack | photons | exact | `ran3`, error | standard errors | twister, error | standard errors |
|---|---|---|---|---|---|---|
{walks}

The C program itself, by the totals of its nine runs of 1e7 photons without layers (`tests/data`):

| material | exact | MCML 1.2.2, error | standard errors |
|---|---|---|---|
{runs}"""


def slabs_of(name):
    """Return the arrays of `walk_mcml.walk` for a stack."""
    rows = STACKS[name]
    coefficients = [np.array([float(row[at]) for row in rows]) for at in range(3)]
    ends = np.array([row[4] if len(row) > 4 else np.inf for row in rows])
    return *coefficients, np.array([1.0, *(row[3] for row in rows), 1.0]), ends


def apart(found, stderr, exact):
    """Write an error in percent, and in standard errors."""
    return f"{100.0 * (found / exact - 1.0):+.2f} % | {(found - exact) / stderr:+.1f}"


def walk_rows():
    """Yield the rows of both generators."""
    for name, photons in PHOTONS.items():
        exact = float(simulate_exact(material_of(name), tolerance=2e-5).diffuse_reflectance[0])
        both = [walk(make(SEED), photons, *slabs_of(name)) for make in (subtractive, twister)]
        told = " | ".join(apart(*each, exact) for each in both)
        yield f"| {name} | {photons:,} | {exact:.5f} | {told} |"


def run_rows():
    """Yield the rows of MCML's own totals."""
    with np.load(PROFILES) as data:
        for name in WALKED:
            exact = simulate_exact(load_material(name), tolerance=1e-5)
            for channel, total in zip(exact.channels, exact.diffuse_reflectance, strict=True):
                key = f"{name}_{channel}_total"
                told = apart(float(data[key]), float(data[f"{key}_se"]), float(total))
                yield f"| {name} {channel} | {total:.5f} | {told} |"


def main():
    """Walk, solve and write."""
    text = TEXT.format(walks="\n".join(walk_rows()), runs="\n".join(run_rows()))
    put_section("layers.md", "docs/make_generator.py", text)


if __name__ == "__main__":
    main()
