"""A profile from another program's files, recognised by content: CSV or MCML's .mco."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

from sssfit.errors import ArgumentError, ProfileError
from sssfit.formats.csv import parse_csv
from sssfit.formats.mco import is_mco, join_channels, parse_mco
from sssfit.messages import Columns, report
from sssfit.profile import Profile
from sssfit.text import Text, read_text

_DEFAULT_CHANNELS = {1: ["mono"], 3: ["R", "G", "B"]}
_FIGURES = (
    *("method", "channels", "annuli", "radius_mm", "diffuse_reflectance"),
    *("diffuse_reflectance_stderr", "specular_reflectance", "beyond_grid", "transmittance"),
    *("energy_balance", "photons"),
)
_PAGE = (
    "{source}: {annuli:#annulus}, to {radius_mm:.4g} mm",
    Columns(
        "channel",
        "channels",
        (
            ("diffuse reflectance", "diffuse_reflectance", ".6f"),
            ("std. error", "diffuse_reflectance_stderr", ".6f"),
            ("beyond grid", "beyond_grid", ".6f"),
            ("transmittance", "transmittance", ".6f"),
        ),
    ),
)


def import_profile(
    files: Sequence[str | Path | BinaryIO],
    *,
    channels: Sequence[str] | None = None,
    quantity: str | None = None,
    unit: str | None = None,
    density_unit: str | None = None,
) -> Profile:
    """Read a table (CSV), or MCML's output (.mco) with one file per channel.

    Parameters
    ----------
    files : sequence of str, Path or binary stream
        One CSV, or one or several .mco on the same grid. Messages call a stream "stdin".
    channels : sequence of str, optional
        Names for several .mco, in their order; by default R, G, B for three.
    quantity, unit, density_unit : str, optional
        For a CSV; see `sssfit.formats.csv.parse_csv`.

    Raises
    ------
    ArgumentError
        An argument does not apply to the files, or is missing.
    ProfileError
        A file cannot be read, is damaged or of another format.
    """
    table = {"quantity": quantity, "unit": unit, "density_unit": density_unit}
    marked = dict(zip(table, ("`quantity`", "`unit`", "`density_unit`"), strict=True))
    origins = [str(each) if isinstance(each, str | Path) else "stdin" for each in files]
    texts = [_text_of(*each) for each in zip(files, origins, strict=True)]
    tables = [each for each, text in zip(origins, texts, strict=True) if not is_mco(text.content)]
    if not tables:
        if given := [key for key, each in table.items() if each is not None]:
            raise ArgumentError(
                f"{marked[given[0]]} is for a CSV; an .mco file states its own quantities."
            )
        profiles = []
        for text, origin in zip(texts, origins, strict=True):
            with text.hinting(ProfileError) as content:
                profiles.append(parse_mco(content, origin))
        names = channels or _DEFAULT_CHANNELS.get(len(files))
        if names is None:
            raise ArgumentError(f"give `channels` with {len(files)} names, one for each .mco.")
        return join_channels(profiles, names)
    if len(files) > 1:
        raise ProfileError(
            f"{tables[0]} is not an .mco file; a CSV is imported alone, with all channels."
        )
    if channels is not None:
        raise ArgumentError("`channels` is for .mco files; a CSV has names in its header.")
    with texts[0].hinting(ProfileError) as content:
        return parse_csv(content, origins[0], **table)


def _text_of(source: str | Path | BinaryIO, origin: str) -> Text:
    """Read a file that may be a table or MCML's output."""
    if origin.lower().endswith(".mci"):
        raise ProfileError(f"{origin} is an MCML input file; `simulate` walks what it describes.")
    expected = "a CSV or MCML's output in ASCII"
    return read_text(source, origin, expected=expected, error=ProfileError)


def imported_figures(profile: Profile) -> dict[str, Any]:
    """Return the figures of ``sssfit import --json``; None if the files do not say."""
    figures, material = profile.to_dict(), profile.meta["material"]
    return {
        "source": profile.meta["source"],
        "material": material and material["name"],
        **{key: figures[key] for key in _FIGURES},
    }


def imported_page(figures: dict[str, Any]) -> str:
    """Return `imported_figures` as a report with one line per channel."""
    return report(_PAGE, figures)
