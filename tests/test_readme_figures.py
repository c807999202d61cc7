"""The golden figures of the pages against sources that are not the code that printed them.

`test_docs` runs the commands and compares; a fault in the code would change both alike. Here the
same figures are held to MCML's, to published formulas, to a second method of ours, and to numpy and
scipy on the definitions.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from reference_delta_e import delta_e_2000, lab
from scipy import ndimage, signal
from scipy.interpolate import PchipInterpolator
from test_docs import code_blocks

from sssfit.fit import fit_svd
from sssfit.material import Layer, Material
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_burley, simulate_dipole, simulate_exact, simulate_montecarlo
from sssfit.simulate.half_space import diffuse_reflectance

SKIN1 = Layer(1.3, np.zeros(3), np.array([0.032, 0.17, 0.48]), np.array([0.74, 0.88, 1.01]))
SPECULAR = (0.3 / 2.3) ** 2
PITCH = 0.3
HALF, REACH = 71, 140  # pixels: the kernel's, and all of the profile's grid
SIZE = 700  # of the picture
PYTHON, WALK, EXACT = code_blocks("text", "simulate.md")
(INVERSION,) = code_blocks("text", "own-materials.md")
FIT, RENDER = code_blocks("text", "kernels.md")
MCML = Path(__file__).parent / "data" / "mcml_skin1_chicken1_ketchup.npz"
SIGMAS = 4.5


def number_after(words, text):
    """The number that follows some words."""
    return float(re.search(rf"{re.escape(words)} *([-+\d.,e]*\d)", text)[1].replace(",", ""))


def rows_of(text, place=0):
    """Figures of the lines about R, G and B; of several tables, the one in this place."""
    lines = [line for line in text.splitlines() if line.startswith(("R ", "G ", "B "))]
    chosen = lines[3 * place : 3 * place + 3]
    return np.array(
        [[float(each) for each in re.findall(r"-?\d[\d.]*(?:e-\d+)?", line)] for line in chosen]
    )


@pytest.fixture(scope="module")
def exact():
    return simulate_exact(Material("skin1", ("R", "G", "B"), (SKIN1,)))


def mcml(key):
    with np.load(MCML) as data:
        return np.array([float(data[f"skin1_{channel}_{key}"]) for channel in "RGB"])


def test_totals_are_those_of_mcml():
    total, stderr = mcml("total"), mcml("total_se")
    walk, exact = rows_of(WALK), rows_of(EXACT)
    assert np.all(np.abs(walk[:, 0] - total) < SIGMAS * np.hypot(walk[:, 1], stderr))
    assert np.all(np.abs(exact[:, 0] - total) < SIGMAS * stderr)
    assert np.all(np.abs(walk[:, 0] - exact[:, 0]) < SIGMAS * walk[:, 1])
    totals, errors = (
        np.array([float(each) for each in part.split()])
        for part in re.findall(r"\[([\d. ]+)\]", PYTHON)
    )
    assert totals == pytest.approx(walk[:, 0], abs=5e-7)
    assert errors == pytest.approx(walk[:, 1], abs=5e-7)


def test_standard_errors_are_those_of_the_weights():
    """A photon that leaves after k collisions weighs (1 - R_sp) a^k, and its square a^2 in place.

    So E[w^2] = (1 - R_sp) R_d(a^2): the exact solver knows it. The walk's roulette adds little.
    """
    albedo = SKIN1.albedo
    square = (1.0 - SPECULAR) * diffuse_reflectance(albedo**2, 1.3)
    mean = diffuse_reflectance(albedo, 1.3)
    expected = np.sqrt((square - mean**2) / 1e6)
    assert rows_of(WALK)[:, 1] == pytest.approx(expected, rel=5e-3)


def test_the_grid_and_the_energies_follow_from_the_coefficients():
    path_mm = 1.0 / (SKIN1.sigma_a_per_mm + SKIN1.sigma_s_per_mm)
    annuli = np.ceil(32.0 * path_mm.max() / (path_mm.min() / 20.0))
    for text in (WALK, EXACT):
        assert f"{annuli:.0f} annuli of {path_mm.min() / 20.0:.4g} mm" in text
        assert f"to {annuli * path_mm.min() / 20.0:.4g} mm" in text
        assert f"specular reflectance {SPECULAR:.6f}" in text
        reflected, absorbed = rows_of(text)[:, 0], rows_of(text)[:, 2]
        assert SPECULAR + reflected + absorbed == pytest.approx(np.ones(3), abs=2e-6)


def published_albedos(reflectance):
    """Chiang, Kutz, Burley 2016; van de Hulst, as Kulla and Conty 2017 have it.

    The latter is of a medium without a surface: of the light that enters.
    """
    a = reflectance
    chiang = 1.0 - np.exp(-5.09406 * a + 2.61188 * a**2 - 4.31805 * a**3)
    a = reflectance / (1.0 - SPECULAR)
    s = 4.09712 + 4.20863 * a - np.sqrt(9.59217 + 41.6808 * a + 17.7126 * a**2)
    return chiang, 1.0 - s**2


def test_the_inversion_is_right_by_walking_photons():
    """The solver found the albedos; the walk, which shares nothing with it, has what they give."""
    asked = np.array([0.44, 0.23, 0.13])
    found, published = rows_of(INVERSION), rows_of(INVERSION, place=1)
    assert found[:, 0] == pytest.approx(asked, abs=0.0)
    path_mm = np.array([1.3, 0.95, 0.67])
    albedo = found[:, 1]
    assert found[:, 2] == pytest.approx((1.0 - albedo) / path_mm, rel=4e-5)
    assert found[:, 3] == pytest.approx(albedo / path_mm, rel=4e-5)
    assert number_after("could reflect up to", INVERSION) == pytest.approx(1.0 - SPECULAR, abs=1e-6)
    chiang, van_de_hulst = published_albedos(asked)
    assert published[:, 0] == pytest.approx(chiang, abs=6e-7)
    assert published[:, 3] == pytest.approx(van_de_hulst, abs=6e-7)

    albedos = np.concatenate([albedo, published[:, 0], published[:, 3]])
    gives = np.concatenate([asked, published[:, 1], published[:, 4]])
    names = tuple(f"c{k}" for k in range(9))
    layer = Layer(1.3, np.zeros(9), 1.0 - albedos, albedos)
    walk = simulate_montecarlo(Material("nine", names, (layer,)), photons=300_000, seed=2)
    stderr = walk.diffuse_reflectance_stderr
    assert np.all(np.abs(walk.diffuse_reflectance - gives) < SIGMAS * stderr)
    for place in (1, 4):
        error = 100.0 * (published[:, place] / asked - 1.0)
        assert published[:, place + 1] == pytest.approx(error, abs=0.051)


def kernel_of(profile, half, samples=8):
    """Energy of pixels (P, P, C): F's slope over 2 pi r, summed over points in each.

    Near the axis R_d ~ 1/r is no sum of points: pixels within 1.3 mm have 22 times as many, and the
    circle within the middle pixel has its energy by F itself.
    """
    smooth = [PchipInterpolator(profile.r_edges_mm, f) for f in profile.cumulative.T]
    slopes = [f.derivative() for f in smooth]

    def energies(size, count):
        at = (np.arange((2 * size + 1) * count) + 0.5) / count - (size + 0.5)
        x = PITCH * at
        r = np.hypot(x[size * count :, None], x)  # the rows above are those below
        density = np.stack([slope(r) for slope in slopes], axis=-1) / (2.0 * np.pi * r[..., None])
        density[r < 0.5 * PITCH] = 0.0
        blocks = density.reshape(size + 1, count, 2 * size + 1, count, -1)
        below = blocks.sum(axis=(1, 3)) * (PITCH / count) ** 2
        return np.concatenate((below[:0:-1], below))

    kernel = energies(half, samples)
    near, fine = 4, energies(4, 180)
    fine[near, near] += [f(0.5 * PITCH) for f in smooth]
    middle = slice(half - near, half + near + 1)
    kernel[middle, middle] = fine
    return kernel


@pytest.fixture(scope="module")
def true_kernel(exact):
    return kernel_of(exact, REACH)


def test_errors_of_the_fit_are_those_of_numpys_eigenvalues(exact, true_kernel):
    printed = rows_of(FIT)
    support = exact.r_edges_mm[
        np.argmax((exact.cumulative >= 0.999 * exact.cumulative[-1]).all(axis=1))
    ]
    pixels = 2 * int(support / PITCH) + 1
    assert pixels == 2 * HALF + 1
    assert f"skin1: svd, 3 terms, {pixels} pixels of {PITCH} mm" in FIT
    assert FIT.count(f"the largest 3 of {(pixels + 1) // 2} eigenvalues") == 3
    for c, (frobenius, energy_error, energy, *_) in enumerate(printed):
        within = slice(REACH - HALF, REACH + HALF + 1)
        kernel = true_kernel[within, within, c]
        values, vectors = np.linalg.eigh(kernel)
        largest = np.argsort(-np.abs(values))[:3]
        truncated = (vectors[:, largest] * values[largest]) @ vectors[:, largest].T
        fitted = truncated * exact.diffuse_reflectance[c] / truncated.sum()
        error = 100.0 * np.linalg.norm(fitted - kernel) / np.linalg.norm(kernel)
        # Printed to three digits; the program's pixels are of flat annuli.
        assert frobenius == pytest.approx(error, rel=0.005)
        assert energy_error == 0.0
        assert energy == pytest.approx(rows_of(EXACT)[c, 0], abs=1e-9)


def test_the_rendering_is_scipys(exact, true_kernel):
    scene = make_scene("head", height=SIZE, width=SIZE, mm_per_pixel=PITCH)
    kernel = fit_svd(exact, rank=3, mm_per_pixel=PITCH).kernel
    light = scene.irradiance[:, :, 0]
    around = np.pad(light, REACH, mode="symmetric")
    inside = scene.mask > 0
    truth, picture = np.empty((SIZE, SIZE, 3)), np.zeros((SIZE, SIZE, 3))
    for c in range(3):
        truth[:, :, c] = signal.fftconvolve(around, true_kernel[:, :, c], mode="valid")
        for sign, weights in zip(kernel.signs[:, c], kernel.weights[:, :, c], strict=True):
            across = ndimage.correlate1d(light, weights, axis=1, mode="reflect")
            picture[:, :, c] += sign * ndimage.correlate1d(across, weights, axis=0, mode="reflect")
    difference = (picture - truth)[inside]
    rmse = np.sqrt(np.mean(difference**2))
    norm = np.sqrt(np.mean(truth[inside] ** 2))
    assert number_after("RMSE", RENDER) == pytest.approx(rmse, rel=0.02)
    assert number_after("relative L2", RENDER) == pytest.approx(100.0 * rmse / norm, rel=0.03)
    assert number_after("largest", RENDER) == pytest.approx(np.abs(difference).max(), rel=0.02)
    psnr = 20.0 * np.log10(truth[inside].max() / rmse)
    assert number_after("PSNR", RENDER) == pytest.approx(psnr, abs=0.1)
    moved = 8 * (4 * 3 + 2)  # in half floats: two passes a term, each reads and writes; two add
    assert f"{2 * 3 * 143} weights and {moved} bytes moved a pixel in {2 * 3} passes" in RENDER
    assert f"{3 * 143 * 3 * 4:,} bytes stored" in RENDER

    exposure = number_after("at exposure", RENDER)
    some = np.random.default_rng(1).choice(np.flatnonzero(inside), 3000, replace=False)
    shown = (np.clip(exposure * each.reshape(-1, 3)[some], 0.0, 1.0) for each in (picture, truth))
    errors = np.array([delta_e_2000(lab(a), lab(b)) for a, b in zip(*shown, strict=True)])
    mean, stderr = errors.mean(), errors.std() / np.sqrt(errors.size)
    assert abs(number_after("Delta E 2000 mean", RENDER) - mean) < SIGMAS * stderr
    # The share above a printed percentile is what it says, within its binomial error.
    for words, share in (("95th percentile", 0.05), ("99th", 0.01)):
        above = np.mean(errors > number_after(words, RENDER))
        assert abs(above - share) < SIGMAS * np.sqrt(share * (1.0 - share) / errors.size)


def test_what_models_put_at_the_wrong_radius(exact):
    page = (Path(__file__).parents[1] / "docs" / "simulate.md").read_text(encoding="utf-8")
    page = " ".join(page.split())
    skin1 = Material("skin1", ("R", "G", "B"), (SKIN1,))
    for model, words in (
        (simulate_dipole, "by the classical dipole is off by {:.0f} to {:.0f} % of skin1's light"),
        (simulate_burley, "although it uses the true total, by {:.0f} to {:.0f} %"),
    ):
        away = np.abs(model(skin1).cumulative - exact.cumulative).max(axis=0)
        share = 100.0 * away / exact.diffuse_reflectance
        assert words.format(share.min(), share.max()) in page
