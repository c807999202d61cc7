"""MCML input files (``.mci``): the runs they describe, as materials and grids in mm.

`Lines` reads the data lines of MCML's files, inputs and outputs, in order; every message names the
file, the line, its content and what was expected there.

The format is that of MCML 1.2.2: L. Wang, S. L. Jacques, "Monte Carlo modeling of light transport
in multi-layered tissues in standard C" (the manual), 1992-1995, section 9.1; Wang, Jacques, Zheng,
Computer Methods and Programs in Biomedicine 47, 1995. A file holds a version (1.0), the number of
runs, and for each run from the top down::

    skin.mco  A                  # output file, format: A is ASCII
    1000000                      # photons
    0.01  0.01                   # dz dr [cm]
    40  50  1                    # number of dz, dr, da
    2                            # number of layers
    1.0                          # n above
    1.37  1  100  0.9  0.1       # n mua mus g d of each layer: 1/cm, 1/cm, 1, cm
    1.37  1  10   0    1E8
    1.0                          # n below

Only ratios of refractive indices count, so n may be below 1; g = 1 means no scattering.
``sssfit.formats.mco`` reads MCML's output.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from sssfit.errors import MaterialError, SssfitError
from sssfit.grid import MOST_ANNULI, RadialGrid
from sssfit.material import Layer, Material
from sssfit.material.checks import MAX_ETA, MIN_ETA
from sssfit.messages import counted, printable, shown
from sssfit.text import decimal_shifted, finite_number, read_text

# Comments of the two formats. In an input a comment begins at any #. In an output that would turn
# the 1.#INF of some C libraries into 1, so a space or tab must precede it, as in MCML's own
# comments.
INPUT_COMMENT = re.compile(r"#")
OUTPUT_COMMENT = re.compile(r"(?:^|\s)#")


# First words of files of MCML 2 and 3: mcmli2.0 and mcmli_3.0 (inputs), mcmloA2.0 and mcmlo_3.0
# (outputs in ASCII).
_OTHER_VERSION = re.compile(r"mcml[io][ab]?_?(\d+(?:\.\d+)*)", re.IGNORECASE | re.ASCII)


def other_version(word: str) -> str | None:
    """Return the version of MCML that a file's first word names; None for MCML 1, and others."""
    match = _OTHER_VERSION.fullmatch(word)
    return match[1] if match else None


class Line(NamedTuple):
    """A line's number in the file, from 1, and its words without the comment, at least one."""

    number: int
    words: tuple[str, ...]


class Lines:
    """The data lines of a text, without blank lines and comments.

    Parameters
    ----------
    text : str
        The whole file.
    origin : str
        Its name in messages.
    comment : re.Pattern
        Pattern of the start of a comment.
    error : type
        Class of the errors to raise.
    """

    def __init__(
        self, text: str, origin: str, *, comment: re.Pattern[str], error: type[SssfitError]
    ) -> None:
        self._raw = text.split("\n")
        self._taken = 0
        self._origin, self._error = printable(origin), error
        self.comment = comment

    def failure(self, number: int, said: str) -> SssfitError:
        """Return the error to raise for a line."""
        return self._error(f"{self._origin}: line {number}: {said}")

    def peek(self) -> Line | None:
        """Return the next data line without consuming it; None at the end."""
        while self._taken < len(self._raw):
            words = self.comment.split(self._raw[self._taken], maxsplit=1)[0].split()
            if words:
                return Line(self._taken + 1, tuple(words))
            self._taken += 1
        return None

    def take(self, expected: str) -> Line:
        """Consume the next data line, which should hold ``expected``."""
        line = self.peek()
        if line is None:
            end = len(self._raw) - (self._raw[-1] == "")
            raise self._error(
                f"{self._origin}: ends after line {end}, before {expected}; it is cut short, or a "
                "number in it announces more than there is."
            )
        self._taken += 1
        return line

    def take_words(self, *names: str) -> Line:
        """Consume a line with as many words as there are names."""
        wanted = ", ".join(names)
        line = self.take(wanted)
        if len(line.words) != len(names):
            values = counted(len(line.words), "value")
            raise self.failure(
                line.number,
                f"{shown(' '.join(line.words))} has {values}; expected {len(names)} ({wanted}). A "
                "comment begins with #.",
            )
        return line

    def whole(self, line: Line, k: int, name: str, most: int) -> int:
        """Return word k as a whole number from 1 to ``most``."""
        word = line.words[k]
        value = int(word) if re.fullmatch(r"\+?[0-9]{1,18}", word) else 0
        if not 1 <= value <= most:
            raise self.failure(
                line.number,
                f"{name} = {shown(word)}; expected a whole number from 1 to {most}, in digits.",
            )
        return value

    def real(
        self,
        line: Line,
        k: int,
        name: str,
        allowed: Callable[[float], bool],
        expected: str,
        *,
        tenfold: int = 0,
    ) -> float:
        """Return word k, checked as written, times 10 to the power ``tenfold``.

        The shift is decimal: 7.4 per cm gives the same bits as 0.74 per mm.
        """
        word = line.words[k]
        value = finite_number(word)
        if value is None:
            raise self.failure(
                line.number, f"{name} = {shown(word)} is not a number; expected {expected}."
            )
        if not allowed(value):
            raise self.failure(
                line.number, f"{name} = {shown(word)} is out of range; expected {expected}."
            )
        return decimal_shifted(word, tenfold)


CHANNEL = "mono"
SEMI_INFINITE_CM = 1e6  # 10 km; the manual writes 1E8 cm, "Separable Subsurface Scattering" 1e7

_MOST = 10**12
_LENGTH = "a length above 0, in cm"
_COEFFICIENT = "a number of 0 or more, in 1/cm"
_INDEX = f"a refractive index from {MIN_ETA} to {MAX_ETA}"

# The columns of a layer's line: name, valid values, expectation in messages, power of ten to mm.
_COLUMNS: tuple[tuple[str, Callable[[float], bool], str, int], ...] = (
    ("n", lambda v: MIN_ETA <= v <= MAX_ETA, _INDEX, 0),
    ("mua", lambda v: 0 <= v <= 1e9, _COEFFICIENT, -1),
    ("mus", lambda v: 0 <= v <= 1e9, _COEFFICIENT, -1),
    ("g", lambda v: -1 < v <= 1, "a number above -1 and up to 1", 0),
    ("d", lambda v: 1e-9 < v < 1e300, _LENGTH, 1),
)


@dataclass(frozen=True, slots=True)
class MciRun:
    """One run of an MCML input file.

    Parameters
    ----------
    material : Material
        Material of one channel, "mono", named after the output file. A last layer of 1e6 cm or more
        is semi-infinite, and the index below it is ignored.
    grid : RadialGrid
        Grid with as many annuli as the file has dr. MCML adds the light beyond to the last one; a
        profile keeps it separate.
    photons : int
        Number of photons to trace.
    output : str
        Name of MCML's output file.
    depth_bins, angle_bins : int
        MCML's numbers of dz and da, which only affect its output.
    """

    material: Material
    grid: RadialGrid
    photons: int
    output: str
    depth_bins: int
    angle_bins: int

    def settings(self, given: Mapping[str, Any], *, photons: bool) -> dict[str, Any]:
        """Return settings of a simulation, with this run's grid where none is given.

        ``photons`` adds its number of photons as well.
        """
        own = {"dr_mm": self.grid.dr_mm, "radius_mm": self.grid.radius_mm}
        own |= {key: each for key, each in given.items() if each is not None}
        return own | ({"photons": self.photons} if photons else {})


def is_mci(name: str | None) -> bool:
    """Whether a name given for a material means an MCML input file."""
    return name is not None and name.lower().endswith(".mci")


def load_mci(path: str | Path, number: int | None = None) -> tuple[MciRun, ...]:
    """Read the runs of an MCML input file, or one of them, from 1 up; see `parse_mci`."""
    text = read_text(path, str(path), expected="an MCML input file", error=MaterialError)
    with text.hinting(MaterialError) as content:
        runs = parse_mci(content, str(path))
    if number is None:
        return runs
    if not 1 <= number <= len(runs):
        raise MaterialError(f"{path} has no run {number}; give `number = 1` to {len(runs)}.")
    return (runs[number - 1],)


def parse_mci(text: str, origin: str) -> tuple[MciRun, ...]:
    r"""Read the runs of an MCML input file from its text.

    Parameters
    ----------
    text : str
        The whole file, lines ending in newline characters.
    origin : str
        Path of its file, which begins every message.

    Returns
    -------
    tuple of MciRun
        The runs in the order of the file, at least one.

    Raises
    ------
    MaterialError
        The text is invalid; the one-line message has the origin, the line's number, its content and
        what was expected.

    Examples
    --------
    >>> text = "1.0\n1\nskin.mco A\n1000\n0.1 0.1\n1 50 1\n1\n1.0\n1.4 1.5 100 0.9 1E8\n1.0"
    >>> run, = parse_mci(text, "skin.mci")
    >>> run.material.layers[0].sigma_a_per_mm.tolist(), run.grid.dr_mm
    ([0.15], 1.0)
    """
    lines = Lines(text, origin, comment=INPUT_COMMENT, error=MaterialError)
    _take_version(lines)
    count_line = lines.take_words("the number of runs")
    count = lines.whole(count_line, 0, "the number of runs", _MOST)
    runs: dict[str, MciRun] = {}
    for k in range(1, count + 1):
        at = lines.peek()
        which = f"run {k} of {count}"
        run = read_run(lines, which, f"{Path(origin).name}, {which} (MCML)")
        if run.material.name.lower() in runs:  # and some file systems ignore case
            raise lines.failure(
                at.number if at else 0,
                f"run {k} writes {shown(run.output)}, and an earlier run has the same name; give "
                "every run an output file of its own.",
            )
        runs[run.material.name.lower()] = run
    if (extra := lines.peek()) is not None:
        raise lines.failure(
            extra.number,
            f"{shown(' '.join(extra.words))} follows the last run; line {count_line.number} "
            f"announces {count}. Raise that number, or put a # before what is a comment.",
        )
    return tuple(runs.values())


def _take_version(lines: Lines) -> None:
    """Consume the first line; a file without a version is foreign."""
    line = lines.take("the file version, 1.0")
    if (version := other_version(line.words[0])) is not None:
        raise lines.failure(
            line.number,
            f"this is a file of MCML {version}; only the input of MCML 1 (version 1.0) is read. "
            "Write its layers in that form.",
        )
    if line.words != ("1.0",):
        raise lines.failure(
            line.number,
            f"not an MCML input file: it begins with {shown(' '.join(line.words))}; expected the "
            "file version, 1.0.",
        )


def read_run(lines: Lines, which: str, source: str) -> MciRun:
    """Consume the lines of one run, which MCML's output repeats; ``which`` names it in messages."""
    head = lines.take_words(f"the output file of {which}", "its format A")
    output, form = head.words
    if form.upper() not in ("A", "B"):
        raise lines.failure(head.number, f"the format is {shown(form)}; expected A or B.")
    at = lines.take_words("the number of photons")
    photons = lines.whole(at, 0, "the number of photons", _MOST)
    at = lines.take_words("dz", "dr")
    lines.real(at, 0, "dz", _is_spacing, _LENGTH)
    dr_mm = lines.real(at, 1, "dr", _is_spacing, _LENGTH, tenfold=1)
    names = ("number of dz", "number of dr", "number of da")
    at = lines.take_words(*names)
    n_z, n_r, n_a = (lines.whole(at, k, name, MOST_ANNULI) for k, name in enumerate(names))
    layers, eta_above, eta_below = _read_stack(lines)
    try:
        material = Material(
            name=_name_of(output),
            channels=(CHANNEL,),
            layers=layers,
            source=printable(source),
            eta_above=eta_above,
            eta_below=eta_below,
        )
    except SssfitError as error:
        raise lines.failure(head.number, f"{which}: {error}") from None
    return MciRun(material, RadialGrid(dr_mm, n_r), photons, output, n_z, n_a)


def _read_stack(lines: Lines) -> tuple[tuple[Layer, ...], float, float]:
    """Consume the number of layers, n above, the layers and n below."""
    at = lines.take_words("the number of layers")
    count = lines.whole(at, 0, "the number of layers", MOST_ANNULI)
    at = lines.take_words("n above the layers")
    eta_above = lines.real(at, 0, "n above", *_COLUMNS[0][1:3])
    layers = tuple(_read_layer(lines, k, count) for k in range(1, count + 1))
    at = lines.take_words("n below the layers")
    eta_below = lines.real(at, 0, "n below", *_COLUMNS[0][1:3])
    return layers, eta_above, eta_below if math.isfinite(layers[-1].thickness_mm) else 1.0


def _read_layer(lines: Lines, k: int, count: int) -> Layer:
    """Consume the line of layer k of ``count``, from 1."""
    line = lines.take_words(*(f"{column[0]} of layer {k} of {count}" for column in _COLUMNS))
    eta, sigma_a, sigma_s, g, thickness_mm = (
        lines.real(line, c, name, allowed, expected, tenfold=tenfold)
        for c, (name, allowed, expected, tenfold) in enumerate(_COLUMNS)
    )
    if thickness_mm >= 10.0 * SEMI_INFINITE_CM:
        _check_semi_infinite(lines, line, k, count, is_clear=sigma_a + sigma_s == 0)
        thickness_mm = math.inf
    try:
        coefficients = np.array([sigma_a]), np.array([sigma_s])
        return Layer(eta, np.array([g]), *coefficients, thickness_mm)
    except MaterialError as error:
        raise lines.failure(line.number, f"layer {k}, in mm: {error}") from None


def _check_semi_infinite(lines: Lines, line: Line, k: int, count: int, *, is_clear: bool) -> None:
    """Raise an error for a layer without a bottom that is not the last."""
    if k < count:
        raise lines.failure(
            line.number,
            f"d = {shown(line.words[4])} of layer {k} of {count}; only the last layer may be "
            f"{SEMI_INFINITE_CM:g} cm thick or more, semi-infinite. Are there more layers?",
        )
    if is_clear:
        raise lines.failure(
            line.number,
            f"layer {k} is clear (mua = mus = 0) and has no bottom; leave it out and give its n = "
            f"{line.words[0]} as n below.",
        )


def _is_spacing(value: float) -> bool:
    return 1e-9 <= value <= 1e9


def _name_of(output: str) -> str:
    """Name a material after the output file, with the characters that our names allow."""
    stem = PurePosixPath(output.replace("\\", "/")).stem
    return re.sub(r"[^A-Za-z0-9._+-]", "_", stem).lstrip("._+-")[:100] or "mcml"
