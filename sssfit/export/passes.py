"""The passes of a table of taps: what each reads and writes, on which size, for how many fetches.

Pictures are named by what they hold: E the irradiance, A<n> what the first pass of stage n leaves,
B<n> stage n's picture, H<v> the picture halved v times, M<v> the sum of level v and of all that are
coarser. The sum of level 0 is the result. D<v> is the depth of level v, where passes follow depth.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from sssfit.kernel import Stage, Taps
from sssfit.kernel.structure import STAR_FETCHES


@dataclass(frozen=True, slots=True)
class Pass:
    """One draw over a picture.

    Parameters
    ----------
    kind : {"first", "second", "line", "star", "disk", "halve", "sum"}
        "first" and "second" are the two passes of a pair. A stage's last pass may add up, too.
    level : int
        How often the picture that it writes is halved.
    stages : tuple of int
        Stages that it runs, from 0: of the first pass of terms with the same offsets, all of these;
        of a change of size, the first stage on the smaller picture.
    reads : tuple of str
        What it fetches from all around, or of a sum the coarser one; "" if there is none.
    adds : tuple of tuple of (str, int)
        Pictures that it adds at the pixel itself, each with its row of the blend; its own stage is
        then added with the blend as well.
    writes : tuple of str
    fetches : int
        Fetches for each pixel that it writes.
    is_added : bool
        Whether the target adds what is written to what it holds.
    axis : tuple of float, optional
        The direction of mirrored fetches, right and down.
    is_blended : bool
        Whether the blend multiplies what it writes, where that is a sum.
    depths : tuple of str
        Pictures of depth that it reads, if any.
    """

    kind: str
    level: int
    stages: tuple[int, ...]
    reads: str
    adds: tuple[tuple[str, int], ...]
    writes: tuple[str, ...]
    fetches: int
    is_added: bool = False
    axis: tuple[float, float] | None = None
    is_blended: bool = True
    depths: tuple[str, ...] = ()

    @property
    def is_own(self) -> bool:
        """Whether it has a function of its own, not one that several passes call."""
        return (self.writes[0].startswith("M") and self.is_blended) or len(self.stages) > 1

    def takes_frame(self, *, jitter: bool) -> bool:
        """Whether its fetches lie elsewhere in each frame: those of a disk, jittered ones."""
        return self.kind == "disk" or (jitter and self.axis is not None)

    @property
    def pictures(self) -> tuple[str, ...]:
        """All pictures that it reads, in the order of its function's arguments."""
        return tuple(dict.fromkeys((self.reads, *(name for name, _ in self.adds), *self.depths)))

    @property
    def name(self) -> str:
        """The name of its function, without prefix."""
        if len(self.stages) > 1:
            return f"Terms{self.stages[0]}"
        if self.is_own:
            return f"Term{self.stages[0]}" if self.is_added else f"Sum{self.level}"
        return {"halve": "Halve", "star": "Star"}.get(self.kind, "Blur")

    @property
    def takes_stage(self) -> bool:
        """Whether its function is told the stage; a change of size is where it follows depth."""
        return not self.is_own and (self.kind != "halve" or bool(self.depths))

    @property
    def call(self) -> str:
        """Its function with the stage and the direction."""
        if not self.takes_stage:
            return self.name
        along = {None: "", (1.0, 0.0): ", x", (0.0, 1.0): ", y"}
        return f"{self.name}({self.stages[0]}{along.get(self.axis, self._turned())})"

    def _turned(self) -> str:
        """Return the direction of a turned pass, from x towards y."""
        right, down = self.axis or (1.0, 0.0)
        return f", {math.degrees(math.atan2(down, right)):.4g} deg"


def pass_list(taps: Taps, *, normalized: bool = False, depth: bool = False) -> tuple[Pass, ...]:
    """Return a table's passes in their order; their fetches, times 1/4 a halving, are its own.

    Parameters
    ----------
    taps : Taps
    normalized : bool
        Whether the blend adds up to 1; a single stage alone then needs none.
    depth : bool
        Whether they follow depth. Each fetch of light then comes with one of depth, a change of
        size takes four texels one by one, and terms share no pass, since each divides by a sum of
        its own.
    """
    found = list(_chain(taps) if taps.chained else _terms(taps, shared=not depth))
    if normalized and len(taps.stages) == 1 and not taps.blend[0].any() and not taps.is_disk:
        found[-1] = replace(found[-1], is_blended=False)
    return tuple(_with_depth(each) for each in found) if depth else tuple(found)


def _with_depth(each: Pass) -> Pass:
    """Return a pass with the pictures of depth that it reads and writes."""
    own, smaller, larger = (f"D{each.level + k}" for k in (0, 1, -1))
    if each.kind == "halve":
        return replace(each, depths=(larger,), writes=(*each.writes, own), fetches=2 * 4)
    if each.kind == "sum":
        return replace(each, depths=(smaller, own), fetches=2 * 4 + 1 + len(each.adds))
    return replace(each, depths=(own,), fetches=2 * each.fetches - len(each.adds))


def _chain(taps: Taps) -> Iterator[Pass]:
    """Yield the passes of stages that each read the one before."""
    last = taps.stages[-1].level
    level, picture = 0, "E"
    for k, stage in enumerate(taps.stages):
        if stage.level > level:
            level = stage.level
            yield Pass("halve", level, (k,), picture, (), (f"H{level}",), 1)
            picture = f"H{level}"
        adds = _added(taps, last) if k == len(taps.stages) - 1 else ()
        writes = (f"M{last}" if k == len(taps.stages) - 1 else f"B{k + 1}",)
        yield from _of_stage(stage, k, picture, adds, writes)
        picture = writes[0]
    for level in range(last - 1, -1, -1):
        adds = _added(taps, level)
        smaller = next(k for k, each in enumerate(taps.stages) if each.level > level)
        yield Pass("sum", level, (smaller,), f"M{level + 1}", adds, (f"M{level}",), 1 + len(adds))


def _of_stage(
    stage: Stage,
    k: int,
    picture: str,
    adds: tuple[tuple[str, int], ...],
    writes: tuple[str, ...],
) -> Iterator[Pass]:
    """Yield the passes of a stage of a chain."""
    count = STAR_FETCHES if stage.kind == "star" else 2 * len(stage.offsets_mm) + 1
    axes = [] if stage.kind == "star" else [(right, down) for down, right in stage.directions]
    if stage.kind == "pair":
        between = (f"A{k + 1}",)
        yield Pass("first", stage.level, (k,), picture, (), between, count, axis=axes[0])
        picture = between[0]
    kind = "second" if stage.kind == "pair" else stage.kind
    axis = axes[-1] if axes else None
    yield Pass(kind, stage.level, (k,), picture, adds, writes, count + len(adds), axis=axis)


def _added(taps: Taps, level: int) -> tuple[tuple[str, int], ...]:
    """Return what the sum of a level adds, but for its last stage where that is at hand."""
    found = [("E", 0)] if level == 0 else []
    found += [(f"B{k + 1}", k + 1) for k, each in enumerate(taps.stages) if each.level == level]
    is_last = level == taps.stages[-1].level
    if is_last:
        found.pop()
    added = tuple((name, row) for name, row in found if taps.blend[row].any())
    # A sum of a coarser one takes its coverage from a picture of its own size.
    return added if added or is_last else (found[0],)


def _terms(taps: Taps, *, shared: bool) -> Iterator[Pass]:
    """Yield the passes of stages that all read the irradiance; terms may share their first pass."""
    irradiance = (("E", 0),) if taps.blend[0].any() else ()
    if taps.is_disk:
        yield Pass("disk", 0, (0,), "E", irradiance, ("M0",), int(taps.fetches))
        return
    groups: dict[tuple[float, ...], list[int]] = {}
    for k, stage in enumerate(taps.stages):
        groups.setdefault(tuple(stage.offsets_mm.tolist()) if shared else (k,), []).append(k)
    for own in groups.values():
        count = 2 * len(taps.stages[own[0]].offsets_mm) + 1
        writes = tuple(f"A{k + 1}" for k in own)
        yield Pass("first", 0, tuple(own), "E", (), writes, count, axis=(1.0, 0.0))
        for k in own:
            adds = irradiance if k == 0 else ()
            total = count + len(adds)
            given = (f"A{k + 1}", adds, ("M0",), total, k > 0)
            yield Pass("second", 0, (k,), *given, axis=(0.0, 1.0))


def fetches_of(passes: Sequence[Pass]) -> float:
    """Return the fetches a pixel of the full picture."""
    return sum(each.fetches / 4.0**each.level for each in passes)
