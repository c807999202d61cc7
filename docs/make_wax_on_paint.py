"""Write docs/examples/wax-on-paint.toml: a clear wax polish on white paint, by Mie's theory.

python docs/make_wax_on_paint.py

No measured coefficients of wax or paint were found. Paint is therefore made from its pigment:
spheres of rutile in a binder, each of which scatters by itself. Wax is a film thin enough to be
clear. What is assumed stands in the file.
"""

import numpy as np
from make_layered_materials import CHANNELS, NM, layer
from scipy.special import spherical_jn, spherical_yn
from sections import DOCS

from sssfit.material import Material

FILE = DOCS / "examples" / "wax-on-paint.toml"
BINDER, DIAMETER_UM, VOLUME = 1.5, 0.25, 0.15
PAINT_MM, WAX, WAX_MM = 0.05, 1.44, 0.05
SOURCE = "DeVore 1951 and Mie's theory"
COMMENT = f"""\
# Channels R, G, B are the wavelengths 610, 550 and 460 nm.
# Paint: spheres of rutile by Mie's theory, as in chapter 4 of C. F. Bohren and D. R. Huffman 1983,
#   "Absorption and Scattering of Light by Small Particles". Their index is (2 n_o + n_e)/3 of
#   J. R. DeVore 1951, "Refractive indices of rutile and sphalerite", Journal of the Optical
#   Society of America 41; rutile absorbs nothing that matters at these wavelengths.
# Assumed: spheres {DIAMETER_UM:g} um wide take {100 * VOLUME:g} % of the volume, and each
#   scatters by itself; the binder has the index {BINDER:g}; the coat is {PAINT_MM:g} mm thick, and
#   light is lost beneath it.
# Wax: a polish of {WAX_MM:g} mm. Assumed: so thin a film is clear, and its index is {WAX:g}.
# The mean free path is .0003 mm: trace it with --dr 5um --radius 2mm. The exact solver refuses it.
"""


def rutile(nm):
    """Return the mean refractive index of rutile, (2 n_o + n_e)/3, by DeVore's two formulas."""
    square = (nm / 1000.0) ** 2
    ordinary = np.sqrt(5.913 + 0.2441 / (square - 0.0803))
    extraordinary = np.sqrt(7.197 + 0.3322 / (square - 0.0843))
    return (2.0 * ordinary + extraordinary) / 3.0


def mie(size, index):
    """Return the scattering efficiency and g of a sphere that does not absorb.

    Bohren and Huffman 1983, equations 4.53, 4.61 and that of the asymmetry parameter below 4.61.

    Parameters
    ----------
    size : float
        Circumference over the wavelength in the medium.
    index : float
        Refractive index over that of the medium.
    """
    n = np.arange(1, int(size + 4.0 * size ** (1.0 / 3.0)) + 12)

    def with_slope(function, z):
        return z * function(n, z), function(n, z) + z * function(n, z, derivative=True)

    psi, psi_slope = with_slope(spherical_jn, size)
    inside, inside_slope = with_slope(spherical_jn, index * size)
    chi, chi_slope = with_slope(spherical_yn, size)
    xi, xi_slope = psi + 1j * chi, psi_slope + 1j * chi_slope
    a = (index * inside * psi_slope - psi * inside_slope) / (
        index * inside * xi_slope - xi * inside_slope
    )
    b = (inside * psi_slope - index * psi * inside_slope) / (
        inside * xi_slope - index * xi * inside_slope
    )
    efficiency = 2.0 / size**2 * np.sum((2 * n + 1) * (abs(a) ** 2 + abs(b) ** 2))
    k = n[:-1]
    neighbours = (a[:-1] * a[1:].conj() + b[:-1] * b[1:].conj()).real
    forward = np.sum(k * (k + 2) / (k + 1) * neighbours)
    forward += np.sum((2 * n + 1) / (n * (n + 1)) * (a * b.conj()).real)
    return efficiency, 4.0 / size**2 * forward / efficiency


def material():
    """Return wax on paint; scattering is 3/2 of volume and efficiency over the diameter."""
    sizes = np.pi * DIAMETER_UM * BINDER / (NM / 1000.0)
    found = [mie(*each) for each in zip(sizes, rutile(NM) / BINDER, strict=True)]
    efficiency, g = np.transpose(found)
    scattering = 1.5 * VOLUME * efficiency / (DIAMETER_UM / 1000.0)
    paint = layer(BINDER, np.round(g, 4), np.zeros(3), scattering, PAINT_MM)
    wax = layer(WAX, 0.0, np.zeros(3), np.zeros(3), WAX_MM)
    return Material("wax-on-paint", CHANNELS, (wax, paint), source=SOURCE)


if __name__ == "__main__":
    FILE.write_text(COMMENT + material().to_toml(), "utf-8")
