"""The solver for layers against the layered walk, on stacks drawn at random with fixed seeds."""

import checks
import checks_stack
import pytest
from scipy import stats

FEW = (2, 4, 8)  # a half space on two layers, a slab, a half space that scatters far ahead


def figures_of(seed, photons):
    material = checks_stack.random_stack(seed)
    return list(
        checks_stack.against_walk(
            f"stack {seed}", *checks_stack.solved_and_walked(material, photons)
        )
    )


@pytest.mark.parametrize("seed", FEW)
def test_a_stack_is_that_of_the_walk(seed):
    for figure in figures_of(seed, 100_000):
        assert abs(figure.sigmas) < checks.LIMIT, figure


@pytest.mark.slow
def test_forty_stacks_are_those_of_the_walk():
    figures = [each for seed in range(40) for each in figures_of(seed, 4_000_000)]
    worst = max(abs(each.sigmas) for each in figures)
    # Of so many normal figures, the worst passes this once in a thousand such runs.
    limit = stats.norm.isf(0.5e-3 / len(figures))
    assert worst < limit, max(figures, key=lambda each: abs(each.sigmas))
