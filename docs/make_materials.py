"""Write docs/materials.md: the eleven materials by 1e7 photons each, single runs.

python docs/make_materials.py
"""

import time

from sections import DOCS, marked_page

from sssfit.material import load_material, material_names
from sssfit.simulate import simulate_montecarlo

PHOTONS = 10_000_000

HEAD = """# The eleven materials

Made by `python docs/make_materials.py`: 10,000,000 photons each, seed 1, the paper's grid (dr =
shortest mean free path / 20, radius = 32 longest mean free paths), all cores. The transport mean
free path is 1 / (sigma_a + (1 - g) sigma_s): here, where g is 0, 1 / (sigma_a + sigma_s). The
diffuse reflectance is for a pencil beam at normal incidence; it includes the light beyond the grid
and excludes specular reflection. The standard error is the run's own. Everything except the seconds
is the same on every machine.

For high albedo the paper's grid cuts off energy; `--radius auto` enlarges the grid until less
than 0.1 % of every channel lies beyond it.

"""

COLUMNS = (
    "material",
    "channel",
    "single-scattering albedo",
    "transport mean free path (mm)",
    "diffuse reflectance",
    "std. error",
    "beyond grid (share of diffuse)",
    "absorbed",
    "seconds",
)


def rows(name):
    """One line a channel; the time of the run stands in the first."""
    material = load_material(name)
    begun = time.perf_counter()
    profile = simulate_montecarlo(material, photons=PHOTONS)
    seconds = time.perf_counter() - begun
    layer = material.layers[0]
    for c, channel in enumerate(material.channels):
        total = profile.diffuse_reflectance[c]
        yield (
            f"| {name if c == 0 else ''} | {channel} | {layer.albedo[c]:.5f} "
            f"| {layer.mean_free_path_mm[c]:.4f} | {total:.6f} "
            f"| {profile.diffuse_reflectance_stderr[c]:.6f} "
            f"| {100.0 * profile.beyond_grid[c] / total:.3f} % | {profile.absorbed[0, c]:.6f} "
            f"| {f'{seconds:.1f}' if c == 0 else ''} |\n"
        )


def main():
    """Compile first, so that no material's time holds it; then write the page."""
    simulate_montecarlo(load_material("skin1"), photons=1000)
    page = HEAD + f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}\n"
    page += "".join(line for name in material_names(paper=True) for line in rows(name))
    text = marked_page("docs/make_materials.py", page)
    (DOCS / "materials.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
