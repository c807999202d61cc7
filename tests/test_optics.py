"""One Fresnel and one quadrature, against the scalar formulas and the compiled walk's."""

import re
from pathlib import Path

import numpy as np
import pytest
import reference
from scipy.integrate import quad

from sssfit._jit import sampling
from sssfit.material import Layer, Material
from sssfit.optics import (
    fresnel_reflectance,
    fresnel_transmittance,
    gauss_legendre,
    is_matched,
    normal_reflectance,
    normal_transmittance,
)

ETAS = [0.5, 0.75, 0.999, 1.0, 1.0 + 1e-10, 1.0001, 1.3, 1.4, 1.5, 2.5, 4.0]
COSINES = np.concatenate(([0.0, 1e-12, 1e-6], np.linspace(0.001, 1.0, 500)))


@pytest.mark.parametrize("eta", ETAS)
def test_reflectance_is_that_of_the_compiled_walk_and_of_the_scalar_formulas(eta):
    # A cosine whose square is lost beside 1 is 0 for the walk, which then reflects all, though two
    # media of one index reflect nothing; no photon comes so flat.
    cosines = COSINES[3:] if is_matched(eta) else COSINES
    ours = fresnel_reflectance(cosines, eta)
    walk = np.array([sampling.fresnel_reflectance(float(each), eta) for each in cosines])
    # Under 1e-9 from 1 there is no surface for us; the walk's reflects 2.5e-9 at a cosine of .001.
    scatter = 1e-8 if is_matched(eta) else 1e-15 + _rounding(cosines, eta)
    assert np.all(np.abs(ours - walk) <= scatter)
    if eta >= 1.0:
        scalar = np.array([reference.fresnel(float(each), eta) for each in cosines])
        assert np.all(np.abs(ours - scalar) <= scatter)


def _rounding(cosine, eta):
    """What the last bits of m^2 = 1 - eta^2 (1 - mu^2) make of R: dR = |dR/dm| dm, dm = eps / m.

    R = 1 - 4 mu m / (mu + m)^2 near the critical angle; there |dR/dm| <= 4 mu / (mu + m)^2.
    """
    outside = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - cosine**2), 1e-16))
    return 8.0 * np.finfo(float).eps * eta**2 * (1.0 + cosine / (cosine + outside) ** 2 / outside)


@pytest.mark.parametrize("eta", [1.0001, 1.4, 2.5])
def test_transmittance_keeps_its_digits_at_the_critical_angle(eta):
    """Nearly nothing gets out there: 4 eta mu m / (eta mu)^2 and 4 m / mu to first order in m."""
    outside = 1e-9
    cosine = np.sqrt(1.0 - (1.0 - outside**2) / eta**2)
    first_order = 2.0 * outside * (1.0 / (eta * cosine) + eta / cosine)
    exact = fresnel_transmittance(cosine, eta)
    # 1 - eta^2 (1 - mu^2) itself has only its rounding left there, hence the m that it gives.
    seen = np.sqrt(max(1.0 - eta**2 * (1.0 - cosine**2), 0.0))
    assert exact == pytest.approx(first_order * seen / outside, rel=1e-4)


@pytest.mark.parametrize("eta", [1.2, 1.4, 2.5])
def test_all_is_reflected_beyond_the_critical_angle_and_brewster_halves_the_rest(eta):
    critical = np.sqrt(1.0 - 1.0 / eta**2)
    beyond = fresnel_reflectance([0.0, 0.5 * critical, 0.999 * critical], eta)
    assert np.array_equal(beyond, [1.0] * 3)
    # At Brewster's angle, tan(theta) = 1 / eta from inside, no p-polarised light is reflected:
    # R = ((eta^2 - 1) / (eta^2 + 1))^2 / 2.
    cosine = eta / np.sqrt(1.0 + eta**2)
    expected = 0.5 * ((eta**2 - 1.0) / (eta**2 + 1.0)) ** 2
    assert fresnel_reflectance(cosine, eta) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("eta", ETAS)
def test_normal_incidence_is_the_formula_at_cosine_one_and_the_materials(eta):
    here = normal_reflectance(eta)
    assert here == pytest.approx(float(fresnel_reflectance(1.0, eta)), abs=1e-15)
    assert here == pytest.approx(sampling.fresnel_reflectance(1.0, eta), abs=1e-15)
    assert here == pytest.approx(normal_reflectance(1.2 * eta, 1.2), abs=1e-15)
    assert normal_transmittance(eta) == 1.0 - normal_reflectance(eta)
    one = Material("m", ("Y",), (Layer(eta, 0.0, [0.1], [1.0]),))
    assert one.specular_reflectance == normal_reflectance(eta)


@pytest.mark.parametrize(("start", "end"), [(0.0, 1.0), (-1.0, 1.0), (-0.5, 0.5), (2.0, 7.5)])
def test_quadrature_is_exact_up_to_twice_its_nodes(start, end):
    for count in (1, 2, 7, 40):
        x, w = gauss_legendre(count, start, end)
        assert x.shape == w.shape == (count,)
        for power in {0, 1, count, 2 * count - 1}:
            exact = (end ** (power + 1) - start ** (power + 1)) / (power + 1)
            scale = max(abs(start), abs(end)) ** (power + 1)
            assert w @ x**power == pytest.approx(exact, abs=2e-14 * scale * max(count, 4))
    x, w = gauss_legendre(40, start, end)
    assert w @ np.exp(x) == pytest.approx(quad(np.exp, start, end, epsabs=0)[0], rel=1e-13)


def test_there_is_no_other_fresnel_and_no_other_quadrature():
    root = Path(__file__).parents[1] / "sssfit"
    written = re.compile(r"leggauss|eta - 1(\.0)?\) / \(|\(eta \* \w+ - \w+\) / ")
    found = {
        path.relative_to(root).as_posix()
        for path in root.rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if written.search(line.partition("#")[0])
    }
    assert found - {"simulate/half_space.py"} == {"optics.py", "_jit/sampling.py"}
