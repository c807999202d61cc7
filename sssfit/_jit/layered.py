"""The photon walk through layers, in lanes: all of MCML (Wang, Jacques, Zheng 1995).

Any number of layers, Henyey-Greenstein scattering, Fresnel and total internal reflection at every
interface, clear layers, finite stacks or a semi-infinite last layer.

``LANES`` photons advance side by side. In a sweep every lane scatters once and flies to its next
collision (``layered_lanes``). The lanes whose flight would end outside their layer then go through
rounds: all of them meet their interface together (``layered_slots``), until each has either left,
and made room for the next photon, or flown to a collision. Each sweep is thus one collision for
every lane, and loops without branches do nearly all of the work.

Every ``_SWEEPS_BETWEEN`` sweeps directions are renormalised, and walks that are below the roulette
threshold or at the collision cap are looked for; a walk may make that many collisions more.

Channels may share a walk if they differ in absorption only. The walk follows the least absorbing
one (weight times albedo at a collision, implicit capture as published); the weights of the others
are reduced by exp(-delta L), with delta their excess absorption and L the path (``layered_tally``).
This estimates the same energy, with weights that never exceed the walk's own.

Lengths are in mm.
"""

import numpy as np

from sssfit._jit import jit_entry
from sssfit._jit.fused import STRIDE, seed_streams
from sssfit._jit.layered_end import end_or_boost, flag_weak, give_up
from sssfit._jit.layered_entry import Stack, launch
from sssfit._jit.layered_lanes import (
    FLOAT_ROWS,
    VECTOR,
    WORD_ROWS,
    draw,
    fly,
    list_flagged,
    remove_lanes,
    renormalise,
    rotate,
)
from sssfit._jit.layered_slots import (
    SLOT_ROWS,
    SLOT_WORD_ROWS,
    SUMS,
    gather,
    meet,
    settle,
)
from sssfit._jit.layered_tally import (
    SCRATCH_ROWS,
    Bins,
    Ledger,
    add_absorbed,
    book_alone,
    book_channels,
    score_exits,
)
from sssfit._jit.sampling import LANES

_U32 = np.uint32
_U64 = np.uint64
_U1, _U2 = _U64(1), _U64(2)
_SWEEPS_BETWEEN = 8
_MOST_ROUNDS = 100_000  # a photon caught in clear layers meets interfaces without a collision


@jit_entry
def trace_batch(
    seed: np.uint64,
    batch: np.int64,
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
    channels = bins.channel.size
    is_alone = channels == 1
    floats = np.zeros(FLOAT_ROWS * STRIDE, np.float32)
    words = np.zeros(WORD_ROWS * STRIDE, np.uint32)
    shares = np.ones(channels * STRIDE, np.float32)
    flags, gone = np.zeros(STRIDE, np.uint8), np.zeros(STRIDE, np.uint8)
    slots = np.ones(SLOT_ROWS * STRIDE, np.float32)
    slot_words = np.zeros(SLOT_WORD_ROWS * STRIDE, np.uint32)
    scratch = np.ones(SCRATCH_ROWS * STRIDE, np.float32)
    layer_count = stack.layers.size // 4
    absorbed = np.zeros(channels * SUMS * layer_count)
    events, exits = np.empty(STRIDE, np.uint64), np.empty(STRIDE, np.uint64)
    # floats as words, for copies, and flags as words of eight
    bits, slot_bits = floats.view(np.uint32), slots.view(np.uint32)
    layers, crossings = stack.layers.view(np.uint32), stack.crossings.view(np.uint32)
    eights = flags.view(np.uint64)
    coefficients, excess = stack.layers, stack.excess_per_mm
    reflected, transmitted = ledger.reflected, ledger.transmitted
    seed_streams(words, seed, _U64(_U2 * _U64(batch)))
    seed_streams(slot_words, seed, _U64(_U2 * _U64(batch) + _U1))

    live = min(LANES, photons)
    waiting = photons
    for lane in range(live):
        exits[lane] = _U64(lane)
    met, ended, sweep, checked, flights = 0, live, 0, 0, 0
    while ended > 0 or live > 0:
        removed, rounds = 0, 0
        while ended > 0 or met > 0:
            if ended > 0:
                taken = min(ended, waiting)
                waiting -= taken
                met = launch(
                    floats,
                    words,
                    shares,
                    exits,
                    taken,
                    _U64(first_layer + 1),
                    diffuse,
                    coefficients,
                    _U32(sweep),
                    events,
                    met,
                )
                for k in range(taken, ended):
                    gone[exits[k]] = 1
                removed += ended - taken
                ended = 0
                continue
            gather(bits, words, events, met, slot_bits, crossings)
            meet(slots, slot_words, (met + VECTOR - 1) & -VECTOR)
            if is_alone:
                book_alone(floats, words, events, met, absorbed)
            else:
                book_channels(floats, words, shares, events, met, slots, scratch, excess, absorbed)
            met, ended = settle(bits, words, slot_bits, slot_words, events, met, layers, exits)
            score_exits(floats, shares, exits, ended, bins, reflected, transmitted)
            rounds += 1
            if rounds > _MOST_ROUNDS:
                give_up(floats, shares, events, met, bins, ledger)
                exits[ended : ended + met] = events[:met]
                ended += met
                met = 0
        if removed > 0:
            live = remove_lanes(floats, words, shares, gone, live)
        padded = (live + VECTOR - 1) & -VECTOR
        if sweep - checked >= _SWEEPS_BETWEEN:
            checked = sweep
            renormalise(floats, padded)
            flag_weak(floats, words, flags, padded, _U32(sweep))
            weak = list_flagged(flags, eights, live, events)
            ended = end_or_boost(
                floats,
                words,
                shares,
                events,
                weak,
                _U32(sweep),
                excess,
                absorbed,
                bins,
                ledger,
                exits,
            )
            if ended > 0:
                continue
        draw(floats, words, padded)
        rotate(floats, padded)
        fly(floats, flags, padded)
        sweep += 1
        flights += live
        met = list_flagged(flags, eights, live, events)
    add_absorbed(absorbed, bins, ledger)
    return flights
