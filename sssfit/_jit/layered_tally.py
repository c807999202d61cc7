"""Sums of the layered walk: absorption by layer, exits by radius and direction.

Weights are products of single-precision numbers, but sums and differences of weights are double:
what is booked for a photon then adds up to exactly 1, and a run's balance holds to rounding.
"""

import math

import numpy as np

from sssfit._jit import jit, jit_merged
from sssfit._jit.fused import decay
from sssfit._jit.lanes import STRIDE, SUMS, Indices, LaneFloats, LaneWords
from sssfit._jit.layered_lanes import (
    BOOKED,
    LAYER,
    UZ,
    VECTOR,
    WEIGHT,
    X,
    Y,
)
from sssfit._jit.layered_slots import LENGTH, SUM_MASK
from sssfit._jit.layered_walk import Bins, FloatArray, Ledger
from sssfit._jit.sampling import falling_bin

_F64 = np.float64
_U64 = np.uint64
_U0, _U1 = _U64(0), _U64(1)

# Rows of the scratch block of ``book_channels``
_WEIGHT_NOW, _WEIGHT_BOOKED, _SHARE, _EXCESS, _BEFORE, _NOW = (_U64(k * STRIDE) for k in range(6))


@jit_merged
def book_alone(
    floats: LaneFloats,
    words: LaneWords,
    events: Indices,
    count: int,
    absorbed: FloatArray,
) -> None:
    """Tally the weight that a walk of one channel lost in its layer since the last tally."""
    layers = _U64(_U64(absorbed.size) // _U64(SUMS))
    for k in range(count):
        slot = _U64(k)
        lane = events[slot]
        weight = floats[WEIGHT + lane]
        row = _U64(_U64(slot & SUM_MASK) * layers + _U64(words[LAYER + lane]))
        absorbed[row] += _F64(floats[BOOKED + lane]) - _F64(weight)
        floats[BOOKED + lane] = weight


@jit_merged
def book_channels(
    floats: LaneFloats,
    words: LaneWords,
    shares: LaneFloats,
    events: Indices,
    count: int,
    slots: LaneFloats,
    scratch: LaneFloats,
    excess: LaneFloats,
    absorbed: FloatArray,
) -> None:
    """Tally the weight that every channel lost in its layer since the last tally.

    A channel that absorbs more than the walk's by ``excess`` keeps exp(-excess path) of its share.
    """
    count_of_channels = shares.size // STRIDE
    channels = _U64(count_of_channels)
    layers = _U64(_U64(excess.size) // channels)
    padded = (count + VECTOR - 1) & -VECTOR
    for k in range(count):
        slot = _U64(k)
        lane = events[slot]
        weight = floats[WEIGHT + lane]
        scratch[_WEIGHT_NOW + slot] = weight
        scratch[_WEIGHT_BOOKED + slot] = floats[BOOKED + lane]
        floats[BOOKED + lane] = weight
    for c in range(count_of_channels):
        channel = _U64(c)
        row = _U64(channel * _U64(STRIDE))
        first = _U64(channel * _U64(_U64(SUMS) * layers))
        for k in range(count):
            slot = _U64(k)
            lane = events[slot]
            scratch[_SHARE + slot] = shares[row + lane]
            scratch[_EXCESS + slot] = excess[_U64(_U64(words[LAYER + lane]) * channels) + channel]
        for k in range(padded):
            slot = _U64(k)
            share = scratch[_SHARE + slot]
            scratch[_BEFORE + slot] = scratch[_WEIGHT_BOOKED + slot] * share
            share = share * decay(scratch[_EXCESS + slot] * slots[LENGTH + slot])
            scratch[_NOW + slot] = scratch[_WEIGHT_NOW + slot] * share
            scratch[_SHARE + slot] = share
        for k in range(count):
            slot = _U64(k)
            lane = events[slot]
            shares[row + lane] = scratch[_SHARE + slot]
            at = _U64(first + _U64(_U64(slot & SUM_MASK) * layers) + _U64(words[LAYER + lane]))
            absorbed[at] += _F64(scratch[_BEFORE + slot]) - _F64(scratch[_NOW + slot])


@jit_merged
def score_exits(
    floats: LaneFloats,
    shares: LaneFloats,
    exits: Indices,
    count: int,
    bins: Bins,
    reflected: FloatArray,
    transmitted: FloatArray,
) -> None:
    """Add the photons that have left the stack, in the bin of their radius and direction."""
    for k in range(count):
        lane = exits[_U64(k)]
        x, y = _F64(floats[X + lane]), _F64(floats[Y + lane])
        radial_bin = int(min(math.sqrt(x * x + y * y) * bins.per_mm, float(bins.last)))
        uz = _F64(floats[UZ + lane])
        if uz < 0.0:
            row = _U64(radial_bin * (bins.above.size + 1) + falling_bin(-uz, bins.above))
        else:
            row = _U64(radial_bin * (bins.below.size + 1) + falling_bin(uz, bins.below))
        weight = floats[WEIGHT + lane]
        for c in range(bins.channel.size):
            left = _F64(weight * shares[_U64(_U64(c) * _U64(STRIDE)) + lane])
            channel = _U64(bins.channel[_U64(c)])
            if uz < 0.0:
                reflected[row, channel, _U0] += left
                reflected[row, channel, _U1] += left * left
            else:
                transmitted[row, channel, _U0] += left
                transmitted[row, channel, _U1] += left * left


@jit
def add_absorbed(absorbed: FloatArray, bins: Bins, ledger: Ledger) -> None:
    """Add a batch's absorption, (K SUMS (L + 2),), to the ledger, (L, C)."""
    inside = ledger.absorbed.shape[0]
    for c in range(bins.channel.size):
        for k in range(SUMS):
            first = (c * SUMS + k) * (inside + 2) + 1
            for layer in range(inside):
                ledger.absorbed[layer, bins.channel[c]] += absorbed[first + layer]
