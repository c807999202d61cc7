"""Entry of the layered walk: photons put at the top of a layer."""

import numpy as np

from sssfit._jit import jit_merged
from sssfit._jit.fused import free_path, turn, uniform
from sssfit._jit.lanes import STRIDE, Indices, LaneFloats, LaneWords
from sssfit._jit.layered_lanes import (
    BACK,
    BOOKED,
    BORN,
    CAPTURE,
    COLUMNS,
    FREE_PATH,
    LAYER,
    PATH,
    THICKNESS,
    UX,
    UY,
    UZ,
    WEIGHT,
    X,
    Y,
    Z,
)

_F32 = np.float32
_U32 = np.uint32
_U64 = np.uint64
_ZERO, _ONE = _F32(0.0), _F32(1.0)
_U1, _U2, _U3 = _U64(1), _U64(2), _U64(3)


@jit_merged
def launch(
    floats: LaneFloats,
    words: LaneWords,
    shares: LaneFloats,
    ended: Indices,
    count: int,
    first_layer: np.uint64,
    diffuse: bool,
    layers: LaneFloats,
    sweep: np.uint32,
    events: Indices,
    waiting: int,
) -> int:
    """Put new photons into the lanes listed in ``ended``, at the top of a layer.

    They enter along the normal or, ``diffuse``, with the cosine law of a uniformly lit surface.
    Those that fly through the layer are added to the ``waiting`` events; returns their number.
    """
    row = _U64(first_layer * COLUMNS)
    thickness, mean, capture = layers[row], layers[row + _U1], layers[row + _U2]
    back = layers[row + _U3]
    listed = waiting
    for k in range(count):
        lane = ended[_U64(k)]
        ux, uy, uz = _ZERO, _ZERO, _ONE
        if diffuse:
            uz = np.sqrt(uniform(words, lane))
            cos_phi, sin_phi = turn(uniform(words, lane))
            sideways = np.sqrt(_ONE - uz * uz)
            ux, uy = sideways * cos_phi, sideways * sin_phi
        flight = free_path(uniform(words, lane)) * mean
        leaves = flight * uz > thickness
        flight = _ZERO if leaves else flight
        floats[X + lane] = flight * ux
        floats[Y + lane] = flight * uy
        floats[Z + lane] = flight * uz
        floats[UX + lane] = ux
        floats[UY + lane] = uy
        floats[UZ + lane] = uz
        floats[WEIGHT + lane] = _ONE
        floats[BOOKED + lane] = _ONE
        floats[PATH + lane] = flight
        floats[THICKNESS + lane] = thickness
        floats[FREE_PATH + lane] = mean
        floats[CAPTURE + lane] = capture
        floats[BACK + lane] = back
        words[LAYER + lane] = _U32(first_layer)
        words[BORN + lane] = sweep
        for row_of in range(0, shares.size, STRIDE):
            shares[_U64(row_of) + lane] = _ONE
        events[_U64(listed)] = lane
        listed += int(leaves)
    return listed
