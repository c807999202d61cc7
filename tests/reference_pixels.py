"""Slow, literal oracles for profiles and their pixels, and small profiles to try them on."""

from itertools import pairwise

import numpy as np
from scipy.integrate import quad

from sssfit.profile import FORMAT, Profile


def make_profile(r_edges_mm, annulus_energy, **changes):
    """A profile with the given annuli and nothing else; ``changes`` replace fields."""
    energy = np.asarray(annulus_energy, dtype=float)
    n_channels = energy.shape[1]
    fields = {
        "r_edges_mm": r_edges_mm,
        "annulus_energy": energy,
        "annulus_energy_stderr": np.full(energy.shape, np.nan),
        "beyond_grid": np.zeros(n_channels),
        "beyond_grid_stderr": np.full(n_channels, np.nan),
        "specular_reflectance": 0.02,
        "absorbed": np.zeros((1, n_channels)),
        "unfinished": np.zeros(n_channels),
        "annulus_transmittance": None,
        "meta": {
            "format": FORMAT,
            "channels": [f"c{i}" for i in range(n_channels)],
            "material": {"name": "test"},
            "method": "test",
            "photons": None,
            "seed": None,
            "version": "0",
        },
    }
    return Profile(**(fields | changes))


def one_over_r_profile(n_annuli, dr_mm, lengths_mm):
    """R_d ~ exp(-r/L)/r, so that F = L (1 - exp(-r/L)): one channel for each length L."""
    edges = np.arange(n_annuli + 1) * dr_mm
    lengths = np.asarray(lengths_mm, dtype=float)
    return make_profile(edges, np.diff(-lengths * np.expm1(-edges[:, None] / lengths), axis=0))


def one_over_r_centre_pixel(pitch_mm, length_mm):
    """Centre pixel of the same R_d: F along the pixel's edge, one octant by quadrature."""
    octant, _ = quad(
        lambda phi: -length_mm * np.expm1(-pitch_mm / (2 * np.cos(phi) * length_mm)),
        0,
        np.pi / 4,
        epsabs=0,
        epsrel=1e-12,
    )
    return 8 * octant / (2 * np.pi)


def edge_spread(x, radius):
    """Share of a uniform disk of unit energy to the left of x."""
    x = np.clip(x, -radius, radius)
    area = x * np.sqrt(radius**2 - x**2) + radius**2 * np.arcsin(x / radius)
    return 0.5 + area / (np.pi * radius**2)


def disk_rectangle_area(radius, x0, x1, y0, y1):
    """Area of a disk's share of any rectangle: heights integrated over x, kinks given."""

    def height(x):
        top = np.sqrt(max(radius**2 - x**2, 0.0))
        return max(min(y1, top) - max(y0, -top), 0.0)

    kinks = [-radius, radius]
    for y in (y0, y1):
        if abs(y) < radius:
            kinks += [-np.sqrt(radius**2 - y**2), np.sqrt(radius**2 - y**2)]
    stops = [x0, *sorted(kink for kink in kinks if x0 < kink < x1), x1]
    return sum(
        quad(height, a, b, epsabs=1e-14, epsrel=1e-11, limit=200)[0] for a, b in pairwise(stops)
    )


def rectangle_energy(profile, x0, x1, y0, y1):
    """Energy of a profile's flat annuli in any rectangle (C,), annulus by annulus."""
    edges, densities = profile.flat_annuli()
    areas = [0.0] + [disk_rectangle_area(radius, x0, x1, y0, y1) for radius in edges[1:]]
    return np.diff(areas) @ densities


def sampled_pixel_energy(profile, i, k, pitch_mm, samples):
    """Energy in pixel (i, k) from samples x samples points at which the flat density is read."""
    edges, densities = profile.flat_annuli()
    offsets = ((np.arange(samples) + 0.5) / samples - 0.5) * pitch_mm
    x, y = np.meshgrid(i * pitch_mm + offsets, k * pitch_mm + offsets)
    annulus = np.searchsorted(edges, np.hypot(x, y), side="right") - 1
    padded = np.concatenate((densities, np.zeros((1, densities.shape[1]))))
    return padded[annulus].sum(axis=(0, 1)) * (pitch_mm / samples) ** 2


def kernel_energy(quadrant):
    """Energy of the whole kernel from a quadrant (h+1, h+1, ...), literally pixel by pixel."""
    copies = np.full(len(quadrant), 2.0)
    copies[0] = 1.0
    return np.einsum("i,k,ik...->...", copies, copies, quadrant)


def row_sums(quadrant):
    """Sum over y of the whole kernel, for x from 0 on."""
    return quadrant[:, 0] + 2 * quadrant[:, 1:].sum(axis=1)


def walk_tallies(weights, bins, n_bins):
    """Mean and standard error of N photons in each bin; a bin of -1 is no bin."""
    photons = len(weights)
    raw = np.zeros((photons, n_bins))
    raw[bins >= 0, bins[bins >= 0]] = weights[bins >= 0]
    return raw, raw.mean(axis=0), raw.std(axis=0, ddof=1) / np.sqrt(photons)
