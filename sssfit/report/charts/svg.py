"""Lines, bands, marks and axes as SVG; colours are classes, which the page's style fills."""

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Sequence

from markupsafe import Markup, escape

# Small, so that its words can be read where a phone shows it 290 pixels wide.
WIDTH, HEIGHT = 440.0, 300.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 74.0, 14.0, 14.0, 48.0
_TICKS = 6
_ROOM = 0.05  # of an axis, beyond the values at either end
_LEAST = 1e-30  # stands for 0 on a logarithmic axis
_INDEX = re.compile(r"(?<=\bR)_(\w)\b")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclasses.dataclass(frozen=True, slots=True)
class Chart:
    """A finished chart: its title, a sentence under it, a legend, and its pictures."""

    key: str
    title: str
    note: str
    legend: tuple[tuple[str, str], ...]  # class and name
    panels: tuple[tuple[str, Markup], ...]  # names and pictures, of which one is shown
    first: int = 0  # the panel that is shown first


@dataclasses.dataclass(frozen=True, slots=True)
class Axis:
    """A scale from values to places.

    Parameters
    ----------
    low, high : float
        Values at its ends.
    begin, end : float
        Their places.
    is_log : bool
    """

    low: float
    high: float
    begin: float
    end: float
    is_log: bool = False

    def place(self, value: float) -> float:
        """Return the place of a value, which may be beyond the ends."""
        low, high, at = self.low, self.high, value
        if self.is_log:
            low, high, at = math.log(low), math.log(high), math.log(max(value, _LEAST))
        return self.begin + (self.end - self.begin) * (at - low) / (high - low)

    def ticks(self) -> list[float]:
        """Return round values within the axis."""
        return _decades(self.low, self.high) if self.is_log else _steps(self.low, self.high)


def _decades(low: float, high: float) -> list[float]:
    first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
    if last - first >= 2:
        step = max(1, (last - first) // _TICKS + 1)
        return [10.0**k for k in range(first, last + 1, step)]
    near = [m * 10.0**k for k in range(first - 1, last + 1) for m in (1, 2, 5)]
    return [each for each in near if low <= each * (1 + 1e-9) and each <= high * (1 + 1e-9)]


def _steps(low: float, high: float) -> list[float]:
    rough = (high - low) / _TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


class Plot:
    """A panel with two axes, to which marks are added."""

    def __init__(
        self,
        x: tuple[float, float],
        y: tuple[float, float],
        names: tuple[str, str],
        *,
        log: tuple[bool, bool] = (False, False),
        describe: str,
    ) -> None:
        self.x = Axis(*x, _LEFT, WIDTH - _RIGHT, log[0])
        self.y = Axis(*y, HEIGHT - _BOTTOM, _TOP, log[1])
        self.parts: list[Markup] = []
        self.describe = describe
        self._axes(names)

    def _axes(self, names: tuple[str, str]) -> None:
        left, right, top, low = self.x.begin, self.x.end, self.y.end, self.y.begin
        for value in self.x.ticks():
            at = self.x.place(value)
            self.line([(at, top), (at, low)], "grid")
            self.text(at, low + 16, written(value), "tick middle")
        for value in self.y.ticks():
            at = self.y.place(value)
            self.line([(left, at), (right, at)], "grid")
            self.text(left - 7, at + 4, written(value), "tick end")
        self.line([(left, top), (left, low), (right, low)], "axis")
        self.text(0.5 * (left + right), HEIGHT - 8, names[0], "name middle")
        middle = 0.5 * (top + low)
        turn = Markup(' transform="rotate(-90 14 {:.1f})"').format(middle)
        self.text(14, middle, names[1], "name middle", turn)

    def line(self, points: Iterable[tuple[float, float]], kind: str) -> None:
        """Add a line through places."""
        self.add(line_of(points, kind))

    def _inside(self, part: Markup) -> Markup:
        """Return a part, cut off where it leaves the panel."""
        width, height = self.x.end - self.x.begin, self.y.begin - self.y.end
        box = Markup('<svg x="{0:.1f}" y="{1:.1f}" width="{2:.1f}" height="{3:.1f}" ')
        box += Markup('viewBox="{0:.1f} {1:.1f} {2:.1f} {3:.1f}">')
        return box.format(self.x.begin, self.y.end, width, height) + part + Markup("</svg>")

    def curve(self, x: Sequence[float], y: Sequence[float], kind: str) -> None:
        """Add a line through values; it ends where one is NaN, or not above 0 on a log axis."""
        for part in self._runs(x, y):
            places = [(self.x.place(a), self.y.place(b)) for a, b in part]
            self.add(self._inside(line_of(places, f"curve {kind}")))

    def _runs(self, x: Sequence[float], y: Sequence[float]) -> list[list[tuple[float, float]]]:
        runs: list[list[tuple[float, float]]] = [[]]
        for point in zip(x, y, strict=True):
            if math.isnan(point[1]) or (self.y.is_log and point[1] <= 0.0):
                runs.append([])
            else:
                runs[-1].append(point)
        return [each for each in runs if len(each) > 1]

    def band(
        self, x: Sequence[float], low: Sequence[float], high: Sequence[float], kind: str
    ) -> None:
        """Add the area between two curves."""
        up = [(a, b) for a, b in zip(x, high, strict=True) if not math.isnan(b)]
        down = [(a, b) for a, b in zip(x, low, strict=True) if not math.isnan(b)]
        places = [(self.x.place(a), self.y.place(b)) for a, b in (*up, *reversed(down))]
        path = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        self.add(self._inside(Markup('<polygon class="band {}" points="{}"/>').format(kind, path)))

    def text(self, x: float, y: float, words: str, kind: str, more: Markup | str = "") -> None:
        """Add words at a place."""
        self.parts.append(text_of(x, y, words, kind, more))

    def add(self, part: Markup) -> None:
        """Add what is drawn elsewhere."""
        self.parts.append(part)

    def svg(self, role: str = "img") -> Markup:
        """Return the picture; one with parts to be chosen is a group."""
        return picture(self.parts, HEIGHT, self.describe, role)


def line_of(points: Iterable[tuple[float, float]], kind: str) -> Markup:
    """Return a line through places."""
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return Markup('<polyline class="{}" points="{}"/>').format(kind, path)


def text_of(x: float, y: float, words: str, kind: str, more: Markup | str = "") -> Markup:
    """Return words at a place; a letter after an underscore is an index, as of R_d."""
    head = Markup('<text class="{}" x="{:.1f}" y="{:.1f}"{}>').format(kind, x, y, more)
    lowered = Markup('<tspan class="index" dy="3">{}</tspan><tspan dy="-3">{}</tspan>')
    first, *rest = _INDEX.split(words)
    indexed = (lowered.format(*pair) for pair in zip(rest[::2], rest[1::2], strict=True))
    return head + escape(first) + Markup("").join(indexed) + Markup("</text>")


def written(value: float) -> str:
    """Return a value as an axis has it: powers of ten beyond three zeros raised."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.4g}"
    mantissa, exponent = f"{value:.3e}".split("e")
    power = _power(exponent)
    return power if float(mantissa) == 1.0 else f"{float(mantissa):g}·{power}"


def digits(value: float) -> str:
    """Return a value with four digits, zeros at its end among them."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if 1e-4 <= abs(value) < 9999.5:
        return f"{value:#.4g}".rstrip(".")
    mantissa, exponent = f"{value:.3e}".split("e")
    return f"{mantissa}·{_power(exponent)}"


def _power(exponent: str) -> str:
    return f"10{str(int(exponent)).translate(_RAISED)}"


def picture(parts: Iterable[Markup], height: float, describe: str, role: str = "img") -> Markup:
    """Return parts as an SVG element with a description for those who do not see it."""
    head = Markup('<svg viewBox="0 0 {:.0f} {:.0f}" role="{}" aria-label="{}">')
    return head.format(WIDTH, height, role, describe) + Markup("").join(parts) + Markup("</svg>")


def limits(values: Iterable[float], *, is_log: bool, decades: float = 8.0) -> tuple[float, float]:
    """Return ends of an axis that holds values, with some room."""
    good: Callable[[float], bool] = (lambda v: v > 0.0) if is_log else math.isfinite
    found = [each for each in values if math.isfinite(each) and good(each)] or [0.1, 1.0]
    low, high = min(found), max(found)
    if is_log:
        low = max(low, high / 10.0**decades)
        room = max(1.25, (high / low) ** _ROOM)
        return low / room, high * room
    room = _ROOM * (high - low or 1.0)
    return (min(low, 0.0) if low >= 0.0 else low - room), high + room
