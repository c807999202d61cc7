"""Checks that all renderers share."""

from sssfit.errors import RenderError

# Limit of the work space: the reference of 4096 x 4096 RGB with a kernel of 8191 x 8191 pixels
# takes 4.6 GB, that of 20000 x 20000 with any kernel more than 9.
LARGEST_BYTES = 8e9


def check_channels(picture: int, kernel: int) -> None:
    """Raise an error if kernel and picture differ in channels; one channel fits any kernel."""
    if picture not in (1, kernel):
        expected = f"{kernel}, or 1 that serves all" if kernel > 1 else "1"
        raise RenderError(
            f"the picture has {picture} channels and the kernel {kernel}; expected {expected}."
        )


def check_memory(needed_bytes: float, what: str, remedy: str) -> None:
    """Raise an error for work that would not fit in memory, before anything is allocated."""
    if needed_bytes > LARGEST_BYTES:
        raise RenderError(
            f"{what} would take {needed_bytes / 1e9:.3g} GB of memory, more than "
            f"{LARGEST_BYTES / 1e9:g} GB; {remedy}."
        )
