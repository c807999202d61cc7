"""The depth integral equation of a half space, for one wavenumber along the surface.

Lengths are in mean free paths, scattering is isotropic, and a is the albedo. The first collisions
of a pencil beam have the density C0(z) = (1 - R_sp) exp(-z) on the axis. After a Fourier transform
along the surface, with wavenumber k, all collisions obey

    C(z) = C0(z) + a int_0^inf [K_d(|z - z'|) + K_r(z + z')] C(z') dz'

    K_d(d) = 1/2 int_{w0}^inf exp(-d tau(w)) dw,   tau = (e^w + k^2 e^-w)/2,  e^w0 = 1 + kappa
    K_r(s) = K_d(s) - X(s)          off the surface, like a mirror
    X(s)   = 1/2 int_{mu_c}^1 (1 - R_F) exp(-s/mu) J0(k s tan(theta)) dmu/mu
    E(z)   = 1/2 int_{mu_c}^1 (1 - R_F) exp(-z/mu) J0(k z tan(theta)) dmu

with kappa = sqrt(1 + k^2), and a int C(z) E(z) dz escapes. Four methods keep the matrix small:

- panels graded towards the surface, polynomials on them, and product quadrature for the logarithm
  of K_d at 0 (``sssfit._jit.transport``);
- K_d and X depend on one distance only, so they are tabulated;
- deeper than about 25 mean free paths C falls like exp(-nu z), nu^2 = k^2 + lambda^2 with Case's a
  artanh(lambda) = lambda: the integral over that tail is 1/2 int exp(-d tau) / (tau + nu) dw, so
  that no albedo, not even 1, needs deeper panels;
- the matrix does not depend on the albedo: all channels of one refractive index share it.

K_r and the contribution of the critical angle to E fall like (k s tan(theta_c))^-2 and are
neglected beyond ``Resolution.phase`` radians.
"""

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sssfit._jit.depth_matrix import Tables, kernel_matrix
from sssfit.arrays import FloatArray
from sssfit.optics import Cone, gauss_legendre, is_matched, lagrange_shares, normal_transmittance

# Depth of the last panel: components that do not fall like exp(-nu z) are exp(-26) = 5e-12 there.
_DEPTH = 26.0
_WIDEST = 2.5  # panel: C0 = exp(-z) needs it
_NOTHING = 360.0  # kappa d: exp(-360) is 0 beside all else, and larger ones might overflow
_BEYOND = 40.0  # exp(-40) = 4e-18: tables end here
# Largest size of the table of X: the finest resolutions need more for any index, that of usual
# tolerances for those under 1.0006.
_MAX_ENTRIES = 40_000
_AT_ONCE = 128  # distances times some 100 nodes: arrays that stay in the cache
# Of a table's entries one in five is computed and the others are interpolated, from twelve.
_COARSER, _NEIGHBOURS = 5, np.arange(-5, 7)
_SMOOTH = 0.0601  # largest step of X for that, in radians and mean free paths: the coarsest's
_OfTau = Callable[[FloatArray, FloatArray], FloatArray | float]
_STRETCHES, _PER_STRETCH = 14, 8  # Gauss nodes over w; 14 times 8 give K_d to 1e-12


@dataclass(frozen=True, slots=True)
class Resolution:
    """Resolution of the solution of the depth equation.

    ``order`` is the number of polynomial nodes per panel; ``first`` the width of the first panel
    [1/kappa]; ``ratio`` the growth of the next ones; ``rule`` the number of Gauss nodes of the
    product quadrature; ``step`` that of the table of X, in radians and mean free paths;
    ``directions`` the number of directions in the escape cone; ``phase`` [rad] the largest argument
    of J0 that is resolved.
    """

    order: int
    first: float
    ratio: float
    rule: int
    step: float
    directions: int
    phase: float


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Energies for one wavenumber, by albedo (A,): multiply scattered and escaped; absorbed."""

    multiple: FloatArray
    absorbed: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Panels:
    """Graded panels (P) of Gauss nodes (P, p)."""

    edges: FloatArray
    nodes: FloatArray
    weights: FloatArray
    barycentric: FloatArray
    last_value: FloatArray  # (p,): gives a panel's polynomial at its lower end from its node values


@functools.lru_cache(maxsize=256)  # each wavenumber asks for those of all albedos again
def decay_rate(albedo: float) -> float:
    """Return lambda of a artanh(lambda) = lambda, in [0, 1] (Case and Zweifel 1967, eq. 4.2.10).

    Deep inside a medium with that albedo, light falls like exp(-lambda z), z in mean free paths.
    """
    if albedo <= 0.05:
        return 1.0  # 1 - lambda = 2 exp(-2/a) < 1e-17
    if albedo >= 1.0:
        return 0.0
    if albedo > 1.0 - 1e-6:
        return math.sqrt(3.0 * (1.0 - albedo))  # the next term is 1 - albedo smaller

    from scipy import optimize  # 0.2 s that the photon walk does not need

    def excess(t: float) -> float:  # lambda = 1 - exp(t): artanh is (log(2 - exp(t)) - t) / 2
        return 0.5 * albedo * (math.log(2.0 - math.exp(t)) - t) + math.expm1(t)

    return -math.expm1(float(optimize.brentq(excess, -41.0, math.log1p(-1e-4), xtol=1e-15)))


def respond(k: float, eta: float, albedos: FloatArray, resolution: Resolution) -> Response:
    """Solve the depth equation for one wavenumber and any number of albedos.

    Parameters
    ----------
    k : float [1/MFP]
        Wavenumber, at least 0.
    eta : float
        Relative refractive index, at least 1.
    albedos : (A,)
        0 to 1.
    resolution : Resolution

    Returns
    -------
    Response
        For a beam of energy 1 along the normal.
    """
    equation = _Equation.of(k, eta, resolution) if k > 0.0 else _of_all_light(eta, resolution)
    return equation.solve(
        normal_transmittance(eta) * np.exp(-equation.panels.nodes.ravel()), albedos
    )


def respond_to_diffuse_light(eta: float, albedos: FloatArray, resolution: Resolution) -> Response:
    """Solve the depth equation for light of equal radiance from all directions above.

    Parameters are those of `respond`. Light of radiance 1/pi brings energy 1 to a unit of area.
    Inside, within the cone, it is eta^2 (1 - R_F)/pi, so its first collisions have the density 4
    eta^2 E(z) (docs/theory.md).
    """
    equation = _of_all_light(eta, resolution)
    return equation.solve(4.0 * eta**2 * equation.escape, albedos)


@dataclass(frozen=True, slots=True, eq=False)
class _Equation:
    """The depth equation for one wavenumber and index on its nodes (N), for any incident light.

    ``escape`` (N,) is E at the nodes, ``matrix`` (N, N) the integral over K_d + K_r on the panels.
    """

    wavenumber: float
    panels: _Panels
    escape: FloatArray
    matrix: FloatArray

    @classmethod
    def of(cls, k: float, eta: float, resolution: Resolution) -> "_Equation":
        """Set up the equation."""
        panels = _panels(math.sqrt(1.0 + k * k), resolution)
        escape, tables = _tables(k, eta, panels, resolution)
        matrix = kernel_matrix(
            panels.edges,
            panels.nodes,
            panels.weights,
            panels.barycentric,
            np.stack(gauss_legendre(resolution.rule), axis=1),
            math.sqrt(1.0 + k * k),
            is_matched(eta),
            tables,
        )
        return cls(k, panels, escape, matrix)

    def solve(self, first: FloatArray, albedos: FloatArray) -> Response:
        """Solve for a density (N,) of first collisions, which falls at least like exp(-z)."""
        panels, k = self.panels, self.wavenumber
        z, weights = panels.nodes.ravel(), panels.weights.ravel()
        order = panels.last_value.size
        multiple, absorbed = np.empty(len(albedos)), np.empty(len(albedos))
        rates = [math.hypot(k, decay_rate(each)) for each in albedos]
        tails = _tails(panels.edges[-1] - z, k, rates)
        for i, (albedo, nu, tail) in enumerate(zip(albedos, rates, tails, strict=True)):
            system = np.eye(z.size) - albedo * self.matrix
            system[:, -order:] -= albedo * np.outer(tail, panels.last_value)
            density = np.linalg.solve(system, first)
            deepest = float(panels.last_value @ density[-order:])
            deep = deepest * (1.0 - albedo) / nu if nu > 0.0 else 0.0
            multiple[i] = albedo * np.sum(weights * (density - first) * self.escape)
            absorbed[i] = (1.0 - albedo) * np.sum(weights * density) + deep
        return Response(multiple, absorbed)


# An inversion asks for the total of ten sets of albedos: set up once, it takes a fifth of the time.
@functools.lru_cache(maxsize=4)  # of .7 MB each
def _of_all_light(eta: float, resolution: Resolution) -> _Equation:
    """Return the equation for wavenumber 0, which gives totals."""
    return _Equation.of(0.0, eta, resolution)


def _panels(kappa: float, resolution: Resolution) -> _Panels:
    """Lay panels from the surface down; the first few resolve 1/kappa, the reach of K_d."""
    edges = [0.0, resolution.first / kappa]
    while edges[-1] < _DEPTH:
        edges.append(edges[-1] + min(_WIDEST, edges[-1] * (resolution.ratio - 1.0)))
    x, w = gauss_legendre(resolution.order, -1.0, 1.0)
    width = np.diff(edges)[:, None]
    # Barycentric weights of Gauss nodes: (-1)^j sqrt((1 - x^2) w) (Berrut and Trefethen 2004).
    signs = np.where(np.arange(x.size) % 2, -1.0, 1.0)
    barycentric: FloatArray = signs * np.sqrt((1.0 - x * x) * w)
    at_end: FloatArray = barycentric / (1.0 - x)
    nodes: FloatArray = np.array(edges[:-1])[:, None] + 0.5 * width * (x + 1.0)
    return _Panels(
        np.array(edges),
        nodes,
        0.5 * width * w,
        barycentric,
        at_end / at_end.sum(),
    )


def _tables(
    k: float, eta: float, panels: _Panels, resolution: Resolution
) -> tuple[FloatArray, Tables]:
    """Return E at the nodes and the tables of K_d and X."""
    kappa = math.hypot(1.0, k)
    shortest = 1e-9 * panels.nodes[0, 0]  # nearer sources contribute 1e-9 log(1e-9) of a panel
    per_log = 3.0 / resolution.step
    entries = int(math.log(_BEYOND / kappa / shortest) * per_log) + 4
    direct = _tabulated(
        lambda at: _integrate_over_w(shortest * np.exp(at / per_log), k, lambda *_: 1.0)[0],
        entries,
        _COARSER,
    )
    z = panels.nodes.ravel()
    if is_matched(eta):
        return _matched_escape(z, k), (direct, math.log(shortest), per_log, np.zeros(4), 1.0)
    cone = Cone.of(eta, resolution.directions)
    steepest = float(cone.tangent[0])
    reach = min(_BEYOND, resolution.phase / (k * steepest)) if k > 0.0 else _BEYOND
    rate = 1.0 / float(cone.cosine[0]) + k * steepest
    step = max(resolution.step / rate, reach / _MAX_ENTRIES)
    escape_table = _tabulated(
        lambda at: _over_cone(step * at, k, cone, cone.weight / cone.cosine),
        int(reach / step) + 4,
        _COARSER if step * rate <= _SMOOTH else 1,
    )
    near = z <= reach
    escape = np.empty_like(z)
    escape[near] = _over_cone(z[near], k, cone, cone.weight)
    escape[~near] = _matched_escape(z[~near], k)
    return escape, (direct, math.log(shortest), per_log, escape_table, 1.0 / step)


def _tabulated(
    function: Callable[[FloatArray], FloatArray], entries: int, apart: int
) -> FloatArray:
    """Return a smooth function at 0, 1, .. entries - 1, computed at places this far apart.

    The polynomials between them go through twelve, five of which may lie below 0. With the coarsest
    resolution they are off by 2e-11, with the next by 1e-14.
    """
    if apart == 1:
        return function(np.arange(entries, dtype=float))
    coarse = -(-entries // apart)
    known = function(apart * np.arange(_NEIGHBOURS[0], coarse + _NEIGHBOURS[-1], dtype=float))
    parts = np.lib.stride_tricks.sliding_window_view(known, _NEIGHBOURS.size) @ _shares(apart)
    return np.ascontiguousarray(parts.ravel()[:entries])


@functools.cache  # computed for each table, they took a tenth of the solver's time
def _shares(apart: int) -> FloatArray:
    """Return the weights of twelve computed entries in each from one to before the next."""
    return lagrange_shares(_NEIGHBOURS, np.arange(apart) / apart)


def _over_cone(distances: FloatArray, k: float, cone: Cone, weight: FloatArray) -> FloatArray:
    """Return 1/2 int weight exp(-s/mu) J0(k s tan(theta)) over the cone, (n,)."""
    from scipy import special  # 0.2 s, as above

    integral = np.empty_like(distances)
    for block in _blocks(distances.size):
        along = distances[block, None]
        paths = np.exp(-along / cone.cosine) * special.j0(k * along * cone.tangent)
        integral[block] = 0.5 * (paths @ weight)
    return integral


def _blocks(count: int) -> Iterator[slice]:
    """Cut ``count`` distances into parts: whole, the integral over w took 5 times as long."""
    return (slice(first, first + _AT_ONCE) for first in range(0, count, _AT_ONCE))


def _matched_escape(z: FloatArray, k: float) -> FloatArray:
    """Return E without a surface: z/2 int (p - 1) exp(-tau z) dw, p = sqrt(tau^2 - k^2), (n,)."""
    found: FloatArray = z * _integrate_over_w(z, k, lambda _, p: p - 1.0)[0]
    return found


def _tails(below: FloatArray, k: float, rates: Sequence[float]) -> FloatArray:
    """Integrate K_d(d + t) exp(-nu t) over t > 0 for nodes at distance d above the last edge.

    Returns (A, n), a row for each of the rates nu.
    """
    return _integrate_over_w(below, k, *(functools.partial(_of_rate, nu) for nu in rates))


def _of_rate(nu: float, tau: FloatArray, _: FloatArray) -> FloatArray:
    return 1.0 / (tau + nu)


def _integrate_over_w(distances: FloatArray, k: float, *functions: _OfTau) -> FloatArray:
    """Return 1/2 int_{w0}^inf function(tau, p) exp(-d tau) dw for distances above 0, (F, n).

    tau = (e^w + k^2 e^-w)/2 and p = (e^w - k^2 e^-w)/2.
    """
    kappa = math.hypot(1.0, k)
    d = np.minimum(distances, _NOTHING / kappa)
    x, w = gauss_legendre(_PER_STRETCH)
    places = (x + np.arange(_STRETCHES)[:, None]).ravel() / _STRETCHES
    weights = np.tile(w, _STRETCHES) / _STRETCHES
    start = math.log1p(kappa)
    length = np.log(2.0 * (_BEYOND + kappa * d) / d) - start  # to where d tau > 40 + kappa d
    integrals = np.empty((len(functions), d.size))
    for block in _blocks(d.size):
        power = np.exp(start + length[block, None] * places)
        tau, p = 0.5 * (power + k * k / power), 0.5 * (power - k * k / power)
        falling = np.exp(-d[block, None] * tau)
        for integral, function in zip(integrals, functions, strict=True):
            values = function(tau, p) * falling
            integral[block] = 0.5 * length[block] * (values @ weights)
    return integrals
