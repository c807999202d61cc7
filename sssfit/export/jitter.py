"""Jitter of exported passes: which taps of a stage move, and by how much.

They are those of ``sssfit.render.jitter``, behind a switch.
"""

import math
from collections.abc import Iterator

from sssfit.errors import KernelError
from sssfit.export.constants import Writer
from sssfit.export.dialects import switch
from sssfit.kernel import Taps

_MOVED = ("pair", "line")


def check_jitter(taps: Taps) -> None:
    """Refuse tables without passes whose outer taps could move.

    Raises
    ------
    KernelError
    """
    if taps.is_disk:
        raise KernelError("a disk turns its fetches for each pixel already; export it as it is.")
    if not any(each.kind in _MOVED for each in taps.stages):
        raise KernelError(
            f"{taps.structure} has stars alone, and jitter moves the outer taps of pairs and "
            "lines; export it without jitter."
        )


def jitter_lines(taps: Taps, write: Writer) -> Iterator[str]:
    """Yield the constants: the first tap of each stage that moves, and how far they do."""
    from sssfit.render.jitter import Jitter  # its room is dear to load

    jitter, begin, outer = Jitter(), 0, []
    for each in taps.stages:
        still = jitter.still(len(each.offsets_mm)) if each.kind in _MOVED else len(each.offsets_mm)
        outer.append(begin + 1 + still)
        begin += len(each.weights)
    yield switch(write.prefix, "JITTER")
    yield "// Of a pass the outer third of the taps, rounded up: those from OUTER on."
    yield write.wholes("OUTER", outer)
    yield write.scalar("float", "JITTER_RADIANS", [math.radians(jitter.degrees)])
    yield write.scalar("float", "JITTER_SCALE", [jitter.scale])
    yield "#endif"
