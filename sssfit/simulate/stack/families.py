"""Which stacks are solved together: those that share a layer, whose modes are then found once."""

from collections.abc import Sequence

from sssfit.simulate.stack.slabs import Slab, SlabStack

Layers = set[tuple[float, ...]]


def families_of(stacks: Sequence[SlabStack]) -> list[list[int]]:
    """Return the numbers of the stacks of each family, all of which scatter.

    Stacks are related if they have the same refractive indices, so the same directions, and a
    scattering layer in common, of any thickness.
    """
    groups: list[tuple[Layers, list[int]]] = []
    for number, stack in enumerate(stacks):
        own = {(*_optics(each), *stack.indices) for each in stack.scattering}
        related = [group for group in groups if group[0] & own]
        layers = own.union(*(group[0] for group in related))
        members = sorted([number, *(each for group in related for each in group[1])])
        groups = [group for group in groups if group not in related] + [(layers, members)]
    return [members for _, members in groups]


def _optics(slab: Slab) -> tuple[float, ...]:
    return slab.sigma_a, slab.sigma_s, slab.g, slab.eta
