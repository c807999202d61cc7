"""MCML output files (``.mco``, ASCII): the result of the original program, as a profile in mm.

The format is that of MCML 1.2.2 (Wang, Jacques, Zheng, Computer Methods and Programs in Biomedicine
47, 1995; its manual, appendix E): the version A1, then named blocks. ``InParm`` repeats the input
(``InParam`` in the ports to GPUs after Alerstam et al. 2008, which copy the lines of the input);
``RAT`` has the specular and diffuse reflectance, the absorbed fraction and the transmittance;
``A_l``, ``Rd_r`` and ``Tt_r`` have the data of a profile, in cm. The other blocks are checked for
their length only.

Rd_r[i] is energy over area, and the area is 2 pi (i + 1/2) dr^2. The last bin also includes all
light beyond it, so it goes to ``beyond_grid``. The same holds for Tt_r.
"""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sssfit import __version__
from sssfit.arrays import FloatArray, check_names
from sssfit.errors import MaterialError, ProfileError, SssfitWarning
from sssfit.formats.mci import (
    INPUT_COMMENT,
    OUTPUT_COMMENT,
    Line,
    Lines,
    MciRun,
    other_version,
    read_run,
)
from sssfit.material import Layer, Material
from sssfit.messages import counted, printable, shown
from sssfit.profile import FORMAT, Profile
from sssfit.text import finite_number, read_text

# MCML prints five digits of Rd_r and Tt_r, four of A_l: half a unit of the last digit is at most
# 5e-5 or 5e-4 of a number, and also of a sum.
_RADIAL_DIGITS, _LAYER_DIGITS = 1e-4, 1e-3
# Roulette adds 3e-4 per photon at random, under 1e-5 for a thousand photons; RAT has six digits.
_LOST = 1e-3
_HEADS = ("InParm", "InParam")
_NEEDED = ("RAT", "A_l", "Rd_r", "Tt_r")


def load_mco(path: str | Path) -> Profile:
    """Read an MCML output file as a profile of one channel; see `parse_mco`."""
    text = read_text(path, str(path), expected="MCML's output in ASCII", error=ProfileError)
    with text.hinting(ProfileError) as content:
        return parse_mco(content, str(path))


def is_mco(text: str) -> bool:
    """Return whether a text begins like a file of any version of MCML, after its comments.

    Inputs count only if they name MCML; those of version 1 begin with a bare number.
    """
    line = Lines(text, "", comment=OUTPUT_COMMENT, error=ProfileError).peek()
    word = line.words[0] if line else ""
    return word in ("A1", "B1") or other_version(word) is not None


def parse_mco(text: str, origin: str) -> Profile:
    """Read the profile of an MCML output file from its text.

    Parameters
    ----------
    text : str
        The whole file, lines ending in newline characters.
    origin : str
        Path of its file, which begins every message; its last part becomes ``meta["source"]``.

    Returns
    -------
    Profile
        One channel, "mono", with one annulus fewer than MCML's dr. ``absorbed`` is A_l, scaled in
        the last digit to add up to the six digits of RAT. Standard errors are NaN and ``photons``
        is None, because MCML keeps no squared weights; the number of photons is in
        ``meta["settings"]``.

    Raises
    ------
    ProfileError
        The text is truncated, of another format, of another version of MCML, or binary, or its
        blocks contradict one another; the one-line message has the origin and the line's number.

    Warns
    -----
    SssfitWarning
        The energies of RAT do not add up to 1.
    """
    lines = Lines(text, origin, comment=OUTPUT_COMMENT, error=ProfileError)
    _take_version(lines)
    name = lines.take_words("the block InParm")
    if name.words[0] not in _HEADS:
        raise lines.failure(name.number, f"{shown(name.words[0])} is where InParm was expected.")
    if name.words[0] == "InParam":
        lines.comment = INPUT_COMMENT
    run = read_run(lines, "the run", f"{Path(origin).name} (MCML)")
    if run.grid.annuli < 2:
        raise lines.failure(
            name.number, "1 bin over r holds all that leaves, near and far; a profile needs 2 dr."
        )
    lines.comment = OUTPUT_COMMENT
    blocks = _read_blocks(lines, run)
    profile = _profile(run, blocks, origin)
    _check_energies(origin, *blocks["RAT"].tolist())
    return profile


def join_channels(profiles: Sequence[Profile], channels: Sequence[str]) -> Profile:
    """Join profiles of one channel each, from `parse_mco`, into one of several.

    Parameters
    ----------
    profiles : sequence of Profile
        Profiles on the same grid, with the same layers except for their coefficients.
    channels : sequence of str
        A name for each profile.

    Raises
    ------
    ProfileError
        A name is invalid, or the profiles do not belong together; the one-line message says which.
    """
    if len(channels) != len(profiles):
        raise ProfileError(
            f"{counted(len(channels), 'channel name')} "
            f"({shown(', '.join(channels))}) for {counted(len(profiles), 'file')}; give one per "
            "file, such as "
            "R,G,B."
        )
    try:
        check_names(list(channels))
    except MaterialError as error:
        raise ProfileError(str(error)) from None
    materials = [Material.from_dict(each.meta["material"]) for each in profiles]
    for profile, material in zip(profiles[1:], materials[1:], strict=True):
        _check_fit(profiles[0], profile, materials[0], material)
    joined = _joined_material(materials, channels)
    fields: dict[str, Any] = {name: _joined(profiles, name) for name in _PER_CHANNEL}
    return Profile(
        **fields,
        r_edges_mm=profiles[0].r_edges_mm,
        specular_reflectance=profiles[0].specular_reflectance,
        meta={
            **profiles[0].meta,
            "material": joined.to_dict(),
            "material_sha256": joined.sha256,
            "channels": list(channels),
            "source": ", ".join(each.meta["source"] for each in profiles),
            "settings": {"photons": [each.meta["settings"]["photons"][0] for each in profiles]},
        },
    )


def _take_version(lines: Lines) -> None:
    line = lines.take("A1, the version of MCML's output format")
    if line.words[0] == "B1":
        raise lines.failure(line.number, "this is binary output; run MCML with format A.")
    if (version := other_version(line.words[0])) is not None:
        raise lines.failure(
            line.number,
            f"this is a file of MCML {version}; only the output of MCML 1 (version A1) is read. "
            "Write its layers as an input file of MCML 1 (.mci) and simulate that.",
        )
    if line.words != ("A1",):
        raise lines.failure(
            line.number,
            f"{shown(' '.join(line.words))} is where A1 was expected, the version of MCML's "
            "output.",
        )


def _sizes(run: MciRun) -> dict[str, int]:
    """Return the number of values of each block."""
    n_z, n_r, n_a = run.depth_bins, run.grid.annuli, run.angle_bins
    one_dimensional = {"RAT": 4, "A_l": len(run.material.layers), "A_z": n_z, "Rd_r": n_r}
    return one_dimensional | {
        "Rd_a": n_a,
        "Tt_r": n_r,
        "Tt_a": n_a,
        "A_rz": n_r * n_z,
        "Rd_ra": n_r * n_a,
        "Tt_ra": n_r * n_a,
    }


def _read_blocks(lines: Lines, run: MciRun) -> dict[str, FloatArray]:
    """Consume all blocks to the end of the file, in any order."""
    sizes = _sizes(run)
    blocks: dict[str, FloatArray] = {}
    while (line := lines.peek()) is not None:
        name = line.words[0]
        if name not in sizes or name in blocks:
            left = [each for each in sizes if each not in blocks]
            raise lines.failure(
                line.number,
                f"{shown(' '.join(line.words))} is where the name of a block or the end was "
                f"expected; missing are {', '.join(left) or 'none'}. Is the block before as long "
                "as InParm says?",
            )
        lines.take_words(name)
        blocks[name] = _read_numbers(lines, name, sizes[name])
    for name in _NEEDED:
        if name not in blocks:
            lines.take(f"the block {name}")
    return blocks


def _read_numbers(lines: Lines, name: str, size: int) -> FloatArray:
    """Consume the numbers of a block, which end with a line."""
    values: list[float] = []
    while len(values) < size:
        line = lines.take(f"number {len(values) + 1} of {size} of the block {name}")
        values += [_energy(lines, line, name, word) for word in line.words]
        if len(values) > size:
            raise lines.failure(
                line.number, f"the block {name} has more than its {counted(size, 'number')}."
            )
    return np.array(values)


def _energy(lines: Lines, line: Line, name: str, word: str) -> float:
    value = finite_number(word)
    if value is None or value < 0:
        raise lines.failure(
            line.number,
            f"{shown(word)} in the block {name}; expected a number of 0 or more. Is the block as "
            "long as InParm says?",
        )
    return value


def _check_energies(
    origin: str, specular: float, diffuse: float, absorbed: float, transmitted: float
) -> None:
    """Raise an error for more light than arrives, and warn if some is missing."""
    reflected = specular + diffuse
    if reflected > 1.0 + _LOST:
        raise ProfileError(
            f"{printable(origin)}: RAT says that {reflected:.6g} of 1 is reflected; expected at "
            "most 1. The file was changed; take it as MCML wrote it."
        )
    total = reflected + absorbed + transmitted
    if abs(total - 1.0) > _LOST:
        warnings.warn(
            f"{printable(origin)}: the energies of RAT add up to {total:.6g} of 1 (reflected "
            f"{reflected:.6g}, absorbed {absorbed:.6g}, transmitted {transmitted:.6g}); expected "
            "1. Was absorption counted, or the run cut short?",
            SssfitWarning,
            stacklevel=3,
        )


def _profile(run: MciRun, blocks: dict[str, FloatArray], origin: str) -> Profile:
    """Convert densities in 1/cm^2 to energies; see the module docstring."""
    specular, diffuse, absorbed, transmitted = blocks["RAT"].tolist()
    dr_cm = run.grid.dr_mm / 10.0
    areas_cm2 = 2.0 * np.pi * (np.arange(run.grid.annuli) + 0.5) * dr_cm**2
    reflected, below = (blocks[name] * areas_cm2 for name in ("Rd_r", "Tt_r"))
    in_layers = blocks["A_l"]
    _check_sum(origin, "Rd_r", float(reflected.sum()), diffuse, _RADIAL_DIGITS)
    _check_sum(origin, "Tt_r", float(below.sum()), transmitted, _RADIAL_DIGITS)
    _check_sum(origin, "A_l", float(in_layers.sum()), absorbed, _LAYER_DIGITS)
    scale = absorbed / in_layers.sum() if absorbed > 0 else 1.0
    is_slab = np.isfinite(run.material.layers[-1].thickness_mm) or transmitted > 0
    return Profile(
        r_edges_mm=run.grid.r_edges_mm[:-1],
        annulus_energy=reflected[:-1, None],
        annulus_energy_stderr=np.full((run.grid.annuli - 1, 1), np.nan),
        beyond_grid=reflected[-1:],
        beyond_grid_stderr=np.full(1, np.nan),
        specular_reflectance=specular,
        absorbed=scale * in_layers[:, None],
        unfinished=np.zeros(1),
        annulus_transmittance=below[:-1, None] if is_slab else None,
        beyond_grid_transmittance=below[-1:] if is_slab else None,
        meta=_meta(run, origin),
    )


def _check_sum(origin: str, name: str, found: float, said: float, tolerance: float) -> None:
    """Raise an error for a block whose energies differ from RAT: edited, or of another dr."""
    if abs(found - said) > tolerance * max(found, said):
        raise ProfileError(
            f"{printable(origin)}: the block {name} adds up to {found:.6g} and RAT says "
            f"{said:.6g}; the file was changed, take it as MCML wrote it."
        )


def _meta(run: MciRun, origin: str) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "method": "imported",
        "material": run.material.to_dict(),
        "material_sha256": run.material.sha256,
        "channels": list(run.material.channels),
        "photons": None,
        "seed": None,
        "version": __version__,
        "source": Path(origin).name,
        "settings": {"photons": [run.photons]},
    }


_PER_CHANNEL = (
    "annulus_energy",
    "annulus_energy_stderr",
    "beyond_grid",
    "beyond_grid_stderr",
    "absorbed",
    "unfinished",
    "annulus_transmittance",
    "beyond_grid_transmittance",
)


def _joined(profiles: Sequence[Profile], name: str) -> FloatArray | None:
    """Return one field of several profiles along the channel axis; None if it is None."""
    values = [getattr(each, name) for each in profiles]
    return None if values[0] is None else np.concatenate(values, axis=-1)


def _check_fit(first: Profile, other: Profile, top: Material, material: Material) -> None:
    """Raise an error for profiles that differ in more than coefficients."""
    ours, theirs = first.r_edges_mm, other.r_edges_mm
    if not np.array_equal(ours, theirs):
        said = (
            f"{counted(len(theirs) - 1, 'annulus')} of {theirs[1]:g} mm where "
            f"{first.meta['source']} has "
            f"{len(ours) - 1} of {ours[1]:g} mm"
        )
    elif _shape(material) != _shape(top) or other.specular_reflectance != (
        first.specular_reflectance
    ):
        said = f"other layers (number, n or thickness) than {first.meta['source']}"
    elif (first.transmittance is None) != (other.transmittance is None):
        said = f"transmittance where {first.meta['source']} has none, or the other way round"
    else:
        return
    raise ProfileError(
        f"{other.meta['source']} has {said}; channels of one profile need the same: import them "
        "one by one."
    )


def _shape(material: Material) -> tuple[object, ...]:
    """Return everything of a material except its name and coefficients."""
    layers = tuple((layer.eta, layer.thickness_mm) for layer in material.layers)
    return (material.eta_above, layers, material.eta_below)


def _joined_material(materials: Sequence[Material], channels: Sequence[str]) -> Material:
    """Join materials of one channel each into one with all coefficients."""
    first = materials[0]
    layers = tuple(
        Layer(
            each[0].eta,
            np.concatenate([layer.g for layer in each]),
            np.concatenate([layer.sigma_a_per_mm for layer in each]),
            np.concatenate([layer.sigma_s_per_mm for layer in each]),
            each[0].thickness_mm,
        )
        for each in zip(*(material.layers for material in materials), strict=True)
    )
    return Material(
        name="+".join(each.name for each in materials)[:100],
        channels=tuple(channels),
        layers=layers,
        source="; ".join(dict.fromkeys(each.source for each in materials)),
        eta_above=first.eta_above,
        eta_below=first.eta_below,
    )
