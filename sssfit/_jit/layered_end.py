"""Ends of the layered walk's photons: roulette, the collision cap, endless runs of interfaces."""

import numpy as np

from sssfit._jit import jit, jit_merged
from sssfit._jit.fused import decay, uniform
from sssfit._jit.half_space_walk import COLLISION_CAP, ROULETTE_SPREAD
from sssfit._jit.lanes import STRIDE, SUMS, Flags, Indices, LaneFloats, LaneWords
from sssfit._jit.layered_lanes import (
    BOOKED,
    BORN,
    LAYER,
    PATH,
    WEIGHT,
)
from sssfit._jit.layered_walk import Bins, FloatArray, Ledger

_F32 = np.float32
_F64 = np.float64
_U32 = np.uint32
_U64 = np.uint64
_ZERO = _F32(0.0)
# MCML's roulette threshold: below it, one in ten survives with ten times the weight.
_THRESHOLD = _F32(1e-4)
_SURVIVAL = _F32(0.1)
_GAIN = _F32(10.0)


@jit_merged
def flag_weak(
    floats: LaneFloats, words: LaneWords, flags: Flags, count: int, sweep: np.uint32
) -> None:
    """Flag the lanes below the roulette threshold or at the collision cap."""
    for k in range(count):
        lane = _U64(k)
        collisions = _U32(sweep - words[BORN + lane])
        flags[lane] = (floats[WEIGHT + lane] < _THRESHOLD) | (collisions >= _U32(COLLISION_CAP))


@jit
def end_or_boost(
    floats: LaneFloats,
    words: LaneWords,
    shares: LaneFloats,
    events: Indices,
    count: int,
    sweep: np.uint32,
    excess: LaneFloats,
    absorbed: FloatArray,
    bins: Bins,
    ledger: Ledger,
    exits: Indices,
) -> int:
    """Stop walks at the cap and let the others play roulette; list those that end.

    The weight that roulette adds or takes has mean zero, and its expected square is booked.
    """
    ended, layers = 0, excess.size // bins.channel.size
    for k in range(count):
        lane = events[k]
        stops = _U32(sweep - words[BORN + lane]) >= _U32(COLLISION_CAP)
        lives = not stops and uniform(words, lane) < _SURVIVAL
        weight, path = floats[WEIGHT + lane], floats[PATH + lane]
        booked, layer = floats[BOOKED + lane], words[LAYER + lane]
        boosted = weight * _GAIN if lives else _ZERO
        for c in range(bins.channel.size):
            channel, at = bins.channel[c], _U64(c * STRIDE) + lane
            share = shares[at]
            before = _F64(booked * share)
            share = share * decay(excess[layer * bins.channel.size + c] * path)
            shares[at] = share
            now = _F64(weight * share)
            absorbed[_U64(c * SUMS * layers) + _U64(layer)] += before - now
            if stops:
                ledger.unfinished[channel, 0] += now
                ledger.unfinished[channel, 1] += now * now
            else:
                ledger.roulette[channel, 0] += _F64(boosted * share) - now
                ledger.roulette[channel, 1] += ROULETTE_SPREAD * now * now
        floats[PATH + lane] = _ZERO
        floats[WEIGHT + lane] = boosted
        floats[BOOKED + lane] = boosted
        if not lives:
            exits[ended] = lane
            ended += 1
    return ended


@jit
def give_up(
    floats: LaneFloats,
    shares: LaneFloats,
    events: Indices,
    count: int,
    bins: Bins,
    ledger: Ledger,
) -> None:
    """Book the walks that meet interfaces without end as unfinished."""
    for k in range(count):
        for c in range(bins.channel.size):
            weight = floats[WEIGHT + events[k]]
            left = _F64(weight * shares[_U64(c * STRIDE) + events[k]])
            ledger.unfinished[bins.channel[c], 0] += left
            ledger.unfinished[bins.channel[c], 1] += left * left
