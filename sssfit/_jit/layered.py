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
from numba import carray  # type: ignore[attr-defined]

from sssfit._jit import Address, jit
from sssfit._jit.fused import seed_streams
from sssfit._jit.lanes import (
    FLOAT_ROWS,
    LANES,
    SCRATCH_ROWS,
    SLOT_ROWS,
    SLOT_WORD_ROWS,
    STRIDE,
    SUMS,
    WORD_ROWS,
)
from sssfit._jit.layered_end import end_or_boost, flag_weak, give_up
from sssfit._jit.layered_entry import launch
from sssfit._jit.layered_lanes import (
    VECTOR,
    draw,
    fly,
    list_flagged,
    remove_lanes,
    renormalise,
    rotate,
)
from sssfit._jit.layered_slots import gather, meet, settle
from sssfit._jit.layered_tally import add_absorbed, book_alone, book_channels, score_exits
from sssfit._jit.layered_walk import Bins, Blocks, Ledger, Stack

_U32 = np.uint32
_U64 = np.uint64
_U1, _U2 = _U64(1), _U64(2)
_SWEEPS_BETWEEN = 8
_MOST_ROUNDS = 100_000  # a photon caught in clear layers meets interfaces without a collision


@jit
def trace_batch(
    seed: np.uint64,
    batch: np.int64,
    photons: int,
    first_layer: int,
    diffuse: bool,
    stack: Stack,
    bins: Bins,
    ledger: Ledger,
    blocks: Blocks,
) -> int:
    """See ``layered_walk.trace_batch``."""
    is_alone = bins.channel.size == 1
    floats, bits, words, shares = blocks.floats, blocks.bits, blocks.words, blocks.shares
    flags, eights, gone = blocks.flags, blocks.eights, blocks.gone
    slots, slot_bits, slot_words = blocks.slots, blocks.slot_bits, blocks.slot_words
    scratch, absorbed = blocks.scratch, blocks.absorbed
    events, exits = blocks.events, blocks.exits
    layers, crossings = blocks.layers, blocks.crossings
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
                for k in range(met):
                    exits[ended + k] = events[k]
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


def enter(
    seed: np.uint64,
    batch: np.int64,
    photons: int,
    first_layer: int,
    diffuse: int,
    inside: int,
    all_channels: int,
    per_mm: float,
    last: int,
    channels: int,
    above_count: int,
    below_count: int,
    layers: Address,
    crossings: Address,
    excess: Address,
    channel: Address,
    above: Address,
    below: Address,
    reflected: Address,
    transmitted: Address,
    absorbed_of: Address,
    unfinished: Address,
    roulette: Address,
    floats: Address,
    words: Address,
    shares: Address,
    flags: Address,
    gone: Address,
    slots: Address,
    slot_words: Address,
    scratch: Address,
    absorbed: Address,
    events: Address,
    exits: Address,
) -> int:
    """Call `trace_batch` with arrays at the addresses that ``layered_walk.ENTRY`` passes."""
    rows = inside + 2
    stack = Stack(
        carray(layers, (rows * 4,), np.float32),
        carray(crossings, (rows * 6,), np.float32),
        carray(excess, (rows * channels,), np.float32),
    )
    bins = Bins(
        per_mm,
        last,
        carray(channel, (channels,), np.int64),
        carray(above, (above_count,), np.float64),
        carray(below, (below_count,), np.float64),
    )
    ledger = Ledger(
        carray(reflected, ((last + 1) * (above_count + 1), all_channels, 2), np.float64),
        carray(transmitted, ((last + 1) * (below_count + 1), all_channels, 2), np.float64),
        carray(absorbed_of, (inside, all_channels), np.float64),
        carray(unfinished, (all_channels, 2), np.float64),
        carray(roulette, (all_channels, 2), np.float64),
    )
    blocks = Blocks(
        carray(floats, (FLOAT_ROWS * STRIDE,), np.float32),
        carray(floats, (FLOAT_ROWS * STRIDE,), np.uint32),
        carray(words, (WORD_ROWS * STRIDE,), np.uint32),
        carray(shares, (channels * STRIDE,), np.float32),
        carray(flags, (STRIDE,), np.uint8),
        carray(flags, (STRIDE // 8,), np.uint64),
        carray(gone, (STRIDE,), np.uint8),
        carray(slots, (SLOT_ROWS * STRIDE,), np.float32),
        carray(slots, (SLOT_ROWS * STRIDE,), np.uint32),
        carray(slot_words, (SLOT_WORD_ROWS * STRIDE,), np.uint32),
        carray(scratch, (SCRATCH_ROWS * STRIDE,), np.float32),
        carray(absorbed, (channels * SUMS * rows,), np.float64),
        carray(events, (STRIDE,), np.uint64),
        carray(exits, (STRIDE,), np.uint64),
        carray(layers, (rows * 4,), np.uint32),
        carray(crossings, (rows * 6,), np.uint32),
    )
    return trace_batch(seed, batch, photons, first_layer, diffuse != 0, stack, bins, ledger, blocks)
