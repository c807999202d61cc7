"""Libraries of the extras, imported when a sweep first needs them."""

from importlib import import_module
from typing import Any

from sssfit.errors import SweepError


def needed(module: str, extra: str) -> Any:
    """Import a module of an extra.

    Raises
    ------
    SweepError
        It is not installed; the line says what to install.
    """
    try:
        return import_module(module)
    except ImportError:
        raise SweepError(
            f"{module} is not installed, and this needs it: pip install 'sssfit[{extra}]'."
        ) from None
