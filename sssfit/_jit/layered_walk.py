"""What the walk of ``layered`` takes and gives, and its call; nothing here needs numba."""

from ctypes import c_double, c_int64, c_uint64
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sssfit._jit.lanes import (
    FLOAT_ROWS,
    SCRATCH_ROWS,
    SLOT_ROWS,
    SLOT_WORD_ROWS,
    STRIDE,
    SUMS,
    WORD_ROWS,
    Flags,
    Indices,
    LaneFloats,
    LaneWords,
)
from sssfit._jit.machine_code import Array, Entry

FloatArray = npt.NDArray[np.float64]


class Stack(NamedTuple):
    """Tables for a walk's least absorbing channel; L layers from 1 downwards, K channels.

    Layer 0 lies above the stack and layer L + 1 below; their thickness is infinite, and their mean
    free path is 0, so that a photon that leaves stays where it left.
    """

    # thickness [mm], mean free path [mm], capture = 1 - albedo and back = 1 - g, which float32
    # holds better than an albedo or a g near 1
    layers: LaneFloats  # ((L + 2) 4,)
    # down and up: index over that beyond the interface; thickness and mean free path there
    crossings: LaneFloats  # ((L + 2) 2 3,)
    excess_per_mm: LaneFloats  # ((L + 2) K,): absorption beyond that of the least absorbing


class Bins(NamedTuple):
    """Positions of the walk's K channels among all channels of the ledger."""

    per_mm: float  # bins of the radial grid per mm
    last: int  # the bin that stands for "beyond the grid"
    channel: npt.NDArray[np.int64]  # (K,)
    # falling cosines outside the stack that separate the directions of each annulus: (B - 1,)
    # above, (D - 1,) below
    above: FloatArray
    below: FloatArray


class Ledger(NamedTuple):
    """Sums over photons of weight and of weight squared; a photon enters with weight 1."""

    reflected: FloatArray  # ((n + 1) B, C, 2): by radius and direction
    transmitted: FloatArray  # ((n + 1) D, C, 2)
    absorbed: FloatArray  # (L, C)
    unfinished: FloatArray  # (C, 2)
    roulette: FloatArray  # (C, 2): what roulette added, zero on average, and its variance


class Blocks(NamedTuple):
    """The memory of a walk as ``layered`` sees it: some as floats and as words, for copies."""

    floats: LaneFloats  # (FLOAT_ROWS STRIDE,)
    bits: LaneWords  # the same
    words: LaneWords  # (WORD_ROWS STRIDE,)
    shares: LaneFloats  # (K STRIDE,)
    flags: Flags  # (STRIDE,)
    eights: Indices  # the same, as words of eight flags
    gone: Flags  # (STRIDE,)
    slots: LaneFloats  # (SLOT_ROWS STRIDE,)
    slot_bits: LaneWords  # the same
    slot_words: LaneWords  # (SLOT_WORD_ROWS STRIDE,)
    scratch: LaneFloats  # (SCRATCH_ROWS STRIDE,)
    absorbed: FloatArray  # (K SUMS (L + 2),)
    events: Indices  # (STRIDE,)
    exits: Indices  # (STRIDE,)
    layers: LaneWords  # those of the stack
    crossings: LaneWords  # those of the stack


_ROW, _TABLE, _BLOCK = (Array(np.float64, rank) for rank in (1, 2, 3))
_COUNTS, _INDICES, _FLAGS = Array(np.int64), Array(np.uint64), Array(np.uint8)
_FLOATS, _WORDS = Array(np.float32), Array(np.uint32)

ENTRY = Entry(
    "layered",
    (
        *(c_uint64, c_int64, c_int64, c_int64, c_int64),  # seed to diffuse
        *(c_int64, c_int64),  # layers, channels of the ledger
        *(c_double, c_int64, c_int64, c_int64, c_int64),  # Bins: numbers, then sizes of arrays
        *(_FLOATS, _FLOATS, _FLOATS),  # Stack
        *(_COUNTS, _ROW, _ROW),  # Bins
        *(_BLOCK, _BLOCK, _TABLE, _TABLE, _TABLE),  # Ledger
        *(_FLOATS, _WORDS, _FLOATS, _FLAGS, _FLAGS),  # what `_blocks` makes
        *(_FLOATS, _WORDS, _FLOATS, _ROW, _INDICES, _INDICES),
    ),
)


def trace_batch(
    seed: int,
    batch: int,
    photons: int,
    first_layer: int,
    diffuse: bool,
    stack: Stack,
    bins: Bins,
    ledger: Ledger,
) -> int:
    """Walk ``photons`` photons of one batch into ``ledger``; return the number of flights.

    ``first_layer`` is the first that is not clear, counted from 0; the reflection of the beam by
    the clear ones above it counts as specular.
    """
    layers, channels = ledger.absorbed.shape
    own, above, below = bins.channel.size, bins.above.size, bins.below.size
    return ENTRY(
        *(seed, batch, photons, first_layer, diffuse, layers, channels),
        *(bins.per_mm, bins.last, own, above, below),
        *stack,
        *bins[2:],
        *ledger,
        *blocks(layers, own),
    )


def blocks(layers: int, channels: int) -> tuple[npt.NDArray[Any], ...]:
    """Return the memory of a walk: state of the lanes, of the slots, and lists of lanes."""
    return (
        np.zeros(FLOAT_ROWS * STRIDE, np.float32),
        np.zeros(WORD_ROWS * STRIDE, np.uint32),
        np.ones(channels * STRIDE, np.float32),  # shares
        np.zeros(STRIDE, np.uint8),  # flags
        np.zeros(STRIDE, np.uint8),  # gone
        np.ones(SLOT_ROWS * STRIDE, np.float32),
        np.zeros(SLOT_WORD_ROWS * STRIDE, np.uint32),
        np.ones(SCRATCH_ROWS * STRIDE, np.float32),
        np.zeros(channels * SUMS * (layers + 2)),  # absorbed
        np.zeros(STRIDE, np.uint64),  # events
        np.zeros(STRIDE, np.uint64),  # exits
    )
