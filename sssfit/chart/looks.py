"""What methods look like: one colour, marker and dash for each, in all charts.

Colours are Okabe and Ito's (2008, "Color Universal Design") and Tol's, safe for colour blindness;
no two methods share colour and marker. A new method is one entry here, and has a spare look before.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from matplotlib.colors import to_hex, to_rgb

from sssfit.chart.page import COLOURS, LINE_STYLES, SHADES, Style
from sssfit.methods import FITS, SIMULATIONS

Marker = str | tuple[int, int, int]
VERMILLION, GREEN, BLUE = COLOURS
PURPLE, GREY, ORANGE, SKY = SHADES[3:]
BLACK, RULE = "#000000", "#666666"  # the second is for limits and other lines that are no data
DASHED: Any = (0, (4, 2))
_SOLID: Any = "-"


@dataclass(frozen=True, slots=True)
class Look:
    """How a method is drawn.

    Parameters
    ----------
    name : str
        In legends.
    colour : str
    marker : str or tuple
    dashes : str or tuple
        Of its line, where a chart tells methods apart by them.
    size : float
        Of its marker, times that of a circle.
    """

    name: str
    colour: str
    marker: Marker
    dashes: Any = _SOLID
    size: float = 1.0

    def line(self, points: float = 4.0) -> Style:
        """Return the style of a line with markers of so many points."""
        return {"ls": self.dashes, **self.points(points)}

    def points(self, points: float = 4.0) -> Style:
        """Return colour and markers of so many points, for those without a line too."""
        return {"color": self.colour, "marker": self.marker, "ms": points * self.size}

    def stroke(self, width: float) -> Style:
        """Return the style of a line without markers."""
        return {"color": self.colour, "linestyle": self.dashes, "lw": width}


# What fits a kernel.
METHODS: Mapping[str, Look] = {
    "cascade": Look("cascade", BLACK, "*", size=1.5),
    "svd": Look("SVD", BLUE, "o"),
    "gaussians": Look("sum of Gaussians", VERMILLION, "s"),
    "preintegrated": Look("pre-integrated", GREEN, "^"),
    "guided": Look("guided", PURPLE, "D"),
    "artist": Look("artist", ORANGE, "v"),
    "falloff": Look("falloff", SKY, "P"),
    "burley": Look("Burley", "#777777", "X", (0, (1.3, 1.2))),
    "weighted": Look("weighted terms", "#882255", "<", DASHED),
    "gaussian-chain": Look("chain of Gaussians", "#661100", "d"),
    "pyramid": Look("convolution pyramid", "#44aa99", "h"),
    "rotated": Look("passes in 3 or 4 directions", "#aa4499", "8"),
    "disk": Look("disk, one frame", "#999933", "p"),
}
# What simulates a profile; Burley's is the one above.
MODELS: Mapping[str, Look] = {
    "exact": Look("exact", BLACK, "."),
    "montecarlo": Look("photon walk", SKY, "o"),
    "dipole": Look("dipole", VERMILLION, ">", (0, (5, 1.5))),
    "dipole-grosjean": Look("dipole-grosjean", BLUE, "<", (0, (6, 1.4, 1.2, 1.4))),
    "burley": METHODS["burley"],
    "multipole": Look("multipole", VERMILLION, "H", (0, (5, 1.5))),  # of layers, without dipoles
}
# What renders a sequence; the separable kernel is pre-integrated.
RENDERERS: Mapping[str, Look] = {
    "without": Look("adaptive, no control variates", VERMILLION, "o"),
    "variates": Look("adaptive, control variates", PURPLE, "o", LINE_STYLES[1]),
    "ahead": Look("adaptive, next frame's light", BLUE, "o", LINE_STYLES[2]),
    "fixed": Look("fixed sampling", ORANGE, "o"),
    "separable": Look("separable kernel", GREEN, "^", LINE_STYLES[1]),
    "cascade": Look("cascade of taps", BLACK, "*", LINE_STYLES[2]),
}
# Of what has no entry, each in turn; these are Tol's, too.
_SPARE_COLOURS = ("#332288", "#117733", "#cc6677")
_SPARE_MARKERS: tuple[Marker, ...] = (">", "H", (4, 1, 0), (6, 1, 0))
# Of series that are no methods: pictures, numbers of heads.
SERIES_MARKERS = "os^Dv<>P*X"
_RING = 1.8  # size of a hollow marker over the filled one's
# Of one method's kernels with several settings, after its own marker.
_VARIANT_MARKERS = "os^DvPph8"


def look(method: str) -> Look:
    """Return a fit's look; a spare one with its own name if it has none."""
    return _look(method, METHODS, FITS)


def model_look(method: str) -> Look:
    """Return the look of what simulates a profile; a spare one if it has none."""
    return _look(method, MODELS, SIMULATIONS)


def _look(method: str, looks: Mapping[str, Look], known: Iterable[str]) -> Look:
    if method in looks:
        return looks[method]
    others = [each for each in known if each not in looks]
    return spare(method, others.index(method) if method in others else len(others))


def spare(name: str, k: int) -> Look:
    """Return the k-th look of what has none of its own; the first twelve are different."""
    marker = _SPARE_MARKERS[k % len(_SPARE_MARKERS)]
    return Look(name, _SPARE_COLOURS[k % len(_SPARE_COLOURS)], marker, LINE_STYLES[k % 4])


def series(k: int, points: float = 4.2) -> Style:
    """Return colour and marker of the k-th of what is no method, different for seven."""
    return {
        "color": SHADES[k % len(SHADES)],
        "marker": SERIES_MARKERS[k % len(SERIES_MARKERS)],
        "markersize": points,
    }


def method_of(label: str) -> str | None:
    """Return the method whose kernel a label names, such as "svd 3 on taps"; None if none."""
    known = {name: key for key, each in METHODS.items() for name in (key, each.name)}
    known |= {name: name for name in MODELS}
    begun = [name for name in known if label == name or label.startswith((f"{name} ", f"{name},"))]
    return known[max(begun, key=len)] if begun else None


def variants(labels: Iterable[str], points: float) -> dict[str, Style]:
    """Return a style for each label: the colour of its method, and a marker that no other has.

    The first of a method has its marker, the second the same hollow, then come others.
    """
    found: dict[str, Style] = {}
    used: dict[str | None, int] = {}
    for label in dict.fromkeys(labels):
        method = method_of(label)
        k = used[method] = used.get(method, -1) + 1
        found[label] = _variant(method, k, points)
    return found


def _variant(method: str | None, k: int, points: float) -> Style:
    if method is None:
        turn, place = divmod(k, len(_SPARE_COLOURS))
        own = Look("", _SPARE_COLOURS[place], _SPARE_MARKERS[place])
        k = turn
    else:
        own = METHODS.get(method) or MODELS[method]
    others = [each for each in _VARIANT_MARKERS if each != own.marker]
    markers = [(own.marker, own.size), *((each, 1.0) for each in others)]
    marker, size = markers[k // 2 % len(markers)]
    is_hollow = k % 2 == 1  # and wider, a ring around the filled one where both are at one place
    return {
        "color": own.colour,
        "marker": marker,
        "markersize": points * size * (_RING if is_hollow else 1.0),
        "markerfacecolor": "none" if is_hollow else own.colour,
        "markeredgewidth": 0.7,
        "linestyle": LINE_STYLES[k % len(LINE_STYLES)],
    }


def tinted(colour: str, share: float) -> str:
    """Return a colour with so much of it left, the rest white."""
    red, green, blue = (1.0 - share * (1.0 - each) for each in to_rgb(colour))
    return str(to_hex((red, green, blue)))
