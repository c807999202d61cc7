"""What all renderers refuse, and how they say it."""

import operator

from sssfit.errors import RenderError
from sssfit.threads import available_cores

# Work space above which a picture is refused: the reference of 4096 x 4096 RGB with a kernel of
# 8191 x 8191 pixels takes 4.6 GB, that of 20000 x 20000 with any kernel more than 9.
LARGEST_BYTES = 8e9


def thread_count(threads: int | None) -> int:
    """Return the number of threads to use: all cores there are where none is named."""
    if threads is None:
        return available_cores()
    try:
        count = operator.index(threads)
    except TypeError:
        count = 0
    if count < 1:
        raise RenderError(f"threads = {threads!r}; expected a whole number from 1 up.")
    return count


def check_channels(picture: int, kernel: int) -> None:
    """Refuse a kernel of other channels than the picture's; a picture of one serves all."""
    if picture not in (1, kernel):
        expected = f"{kernel}, or 1 that serves all" if kernel > 1 else "1"
        raise RenderError(
            f"the picture has {picture} channels and the kernel {kernel}; expected {expected}."
        )


def check_memory(needed_bytes: float, what: str, remedy: str) -> None:
    """Refuse work that would not fit, before any of it is allocated."""
    if needed_bytes > LARGEST_BYTES:
        raise RenderError(
            f"{what} would take {needed_bytes / 1e9:.3g} GB of memory, more than "
            f"{LARGEST_BYTES / 1e9:g} GB; {remedy}."
        )
