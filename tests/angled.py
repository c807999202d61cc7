"""A profile as if it had been walked with exit angles, for the worlds of the command line."""

from dataclasses import replace

import numpy as np

from sssfit.profile import Profile

# Shares of the light in bins of 22.5 degrees: more near the normal than Lambert has, and more so
# from channel to channel.
SHARES = np.array([0.17, 0.37, 0.33, 0.13])
CHANGE = np.array([0.01, 0.01, -0.01, -0.01])


def angled(profile: Profile) -> Profile:
    """A profile of a half space with four exit angles."""
    parts = SHARES[:, None] + CHANGE[:, None] * np.arange(profile.n_channels)
    energy = np.vstack([profile.annulus_energy, profile.beyond_grid])[:, None, :]
    stderr = np.vstack([profile.annulus_energy_stderr, profile.beyond_grid_stderr])[:, None, :]
    return replace(
        profile,
        exit_angle_edges_rad=np.linspace(0.0, 0.5 * np.pi, len(SHARES) + 1),
        angle_reflected=energy * parts,
        angle_reflected_stderr=stderr * np.sqrt(parts),
        meta={**profile.meta, "format": "sssfit.profile/2"},
    )
