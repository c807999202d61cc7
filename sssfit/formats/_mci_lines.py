"""The data lines of MCML's files, read in order and checked.

Every message names the file, the line, its content and what was expected there.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

from sssfit.errors import SssfitError
from sssfit.messages import printable, shown
from sssfit.text import decimal_shifted, finite_number

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
            values = "1 value" if len(line.words) == 1 else f"{len(line.words)} values"
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
