"""A page as text with what is printed about it, made once and then kept."""

import hashlib
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from sssfit.export import kernel_text
from sssfit.kernel import Taps
from sssfit.material import Material
from sssfit.profile import Profile
from sssfit.report.fits import Watch
from sssfit.report.html import page
from sssfit.report.kept import kept, page_key
from sssfit.report.make import make_report


def finished_page(
    source: Material | Profile,
    *,
    name: str | None = None,
    named: Sequence[tuple[str, Taps]] = (),
    irradiance: str | None = None,
    only: Collection[str] | None = None,
    progress: Watch | None = None,
    **settings: Any,
) -> dict[str, Any]:
    """Return a page, from the user's cache folder if it was made before.

    Parameters
    ----------
    source, name, named, irradiance, only, progress, **settings
        As `make_report`.

    Returns
    -------
    dict
        ``page``, HTML; ``words``, what is printed; ``figures``, as `Report.figures`.

    Raises
    ------
    RenderError, FitError, FileError
        As `make_report`.
    """
    methods = None if only is None else sorted(only)
    given = {
        "source": [type(source).__name__, source.sha256, _names(source), name],
        "named": [[label, kernel_text(taps, "json")[0]] for label, taps in named],
        "irradiance": None if irradiance is None else [irradiance, _hash_of(Path(irradiance))],
        "settings": {**settings, "only": methods},
    }

    def make() -> dict[str, Any]:
        made = make_report(
            source,
            name=name,
            named=named,
            irradiance=irradiance,
            **{"only": only, "progress": progress, **settings},
        )
        return {"page": page(made), "words": made.text(), "figures": made.figures()}

    return kept(page_key(given), make)


def _names(source: Material | Profile) -> list[str]:
    """Return what a hash of coefficients or energies leaves out, and a page shows."""
    if isinstance(source, Material):
        return [source.name, source.source]
    return [str(source.material_name), repr(sorted(source.meta.items(), key=str))]


def _hash_of(path: Path) -> str | None:
    """Return the hash of a picture's file; a made picture has none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
