"""What the texts of presets have in common: their heads, and how numbers are written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.sax.saxutils import escape

from sssfit import __version__
from sssfit.export.presets.record import Parameters
from sssfit.messages import printable


def head(parameters: Parameters, mark: str) -> Iterator[str]:
    """Yield comment lines: what it is, the units of each parameter, and the warnings."""
    preset = parameters.preset
    yield f"{mark} {preset.engine}: {printable(parameters.title)}, by sssfit {__version__}."
    yield f"{mark} Model: {preset.model}."
    for each in preset.fields:
        unit = f" [{each.unit}]" if each.unit not in ("", "1") else ""
        yield f"{mark}   {each.name}{unit}: {each.meaning}"
    yield f"{mark} Lost: {preset.lost}"
    for warning in parameters.warnings:
        yield f"{mark} Warning: {warning}"


def lines(parameters: Parameters, mark: str, body: Iterable[str]) -> str:
    """Return a text of a head and its body."""
    return "\n".join([*head(parameters, mark), *body, ""])


def xml_comment(parameters: Parameters) -> str:
    """Return the head as the inside of an XML comment, in which -- may not stand."""
    words = "\n".join(f"  {line.strip()}" for line in head(parameters, ""))
    return escape(words.replace("--", "- -"))


def identifier(title: str) -> str:
    """Return a title in letters, digits and underscores."""
    return "".join(c if c.isalnum() else "_" for c in title)


def number(value: float) -> str:
    """Return a number with nine digits, always with a point or an exponent."""
    text = f"{value:.9g}"
    return text if any(each in text for each in ".en") else f"{text}.0"


def numbers(values: Iterable[float], between: str = ", ") -> str:
    """Return several."""
    return between.join(number(each) for each in values)
