"""Wording of figures, values and names: on one line, in printable characters."""

import contextlib
import logging
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from string import Formatter
from typing import Any, TypeAlias

_MOST_NAMED = 4  # channels named in a record's repr
SHARE = "share"  # format of a share of the light: six decimals, faint ones by their exponent
_LEAST_FIXED = 1e-4
_MOST_SHOWN = 60  # characters of a value that a message repeats


def note(line: str) -> None:
    """Tell the user what a result does not show: a record of the logger "sssfit", level INFO.

    The command line prints it; in Python ``logging.basicConfig(level="INFO")`` does.
    """
    logging.getLogger("sssfit").info("%s", line)


@contextlib.contextmanager
def without_notes() -> Iterator[None]:
    """Tell the user nothing in this block: what one of thousands of runs notes is no news."""
    log = logging.getLogger("sssfit")
    log.addFilter(_nothing)
    try:
        yield
    finally:
        log.removeFilter(_nothing)


def _nothing(record: logging.LogRecord) -> bool:
    return record.levelno > logging.INFO


def printable(text: str) -> str:
    """Escape unprintable characters, also newlines, so that ``text`` can be part of a message."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def shown(value: object) -> str:
    """Return a value as one short printable line: control characters escaped, cut at 60."""
    import numpy as np  # the command line asks for `printable` before it loads anything heavy

    try:
        text = repr(value.item() if isinstance(value, np.generic) else value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a huge number"
    except RecursionError:  # a dotted key of 20 000 parts reads without one
        text = "tables nested too deep"
    text = printable(text)  # a repr of an array has newlines
    return text if len(text) <= _MOST_SHOWN else text[: _MOST_SHOWN - 3] + "..."


def stated(path: str) -> str:
    """Return that a file was written, or what "-" stands for."""
    return f"Wrote {path}" if path != "-" else "Wrote to stdout"


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """Return ``did you mean X? `` for the nearest known word, or nothing if none is near."""
    import difflib  # 5 ms that help does not need

    near = difflib.get_close_matches(word.lower(), known, n=1, cutoff=0.65)
    return f"did you mean {near[0]}? " if near else ""


def table(
    header: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[int] = (0,)
) -> str:
    """Return columns under their heads: those in ``left`` flush left, the others flush right.

    None is cut.
    """
    widths = [max(len(row[k]) for row in [header, *rows]) for k in range(len(header))]
    lines = (
        "  ".join(
            cell.ljust(width) if k in left else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in [header, *rows]
    )
    return "\n".join(lines)


def columns(head: str, names: Sequence[str], *each: tuple[str, Sequence[Any] | None, str]) -> str:
    """Return a table with one row per name: heads with units, and values with their formats.

    A column without values is omitted; see `number` for formats.
    """
    shown = [(title, values, form) for title, values, form in each if values is not None]
    rows = [
        [name, *(number(values[k], form) for _, values, form in shown)]
        for k, name in enumerate(names)
    ]
    return table([head, *(title for title, _, _ in shown)], rows)


def number(value: Any, form: str) -> str:
    """Return a figure as text by a format; a format that ends in % is for shares.

    Shares below 1e-9 are rounding of sums of pixels: 0 %. Unknown figures are a dash, or the text
    after a bar: ".3g%|unknown".
    """
    form, _, unknown = form.partition("|")
    if value is None or value != value:
        return unknown or "-"
    if form == SHARE:
        form = ".3e" if 0.0 < abs(value) < _LEAST_FIXED else ".6f"
    if not form.endswith("%"):
        return f"{value:{form}}"
    return "0 %" if abs(value) < 1e-9 else f"{_per_cent(100.0 * value, form[:-1])} %"


def _per_cent(value: float, form: str) -> str:
    """Write per cents without an exponent where they are large, and 0 without a minus."""
    text = f"{value:{form.replace('.', 'z.')}}"
    sign = "+" if form.startswith("+") else ""
    return f"{float(text):{sign}.0f}" if "e+" in text else text


_PLURALS = {"annulus": "annuli", "entry": "entries"}


def counted(value: Any, noun: str, form: str = "") -> str:
    """Return a count with its noun: "1 pass", "2 passes", "22.84 fetches".

    Parameters
    ----------
    value : number
    noun : str
        In the singular, also of several words: "mean free path".
    form : str
        Format as in `number`.
    """
    text = number(value, form)
    ending = "es" if noun.endswith(("s", "x", "ch", "sh")) else "s"
    return f"{text} {noun if text == '1' else _PLURALS.get(noun, noun + ending)}"


class _Template(Formatter):
    """A template whose fields are formatted by `number`, or by `counted`: {fetches:.4g#fetch}."""

    def format_field(self, value: Any, form: str) -> str:
        """Format a figure; anything without a format stays as it is."""
        form, _, noun = form.partition("#")
        if noun:
            return counted(value, noun, form)
        return number(value, form) if form else str(value)


def one_of(words: Sequence[str]) -> str:
    """Return words as a choice: "EXR, TIFF or PNG"."""
    *others, last = words
    return f"{', '.join(others)} or {last}" if others else last


def filled(template: str, figures: Mapping[str, Any]) -> str:
    """Fill a template from a record's figures: "{width} pixels, off by {relative_l2:.3g%|inf %}".

    See `number` for formats; "{chosen[label]}" is a figure of a part, "{passes:#pass}" a count with
    its noun.
    """
    return _Template().vformat(template, (), figures)


@dataclass(frozen=True, slots=True)
class Columns:
    """A table of a report with one row per name; see `columns`.

    ``names`` is the key of the names; ``each`` has title, key and format of each column.
    """

    head: str
    names: str
    each: tuple[tuple[str, str, str], ...]


Part: TypeAlias = str | Columns | tuple[str, str | Columns]


def report(parts: Iterable[Part], figures: Mapping[str, Any]) -> str:
    """Return a record's figures as a report; each part is a line or a table.

    A part is a template of `filled` or `Columns`; with a key before it, the part is omitted if the
    figure of that key is None.
    """
    lines = []
    for part in parts:
        key, shown = part if isinstance(part, tuple) else ("", part)
        if key and figures[key] is None:
            continue
        if isinstance(shown, Columns):
            each = [(title, figures[own], form) for title, own, form in shown.each]
            lines.append(columns(shown.head, figures[shown.names], *each))
        else:
            lines.append(filled(shown, figures))
    return "\n".join(lines)


def by_channel(channels: Sequence[str], values: Sequence[Any], form: str) -> str:
    """Return a figure for each channel in one line: "R 0.42, G 0.21", the first four of many."""
    named = [f"{_short(channels[c])} {number(values[c], form)}" for c in range(len(channels))]
    named = named[:_MOST_NAMED]
    more = len(channels) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")


def of_material(name: object) -> str:
    """Return the name of a record's material, if it has one."""
    return "unknown material" if name is None else _short(printable(str(name)))


def _short(name: str) -> str:
    """Shorten a name that would fill the line."""
    return name if len(name) <= _MOST_SHOWN // 2 else name[: _MOST_SHOWN // 2 - 3] + "..."


def html_table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table for a notebook; all texts are escaped."""
    from html import escape  # its entities take 3 ms that help does not need

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(each)}</{tag}>" for each in cells) + "</tr>"

    lines = [row(heads, "th"), *(row(cells, "td") for cells in rows)]
    return "\n".join(["<table>", f"<caption>{escape(caption)}</caption>", *lines, "</table>"])
