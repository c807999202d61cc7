"""A comment behind every line that changes in another engine or language: what the line is.

Texture calls, types of textures, arrays, memory of groups of threads, and outputs are lines that a
dialect says itself (``Dialect.remarks``); texture coordinates are the same in all of them.
"""

import re
from collections.abc import Iterable, Iterator

from sssfit.export.dialects import Dialect

_COMMENT = "//"
_IN_ALL = ((r"\bplace\b.* = position \* texel", "texture coordinates, rows as in position"),)


def remarked(lines: Iterable[str], dialect: Dialect) -> Iterator[str]:
    """Yield lines of source, with a comment where a porter changes one.

    A comment that stands there already goes on with it.
    """
    for line in lines:
        code, *rest = line.split(f" {_COMMENT} ", 1)
        words = _remark(code, dialect)
        yield line if not words else f"{code} {_COMMENT} {', '.join([*rest, words])}"


def _remark(code: str, dialect: Dialect) -> str:
    """Return what a line is, or nothing if it stays or is a comment."""
    if not dialect.remarks or code.lstrip().startswith(_COMMENT):
        return ""
    known = (*dialect.remarks, *_IN_ALL)
    return next((words for pattern, words in known if re.search(pattern, code)), "")
