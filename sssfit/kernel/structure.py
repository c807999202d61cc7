"""The structure of a cascade in one line of text, such as ``1-1|2-2|2-2``, and what it costs.

A number is a stage of two passes with that many mirrored pairs of taps beside the middle one, ``*``
a star: nine fetches in one pass. ``2x`` is a stage of two passes along the diagonals. Stages are
joined by ``-``, and by ``|`` where the picture is halved in both directions. Lines, a pass in one
direction, are written ``4@60`` with their angle in degrees; no cascade has them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from sssfit.errors import KernelError
from sssfit.messages import counted, shown

MOST_PAIRS, MOST_STAGES, MOST_LEVELS = 64, 24, 10
MOST_ON_DISK = 256  # fetches
MOST_IN_PASS = 256  # pairs of fetches, of dense passes, too
_STAR, _DIAGONAL = "*", "x"
DIAGONAL_DEGREES = 45.0
STAR_FETCHES = 9


class Shape(NamedTuple):
    """A stage without its numbers: its kind, its pairs of taps a pass, resolution level, angle."""

    kind: str
    pairs: int
    level: int
    angle_degrees: float = 0.0

    @property
    def is_upright(self) -> bool:
        """Whether it is a pair of passes along the axes."""
        return self.kind == "pair" and self.angle_degrees == 0.0

    @property
    def fetches(self) -> int:
        """Fetches of the stage's passes, per texel of its level."""
        return {"pair": 2, "line": 1}.get(self.kind, 0) * (2 * self.pairs + 1) or STAR_FETCHES

    @property
    def passes(self) -> int:
        """Passes over the picture: two of a pair, one of the other kinds."""
        return 2 if self.kind == "pair" else 1


def turn_on_disk(k: int) -> float:
    """Return where the k-th fetch of a disk lies, from 0, as a share of a full turn."""
    return k * 2.0 / (1.0 + math.sqrt(5.0)) % 1.0


def directions(shape: Shape) -> tuple[tuple[float, float], ...]:
    """Return unit vectors (down, right) of the passes of a pair or a line, in their order."""
    turns = {"pair": (0.0, 90.0), "line": (0.0,)}[shape.kind]
    if shape.angle_degrees == 0.0:  # exactly along the axes
        return ((0.0, 1.0), (1.0, 0.0))[: len(turns)]
    angles = [math.radians(shape.angle_degrees + each) for each in turns]
    return tuple((math.sin(each), math.cos(each)) for each in angles)


@dataclass(frozen=True, slots=True)
class Cost:
    """What a table of taps costs per pixel of the full picture.

    Parameters
    ----------
    fetches : float
        Texture fetches; those of a picture halved v times count 4^-v.
    passes : int
        Passes of the stages: two of a pair, one of a star or a line.
    all_passes : int
        With the passes that halve the picture and those that add its levels up.
    pictures : float
        Pictures read, each once a pass, and written, in full pictures.
    """

    fetches: float
    passes: int
    all_passes: int
    pictures: float


def parse(text: str) -> tuple[Shape, ...]:
    """Return the stages of a structure.

    Raises
    ------
    KernelError
        It is not one: the message says what was expected.
    """
    groups = [part.split("-") for part in text.split("|")] if isinstance(text, str) else [[""]]
    words = [(word.strip(), level) for level, group in enumerate(groups) for word in group]
    if not all(word == _STAR or _is_count(word.removesuffix(_DIAGONAL)) for word, _ in words):
        raise KernelError(
            f"stages = {shown(text)}; expected numbers of tap pairs from 1 to {MOST_PAIRS}, with "
            "an x where the passes are diagonal, or *, joined by - or, where the picture is "
            "halved, by |, such as '1-1|2-2|2-2'."
        )
    if len(words) > MOST_STAGES or len(groups) > MOST_LEVELS:
        raise KernelError(
            f"stages = {shown(text)} has {counted(len(words), 'stage')} on "
            f"{counted(len(groups), 'level')}; expected at "
            f"most {MOST_STAGES} on {MOST_LEVELS}."
        )
    return tuple(
        Shape("star", 1, level) if word == _STAR else _pair(word, level) for word, level in words
    )


def _pair(word: str, level: int) -> Shape:
    angle = DIAGONAL_DEGREES if word.endswith(_DIAGONAL) else 0.0
    return Shape("pair", int(word.removesuffix(_DIAGONAL)), level, angle)


def _is_count(word: str) -> bool:
    return word.isascii() and word.isdecimal() and len(word) < 4 and 1 <= int(word) <= MOST_PAIRS


def text_of(shapes: Sequence[Shape]) -> str:
    """Return the text of a structure, which `parse` reads where a cascade can have it.

    A line is ``4@60``, a pair at another angle than 45 degrees ``4x30``; a disk of 24 radii is
    ``24 rings``.
    """
    levels: list[list[str]] = [[] for _ in range(max(each.level for each in shapes) + 1)]
    for each in shapes:
        levels[each.level].append(_word(each))
    return "|".join("-".join(level) for level in levels)


def _word(shape: Shape) -> str:
    count, angle = f"{shape.pairs}", f"{shape.angle_degrees:g}"
    if shape.kind == "pair" and shape.angle_degrees:
        return count + _DIAGONAL + ("" if shape.angle_degrees == DIAGONAL_DEGREES else angle)
    return {"pair": count, "star": _STAR, "disk": f"{count} rings", "line": f"{count}@{angle}"}[
        shape.kind
    ]


def cost_of_chain(shapes: Sequence[Shape], shown_rows: Sequence[bool] | None = None) -> Cost:
    """Return the cost of a chain of stages whose pictures are added up.

    A texel of level v pays the fetches of its stages; one for each of its stages' pictures that is
    added up; one for the irradiance (level 0), or for the picture that it is halved from; one for
    the coarser level that it adds. The last stage of all is still at hand when its level is added
    up. All times 4^-v.

    Parameters
    ----------
    shapes : sequence of Shape
    shown_rows : sequence of bool, optional
        Whether the irradiance and each stage's picture are part of the sum; by default all are.
    """
    rows = [True] * (len(shapes) + 1) if shown_rows is None else list(shown_rows)
    last = shapes[-1].level
    fetches = pictures = 0.0
    for level in range(last + 1):
        own = [(each, rows[k + 1]) for k, each in enumerate(shapes) if each.level == level]
        at_hand = level == last and own[-1][1]
        added = sum(is_shown for _, is_shown in own) + (level == 0 and rows[0]) - at_hand
        texel = sum(each.fetches for each, _ in own) + (level > 0) + added + (level < last)
        fetches += texel / 4.0**level
        moved = sum(2.0 * each.passes for each, _ in own) + added
        # Halving reads four texels for each that it writes; adding up reads a quarter of one.
        moved += 5.0 * (level > 0) + 1.25 * (level < last)
        pictures += moved / 4.0**level
    passes = sum(each.passes for each in shapes)
    return Cost(fetches, passes, passes + 2 * last, pictures)


def cost_of_disk(fetches: int) -> Cost:
    """Return the cost of single fetches in one pass, which reads a picture and writes one."""
    return Cost(float(fetches), 1, 1, 2.0)


def cost_of_terms(offsets: Sequence[tuple[float, ...]], *, shows_irradiance: bool) -> Cost:
    """Return the cost of separable terms, each a pair of passes over the irradiance.

    Terms with the same offsets share their first pass. The second passes add up as they go.

    Parameters
    ----------
    offsets : sequence of tuple
        The offsets of each term.
    shows_irradiance : bool
        Whether the irradiance itself is part of the sum.
    """
    first = sum(2 * len(each) + 1 for each in set(offsets))
    second = sum(2 * len(each) + 1 for each in offsets)
    passes = len(set(offsets)) + len(offsets)
    # A shared first pass reads the irradiance once and writes a picture for each of its terms.
    pictures = len(set(offsets)) + 2.0 * len(offsets) + 1.0 + shows_irradiance
    return Cost(float(first + second + shows_irradiance), passes, passes, pictures)
