"""Where the names of points stand on a chart: beside their points, and on nothing else."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

Place = tuple[float, float]
Box = tuple[float, float, float, float]  # left, top, right and bottom

_LETTER, _LINE = 7.0, 14.0  # width and height of a name's letter on a phone, its largest
_TAIL = 3.0  # of letters such as p, below their line
_APART = 9.0  # a name from the middle of its point
# Of a name beside its point, in lines from its top to the point; those that hang below come first.
_RISES = (0.0, 0.5, 1.0, -0.5, 1.5, -1.0, 2.0, 2.5, -1.5)


@dataclass(frozen=True, slots=True)
class Name:
    """The lines of a name and where they are.

    Parameters
    ----------
    lines : tuple of str
    x, top : float
        The end of the lines that is nearer to the point, and the top of the first.
    kind : str
        The class of their anchor: "end" of a name left of its point, else "start".
    """

    lines: tuple[str, ...]
    x: float
    top: float
    kind: str

    @property
    def box(self) -> Box:
        """Return the room that the name takes."""
        width = _LETTER * max(map(len, self.lines))
        left = self.x - width if self.kind == "end" else self.x
        return left, self.top, left + width, self.top + _LINE * len(self.lines) + _TAIL

    def placed_lines(self) -> list[tuple[float, str]]:
        """Return the base line and the words of each line."""
        return [(self.top + _LINE * (k + 1), words) for k, words in enumerate(self.lines)]


def named(points: Sequence[tuple[Place, str]], taken: Sequence[Box], room: Box) -> dict[str, Name]:
    """Return where each name goes, without those that fit nowhere beside their points.

    Names with the fewest places choose first, since one with many has others.

    Parameters
    ----------
    points : sequence of (place, str)
        Points and their names.
    taken : sequence of Box
        What no name may stand on.
    room : Box
        What no name may leave.
    """
    choices = {
        label: [each for each in _tried(place, label) if _fits(each.box, taken, room)]
        for place, label in points
    }
    found: dict[str, Name] = {}
    while choices:
        label = min(choices, key=lambda each: len(choices[each]))
        for first in choices.pop(label)[:1]:
            found[label] = first
            for other, every in choices.items():
                choices[other] = [each for each in every if not meet(each.box, first.box)]
    return found


def meet(one: Box, other: Box) -> bool:
    """Return whether two boxes share some area."""
    across = one[0] < other[2] and other[0] < one[2]
    return across and one[1] < other[3] and other[1] < one[3]


def _fits(box: Box, taken: Sequence[Box], room: Box) -> bool:
    is_inside = box[0] >= room[0] and box[1] >= room[1] and box[2] <= room[2] and box[3] <= room[3]
    return is_inside and not any(meet(box, each) for each in taken)


def _tried(place: Place, label: str) -> Iterator[Name]:
    """Yield where a name may stand, the best first: left of its point and in two lines."""
    x, y = place
    for kind, at in (("end", x - _APART), ("start", x + _APART)):
        for lines in dict.fromkeys((tuple(label.replace(" on ", "\non ").split("\n")), (label,))):
            for rise in _RISES:
                yield Name(lines, at, y - rise * _LINE, kind)
