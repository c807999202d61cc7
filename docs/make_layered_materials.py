"""Write materials/layered/: skin, leaf, milk on glass and cream on coffee, from published formulas.

python docs/make_layered_materials.py

A channel is one wavelength, the multiple of 10 nm next to the dominant wavelength of its BT.709
primary (611.4, 549.1 and 464.2 nm). Skin is made from Jacques's formulas and Prahl's table. A leaf
is the slab that has the reflectance and transmittance of PROSPECT-D, so it needs the exact solver.
"""

import dataclasses
import math

import numpy as np
from scipy.special import exp1
from sections import DOCS

from sssfit.material import Layer, Material, load_material
from sssfit.optics import fresnel_transmittance, gauss_legendre
from sssfit.simulate import simulate_exact

FOLDER = DOCS.parent / "materials" / "layered"
CHANNELS = ("R", "G", "B")
NM = np.array([610.0, 550.0, 460.0])
PER_MM = 0.1  # of 1/cm

# S. Prahl, "Tabulated molar extinction coefficient for hemoglobin in water", OMLC: 1/cm per mol/l.
OXYHAEMOGLOBIN = np.array([1506.0, 43016.0, 44480.0])
DEOXYHAEMOGLOBIN = np.array([9443.6, 53412.0, 23388.8])
SATURATION = 0.75
GRAMS_PER_LITRE, GRAMS_PER_MOL = 150.0, 64_500.0

MELANIN = (0.01, 0.04, 0.12, 0.25, 0.40)
EPIDERMIS_MM, DERMIS_MM, SKIN_ETA = 0.06, 1.5, 1.4
PALE, FLUSHED, PORT_WINE = 0.002, 0.02, 0.07

SKIN = """\
# Channels R, G, B are the wavelengths 610, 550 and 460 nm.
# S. L. Jacques, "Skin optics", Oregon Medical Laser Center News, January 1998, in 1/cm and nm:
#   melanosomes 6.6e11 nm^-3.33, skin without blood or melanin .244 + 85.3 exp(-(nm - 154)/66.2),
#   sigma_s' 2e5 nm^-1.5 + 2e12 nm^-4, epidermis .06 mm.
# Blood: S. Prahl's table of molar extinction, 150 g/l, 64 500 g/mol, 75 % oxygenated, the
#   saturation of Donner and Jensen 2006, "A spectral BSSRDF for shading human skin".
# g = .62 + 2.9e-4 nm: M. J. C. van Gemert et al. 1989, "Skin optics", IEEE Transactions on
#   Biomedical Engineering 36. sigma_s = sigma_s' / (1 - g).
# Assumed: the epidermis scatters as the dermis does, and both have the index 1.4.
"""
FAT = """\
# Fat: sigma_s' 18.4 (nm/500)^-.672 per cm, "fatty tissue" in table 2 of S. L. Jacques 2013,
#   "Optical properties of biological tissues: a review", Physics in Medicine and Biology 58.
# Assumed: the dermis is 1.5 mm thick; fat has the skin's absorption without blood, and its g.
# Index of fat: 1.44, assumed as well.
"""
LEAF = """\
# Channels R, G, B are the wavelengths 610, 550 and 460 nm.
# J.-B. Feret et al. 2017, "PROSPECT-D", Remote Sensing of Environment 193: reflectance and
# transmittance for N = {n:g}, chlorophyll {cab:g}, carotenoids {car:g} and anthocyanins {ant:g}
# ug/cm^2, brown pigments {brown:g}, water {water:g} cm, dry matter {dry:g} g/cm^2.
# The coefficients are those of the slab of .2 mm with smooth faces, index 1.47 and g = 0 that
# has the same reflectance, specular part included, and transmittance
# (docs/make_layered_materials.py). Thickness and g are assumed.
"""
MILK = """\
# {name} as in Jensen et al. 2001 (materials/{name}.toml): reduced coefficients, hence g = 0.
# Assumed: a film of 2 mm on 3 mm of clear soda-lime glass, index 1.52, with air below.
"""
CREAM = """\
# Cream as in Jensen et al. 2001 (reduced coefficients, hence g = 0; materials/cream.toml), on
# espresso as in Narasimhan et al. 2006 (materials/espresso.toml). Assumed: 2 mm of cream.
"""
MARBLE = """\
# Marble as in Jensen et al. 2001 (reduced coefficients, hence g = 0; materials/marble.toml).
# Assumed: a tile of 10 mm with air on both sides.
"""


# Skin


def blood_per_mm():
    """Return the absorption of whole blood, (3,), in 1/mm."""
    molar = SATURATION * OXYHAEMOGLOBIN + (1.0 - SATURATION) * DEOXYHAEMOGLOBIN
    return math.log(10.0) * molar * GRAMS_PER_LITRE / GRAMS_PER_MOL * PER_MM


def bloodless_per_mm():
    """Return the absorption of skin without blood and melanin, (3,), in 1/mm."""
    return (0.244 + 85.3 * np.exp(-(NM - 154.0) / 66.2)) * PER_MM


def melanin_per_mm():
    """Return the absorption within melanosomes, (3,), in 1/mm."""
    return 6.6e11 * NM**-3.33 * PER_MM


def g_of_skin():
    """Return the mean cosine of skin, (3,)."""
    return np.round(0.62 + 29e-5 * NM, 4)


def skin_layer(absorber, share, thickness_mm):
    """Return a layer of skin that holds this share of an absorber, (3,) in 1/mm, by volume."""
    reduced = (2e5 * NM**-1.5 + 2e12 * NM**-4.0) * PER_MM
    sigma_a = share * absorber + (1.0 - share) * bloodless_per_mm()
    g = g_of_skin()
    return layer(SKIN_ETA, g, sigma_a, reduced / (1.0 - g), thickness_mm)


def fat_layer():
    """Return subcutaneous fat without end."""
    g = g_of_skin()
    reduced = 18.4 * (NM / 500.0) ** -0.672 * PER_MM
    return layer(1.44, g, bloodless_per_mm(), reduced / (1.0 - g), math.inf)


def skins():
    """Yield name, source line, comment and layers of each skin."""
    for melanin in MELANIN:
        name = f"skin-melanin-{round(100 * melanin):02d}"
        for ending, blood in (("", PALE), ("-flushed", FLUSHED)):
            yield name + ending, *_skin(melanin, blood, on_fat=False)
        if 0.01 < melanin < 0.4:
            yield f"{name}-fat", *_skin(melanin, PALE, on_fat=True)
    yield "skin-port-wine", *_skin(0.04, PORT_WINE, on_fat=False)


def _skin(melanin, blood, *, on_fat):
    """Return source line, comment and layers of skin with these shares of melanosomes and blood."""
    layers = [
        skin_layer(melanin_per_mm(), melanin, EPIDERMIS_MM),
        skin_layer(blood_per_mm(), blood, DERMIS_MM if on_fat else math.inf),
    ]
    what = f"# Epidermis with {100 * melanin:g} % melanosomes, dermis with {100 * blood:g} % blood"
    if not on_fat:
        return "Jacques 1998, Prahl's haemoglobin", f"{what}.\n{SKIN}", layers
    return (
        "Jacques 1998 and 2013, Prahl's haemoglobin",
        f"{what}, fat.\n{SKIN}{FAT}",
        [*layers, fat_layer()],
    )


# Leaves

# Columns: refractive index; specific absorption of chlorophyll, carotenoids and anthocyanins
# (cm^2/ug), brown pigments, water (1/cm) and dry matter (cm^2/g) at 610, 550 and 460 nm, from the
# table that its authors publish with PROSPECT-D.
PROSPECT = np.array(
    [
        [1.4533, 2.31769e-2, 0.0, 1.28011e-2, 0.2463, 2.691e-3, 2.300],
        [1.4739, 9.30939e-3, 4.18898e-3, 6.81398e-2, 0.3511, 5.88e-4, 2.300],
        [1.4937, 4.38733e-2, 0.151672, 4.88393e-2, 0.4608, 1.24e-4, 4.575],
    ]
)
_AMOUNTS = ("n", "cab", "car", "ant", "brown", "water", "dry")  # plates; the units are in LEAF
LEAVES = {
    "leaf-green": dict(zip(_AMOUNTS, (1.5, 40, 8, 0, 0, 0.01, 0.008), strict=True)),
    "leaf-young": dict(zip(_AMOUNTS, (1.3, 15, 4, 0, 0, 0.01, 0.004), strict=True)),
    "leaf-autumn": dict(zip(_AMOUNTS, (1.8, 2, 8, 3, 0.3, 0.004, 0.008), strict=True)),
}
LEAF_MM, LEAF_ETA = 0.2, 1.47


def leaf_light(*, n, **amounts):
    """Return reflectance and transmittance, (3,) each, of a leaf by PROSPECT.

    ``n`` plates, as Jacquemoud and Baret 1990 write them (Remote Sensing of Environment 34),
    and Stokes's equations for a number that is not whole.
    """
    index, absorption = PROSPECT[:, 0], PROSPECT[:, 1:]
    k = absorption @ [amounts[key] for key in ("cab", "car", "ant", "brown", "water", "dry")] / n
    tau = (1.0 - k) * np.exp(-k) + k**2 * exp1(k)
    first, diffuse = (np.array([interface(angle, m) for m in index]) for angle in (40.0, 90.0))
    back = diffuse / index**2
    r21 = 1.0 - back
    inside = 1.0 - (r21 * tau) ** 2
    top_t = first * tau * back / inside
    top_r = 1.0 - first + r21 * tau * top_t
    t = diffuse * tau * back / inside
    r = 1.0 - diffuse + r21 * tau * t
    root = np.sqrt((1 + r + t) * (1 + r - t) * (1 - r + t) * (1 - r - t))
    a = (1 + r**2 - t**2 + root) / (2 * r)
    b = ((1 - r**2 + t**2 + root) / (2 * t)) ** (n - 1)
    below = a**2 * b**2 - 1
    rest_r, rest_t = a * (b**2 - 1) / below, b * (a**2 - 1) / below
    shared = 1.0 - rest_r * r
    return top_r + top_t * rest_r * t / shared, top_t * rest_t / shared


def interface(degrees, index):
    """Return the transmittance into an index for light from within a cone of this half-angle."""
    sin2, weight = gauss_legendre(400, 0.0, math.sin(math.radians(degrees)) ** 2)
    into = fresnel_transmittance(np.sqrt(1.0 - sin2 / index**2), index)
    return float(weight @ into / weight.sum())


def leaf_layer(reflectance, transmittance):
    """Return the slab that has these totals, (3,) each, by Newton's method for all channels."""
    x = np.log(np.tile([[0.2], [8.0]], (1, 3)))  # sigma_a and sigma_s per mm
    for _ in range(40):
        found = slab_light(x)
        miss = np.array([reflectance, transmittance]) - found
        if np.abs(miss).max() < 1e-6:
            return slab(x)
        step = 1e-4
        slopes = [(slab_light(x + step * row) - found) / step for row in np.eye(2)[:, :, None]]
        for c in range(3):
            jacobian = np.array([slope[:, c] for slope in slopes]).T
            x[:, c] += np.clip(np.linalg.solve(jacobian, miss[:, c]), -0.7, 0.7)
    raise SystemExit(f"no slab found: {miss}")


def slab(x):
    """Return the slab of these logarithms of coefficients, (2, 3)."""
    return Layer(LEAF_ETA, 0.0, *np.exp(x), thickness_mm=LEAF_MM)


def slab_light(x):
    """Return its reflectance, specular part included, and its transmittance, (2, 3)."""
    material = Material("leaf", CHANNELS, (slab(x),))
    profile = simulate_exact(material, dr_mm=0.05, radius_mm=5.0)
    return np.array(
        [profile.diffuse_reflectance + material.specular_reflectance, profile.transmittance]
    )


def leaves():
    """Yield name, source line, comment and layers of each leaf."""
    for name, amounts in LEAVES.items():
        found = leaf_layer(*leaf_light(**amounts))
        layers = [layer(found.eta, found.g, found.sigma_a_per_mm, found.sigma_s_per_mm, LEAF_MM)]
        yield name, "PROSPECT-D, Feret et al. 2017", LEAF.format(**amounts), layers


# Films and tiles


def films():
    """Yield name, source line, comment and layers of what is made from shipped materials."""
    glass = Layer(1.52, 0.0, [0.0] * 3, [0.0] * 3, thickness_mm=3.0)
    for milk in ("wholemilk", "skimmilk"):
        yield (
            f"{milk}-on-glass",
            "Jensen et al. 2001",
            MILK.format(name=milk),
            [of(milk, 2.0), glass],
        )
    source = "Jensen et al. 2001, Narasimhan et al. 2006"
    yield "cream-on-espresso", source, CREAM, [of("cream", 2.0), of("espresso", math.inf)]
    yield "marble-tile", "Jensen et al. 2001", MARBLE, [of("marble", 10.0)]


def of(name, thickness_mm):
    """Return the layer of a shipped material in this thickness."""
    return dataclasses.replace(load_material(name).layers[0], thickness_mm=thickness_mm)


def layer(eta, g, sigma_a, sigma_s, thickness_mm):
    """Return a layer whose coefficients have five digits, as the files do."""
    five = (np.array([float(f"{each:.5g}") for each in of]) for of in (sigma_a, sigma_s))
    return Layer(eta, g, *five, thickness_mm=thickness_mm)


def files():
    """Yield the name and the text of each file."""
    for make in (skins, leaves, films):
        for name, source, comment, layers in make():
            material = Material(name, CHANNELS, tuple(layers), source=source)
            yield f"{name}.toml", comment + material.to_toml()


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, text in files():
        (FOLDER / name).write_text(text, "utf-8")
        print(name)
