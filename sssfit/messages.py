"""How values and names are worded in messages: on one line, in printable characters."""

_MOST_SHOWN = 60  # characters of a value worth repeating to the person who wrote it


def printable(text: str) -> str:
    """Escape what does not print (newlines too), so that ``text`` can stand inside a message."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def shown(value: object) -> str:
    """Give a value as one short printable line: escapes for control characters, cut at 60."""
    import numpy as np  # the command line asks for `printable` before it loads anything heavy

    try:
        text = repr(value.item() if isinstance(value, np.generic) else value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        text = "a huge number"
    except RecursionError:  # a dotted key of 20 000 parts reads without one
        text = "tables nested too deep"
    text = printable(text)  # a repr of an array has newlines
    return text if len(text) <= _MOST_SHOWN else text[: _MOST_SHOWN - 3] + "..."
