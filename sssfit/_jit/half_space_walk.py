"""What the walk of ``semi_infinite`` takes and gives, and its call; nothing here needs numba."""

from ctypes import c_double, c_int64, c_uint64
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit.lanes import GENERATOR_ROWS, LANES, LaneWords
from sssfit._jit.machine_code import Array, Entry

COLLISION_CAP = 1_000_000  # walks end here unfinished; with albedo 1 they might never end
POWER_BLOCK = 1024  # albedo^n = low[n % 1024] * high[n // 1024] reaches past the collision cap
# Variance of the weight that roulette adds, in squared weights: .9 * 1^2 + .1 * 9^2. It is the
# expected one because gains are rare: a short run without any would estimate a small spread around
# a wrong mean.
ROULETTE_SPREAD = 9.0
FLOAT_ROWS, WORD_ROWS = 8, GENERATOR_ROWS + 4  # of the two blocks of lanes

FloatArray = npt.NDArray[np.float64]


class Channels(NamedTuple):
    """Tables that turn a walk into energy per channel, for all materials of a walk together."""

    power_low: FloatArray  # (POWER_BLOCK, C): albedo^k
    power_high: FloatArray  # (POWER_BLOCK, C): albedo^(POWER_BLOCK k)
    bins_per_mean_free_path: FloatArray  # (C,)
    last_bin: npt.NDArray[np.int64]  # (C,): the bin that stands for "beyond the grid"
    first_cell: npt.NDArray[np.int64]  # (C,): start of the channel's bins in the tally
    # (B - 1,): falling cosines inside the medium that separate the B directions of each annulus
    cosines: FloatArray


class Ledger(NamedTuple):
    """Sums over photons of weight and of weight squared; a photon enters with weight 1."""

    bins: FloatArray  # (cells, 2): energy leaving, per bin
    absorbed: FloatArray  # (C,)
    unfinished: FloatArray  # (C, 2): energy of walks stopped at the collision cap
    roulette: FloatArray  # (C, 2): energy added by roulette, zero on average, and its variance


_ROW, _TABLE, _COUNTS = Array(np.float64), Array(np.float64, 2), Array(np.int64)
_FLOATS, _WORDS = Array(np.float32), Array(np.uint32)

ENTRY = Entry(
    "semi_infinite",
    (
        *(c_uint64, c_int64, c_int64, c_double),  # seed, batch, photons, eta
        *(c_int64, c_int64, c_int64, c_int64),  # roulettes, channels, cosines, cells
        _WORDS,  # roulette_at
        *(_TABLE, _TABLE, _ROW, _COUNTS, _COUNTS, _ROW),  # Channels
        *(_TABLE, _ROW, _TABLE, _TABLE),  # Ledger
        *(_FLOATS, _WORDS, _COUNTS),  # blocks of floats and of words, events
    ),
)


def trace_batch(
    seed: int,
    batch: int,
    photons: int,
    eta: float,
    roulette_at: LaneWords,
    channels: Channels,
    ledger: Ledger,
) -> int:
    """Walk ``photons`` photons of one batch into ``ledger``; return the number of flights.

    ``eta`` is the index of the medium relative to the outside, at least 1. ``roulette_at[k]`` is
    the number of collisions at which a walk that survived k roulettes plays the next.
    """
    sizes = roulette_at.size, channels.last_bin.size, channels.cosines.size, len(ledger.bins)
    blocks = (
        np.zeros(FLOAT_ROWS * LANES, np.float32),
        np.zeros(WORD_ROWS * LANES, np.uint32),
        np.zeros(LANES, np.int64),
    )
    return ENTRY(seed, batch, photons, eta, *sizes, roulette_at, *channels, *ledger, *blocks)
