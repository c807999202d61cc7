"""What more directions would still change, from what the last ones did.

The difference between N and N - 4 directions is the error of the coarser. It is also one of the
finer where four more directions halve an error or better. Of a steep phase function they leave a
share of it that is known. Panels of directions grow in turn, and one difference may be small by
chance: so the difference before it counts too.
"""

from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.simulate.stack.slabs import SlabStack

_STEP = 4  # directions
_POWER = 8  # of g: four more directions leave g^8 of an error
_POWER_TURNED = 2  # in light that turned back twice and crosses a stack
_MOST, _MOST_AHEAD = 0.85, 0.75  # ratios; half spaces of g = .995 show that ahead
# Differences cover the errors of half spaces of g up to .934 (milk); those of g = .95 with an index
# of 1 and 1.4 have errors of 2 and 1.3 times the difference. Of thin stacks that scatter ahead, the
# difference of the peaks in light from below is larger than the errors on either side.
_STEEP_AHEAD = 0.94


@dataclass(frozen=True, slots=True)
class Tail:
    """``ratio`` of the errors of N + 4 and N directions; 0 where the difference alone will do."""

    ratio: float

    @classmethod
    def of(cls, stack: SlabStack) -> "Tail":
        """Return that of a stack's steepest phase function."""
        steepness = [0.0, *(each.g for each in stack.scattering)]
        back, ahead = -min(steepness), max(steepness)
        ratio = min(back ** (_POWER_TURNED if stack.is_seen_through else _POWER), _MOST)
        if ahead > _STEEP_AHEAD and not stack.is_seen_through:
            ratio = max(ratio, min(ahead**_POWER, _MOST_AHEAD))
        return cls(ratio)

    def over(self, more: int) -> "Tail":
        """Return that of so many more directions than four."""
        return Tail(self.ratio ** (more / _STEP))

    def left(self, now: FloatArray, before: FloatArray) -> FloatArray:
        """Return the error from the last two differences of as many directions."""
        largest = np.abs(now)
        if self.ratio == 0.0:
            return largest
        largest = np.maximum(largest, self.ratio * np.abs(before))
        found: FloatArray = largest * max(1.0, self.ratio / (1.0 - self.ratio))
        return found
