"""The text of a profile's chart."""

import functools
import math
import re
from collections.abc import Sequence

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.chart.data import Picture
from sssfit.chart.page import has_letters_of
from sssfit.messages import by_channel, counted, note, shown
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.profile.beam import parse_beam
from sssfit.profile.bins import MIN_HITS

NO_LIGHT = "returns no light"
WEIGHTED = r"$2\pi r\,R_d$ (1/mm)"
_MOST_IN_LEGEND = 8
_MOST_DECIMALS = 12
_MOST_TOLD = 4  # names that a note repeats
_POWER = re.compile(r"(?<=\d)e([+-]\d+)")
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def title(profile: Profile) -> str:
    """Return the title with the material."""
    so_far = " so far" if profile.meta.get("checkpoint") else ""
    return titled(profile, f"diffuse reflectance profile{so_far}")


def titled(profile: Profile, what: str) -> str:
    """Return a title for a profile, after its material's name if it has one."""
    name = profile.material_name
    return f"{shortened(name, 24)}: {what}" if name else what.capitalize()


def legend_title(profile: Profile) -> str:
    """Return the head of the channels' legend."""
    if not (profile.diffuse_reflectance_stderr > 0).any():
        return "Total diffuse reflectance"
    return f"Total diffuse reflectance ± {kind_of_error(profile)} error"


def subtitle(profile: Profile) -> str:
    """Return text about the method and the grid of a profile."""
    meta = profile.meta
    parts = [method_name(meta.get("method"))] if meta.get("method") else []
    if profile.photons is not None:
        parts.append(f"{count(profile.photons)} photons, seed {meta.get('seed', 'unknown')}")
    if beam := meta.get("beam"):
        parts.append(f"beam {shortened(str(beam))} mm")
    parts.append(grid(profile))
    if version := meta.get("version"):
        parts.append(f"sssfit {shortened(str(version))}")
    return " · ".join(parts)


def kernel_subtitle(profile: Profile, pixels: int, mm_per_pixel: float) -> str:
    """Return text about the pixels of a kernel and the method of its profile."""
    meta = profile.meta
    parts = [method_name(meta["method"])] if meta.get("method") else []
    parts.append(powered(f"{pixels} x {pixels} pixels of {mm_per_pixel:.4g} mm"))
    if version := meta.get("version"):
        parts.append(f"sssfit {shortened(version)}")
    return " · ".join(parts)


def symbols(words: str) -> str:
    """Return the words of a record as charts write them; records have them in plain letters."""
    return words.replace("Delta E", "ΔE")


def powered(words: str) -> str:
    """Return text whose numbers such as 3.7e-06 are written as 3.7×10⁻⁶."""
    return _POWER.sub(
        lambda found: f"×10{str(int(found[1])).translate(_SUPERSCRIPTS)}",  # noqa: RUF001
        words,
    )


def method_name(method: object) -> str:
    """Return the displayed name of a method of simulation; of one that is unknown its own."""
    name = str(method)
    return SIMULATIONS[name].label if name in SIMULATIONS else shortened(name)


def grid(profile: Profile) -> str:
    """Return text about the annuli: number, width if equal, and outer radius."""
    width_mm = np.diff(profile.r_edges_mm)
    spacing = f" of {width_mm[0]:.4g} mm" if np.allclose(width_mm, width_mm[0]) else ""
    end = f"{profile.r_edges_mm[-1]:.4g} mm"
    return powered(f"{counted(profile.n_annuli, 'annulus')}{spacing} to r = {end}")


def count(number: int) -> str:
    """Return a count as text: 10⁷, 2.5×10⁶, or in full if three digits are not enough."""
    exponent = len(str(number)) - 1
    mantissa = number / 10**exponent
    if exponent < 4 or round(mantissa, 2) * 10**exponent != number:
        return f"{number:,}"
    power = "10" + str(exponent).translate(_SUPERSCRIPTS)
    return power if mantissa == 1 else f"{mantissa:g}×{power}"  # noqa: RUF001 (a product)


def channel_label(profile: Profile, channel: int, *, is_drawn: bool) -> str:
    """Return a channel's name with its total diffuse reflectance and standard error."""
    total = with_error(
        float(profile.diffuse_reflectance[channel]),
        float(profile.diffuse_reflectance_stderr[channel]),
    )
    label = f"{channel_name(profile.channels, channel)}  {total}"
    if not profile.diffuse_reflectance[channel] > 0.0:
        return f"{label} ({NO_LIGHT})"
    return label if is_drawn else f"{label} (too few photons to draw)"


def channel_name(channels: Sequence[str], channel: int) -> str:
    """Return a channel's name as a chart shows it, short."""
    return short_names(channels)[channel]


def short_names(channels: Sequence[str]) -> list[str]:
    """Return the channels' names, short; with their numbers where several come out the same."""
    names = [shortened(each) for each in channel_names(channels)]
    return [f"{name} ({k + 1})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def channel_names(channels: Sequence[str]) -> list[str]:
    """Return the channels' names: "channel 2" where the font has none of a name's letters.

    The user is told once.
    """
    unknown = tuple(name for name in channels if not has_letters_of(name))
    if unknown:
        _tell(unknown)
    return [f"channel {k + 1}" if name in unknown else name for k, name in enumerate(channels)]


@functools.cache
def _tell(unknown: tuple[str, ...]) -> None:
    names = ", ".join(map(shown, unknown[:_MOST_TOLD]))
    more = f" and {len(unknown) - _MOST_TOLD} more" if len(unknown) > _MOST_TOLD else ""
    note(
        f"The font of charts has no letters of {names}{more}; in their place stand the channels' "
        "numbers."
    )


def in_legend(n_channels: int) -> list[int]:
    """Return the channels that the legend names: all, or eight spread from first to last."""
    return spread(n_channels, _MOST_IN_LEGEND)


def spread(n_channels: int, most: int) -> list[int]:
    """Return all channels, or this many of them spread from the first to the last."""
    if n_channels <= most:
        return list(range(n_channels))
    return [int(each) for each in np.linspace(0, n_channels - 1, most).round()]


def with_error(value: float, stderr: float) -> str:
    """Return a value and its standard error as text; two digits of the error set the decimals.

    Where they would be more than 12, of the two over a power of ten: (7.4400 ± 0.0016)×10⁻⁷.
    """
    if not stderr > 0:
        return f"{value:.4g}"
    decimals = max(1 - math.floor(math.log10(stderr)), 0)
    if decimals <= _MOST_DECIMALS:
        return f"{value:.{decimals}f} ± {stderr:.{decimals}f}"
    exponent = math.floor(math.log10(max(abs(value), stderr)))
    unit, decimals = 10.0**exponent, max(decimals + exponent, 0)
    power = f"10{str(exponent).translate(_SUPERSCRIPTS)}"
    return f"({value / unit:.{decimals}f} ± {stderr / unit:.{decimals}f})×{power}"  # noqa: RUF001


def shortened(name: str, longest: int = 12) -> str:
    """Shorten a name in the middle to fit its space.

    The end is kept because names often differ there: infrared-850nm.
    """
    if len(name) <= longest:
        return name
    head = (longest - 1) // 2
    return f"{name[:head]}…{name[len(name) - (longest - 1 - head) :]}"


def footnotes(profile: Profile, image: str) -> list[str]:
    """Return the notes on the curves and the ``image``."""
    reach = powered(f"Beyond the grid (r > {profile.r_edges_mm[-1]:.4g} mm)")
    notes = [
        f"{_through(profile)}{reach}: {_beyond(profile)} of diffuse. "
        f"Specular reflectance ({profile.specular_reflectance:.4g}) is not included.",
    ]
    if profile.photons is not None:
        most = "at most " if profile.shares_photons else ""
        notes.append(
            f"Steps: means over annuli merged to {MIN_HITS} effective photons or more; curves "
            f"end where there are too few. Bands: {most}±1 standard error."
        )
    elif (profile.annulus_energy_stderr > 0.0).any():
        notes.append(
            f"Bands: ± the {kind_of_error(profile)} error of an annulus; where it is as large as "
            "the value, the curve means nothing."
        )
    if beam := profile.meta.get("beam"):
        notes.append(_of_beam(str(beam)))
    if profile.n_channels > _MOST_IN_LEGEND:
        others = profile.n_channels - _MOST_IN_LEGEND
        notes.append(
            f"Thin lines: the {counted(others, 'channel')} not named above, without bands."
        )
    return [*notes, image] if image else notes


def _of_beam(beam: str) -> str:
    """Return a note on the end of a grid that grew by a beam's reach."""
    lost_mm = 2.0 * parse_beam(beam).reach_mm
    return (
        f"The last {lost_mm:.3g} mm of r are too dark: light from beyond the grid of the pencil "
        "beam's profile is missing there."
    )


def left_out_note(count: int, what: str = "channel") -> list[str]:
    """Return a note on so many channels between those that are drawn; none for 0."""
    if count <= 0:
        return []
    return [f"{counted(count, what)} between these {'is' if count == 1 else 'are'} not drawn."]


def kind_of_error(profile: Profile) -> str:
    """Return what a profile's errors are: a solver's estimate, or of a walk, perhaps imported."""
    return "estimated" if profile.meta.get("method") == "exact" else "standard"


def image_note(profile: Profile, image: Picture) -> str:
    """Return a note on the colours or shades of the 2D profile."""
    if profile.n_channels != 3:
        return ""
    named = "" if profile.channels == ("R", "G", "B") else " of the channels as R, G, B"
    exposure = powered(f"{image.exposure_per_mm2:.2g}")
    return (
        f"(d): linear light{named}, tone curve x/(1 + x) with x = 1 at "
        f"{exposure}/mm², encoded as sRGB."
    )


def of_paths(profile: Profile, paths_mm: FloatArray | None) -> tuple[str, str]:
    """Return the title of the panel in mean free paths, and the label of its axis.

    Of a medium that scatters forward they are the reduced ones; without any it is in mm.
    """
    if paths_mm is None:
        why = "unknown" if profile.material is None else "of layers differ"
        return "(c) unweighted", f"r (mm; mean free paths {why})"
    is_reduced = profile.material is not None and profile.material.layers[0].g.any()
    title = f"(c) unweighted, in {'reduced ' if is_reduced else ''}mean free paths"
    return title, _path_label(profile, paths_mm)


def _path_label(profile: Profile, paths_mm: FloatArray) -> str:
    """Return the label of the axis in mean free paths, with the lengths if they fit."""
    if profile.n_channels > 4:
        return "r (mean free paths)"
    lengths = ", ".join(
        f"{channel_name(profile.channels, k)} {_digits(path_mm)}"
        for k, path_mm in enumerate(paths_mm)
    )
    # 48 letters are as wide as the panel.
    return f"r (mean free paths: {lengths} mm)" if len(lengths) <= 26 else "r (mean free paths)"


def _through(profile: Profile) -> str:
    """Return a slab's transmittance, which no panel shows."""
    if profile.transmittance is None:
        return ""
    names = channel_names(profile.channels)
    return f"Transmittance: {by_channel(names, profile.transmittance.tolist(), '.4g')}. "


def _beyond(profile: Profile) -> str:
    """Return each channel's share beyond the grid; of many channels, the largest."""
    diffuse = profile.diffuse_reflectance
    shares = np.divide(profile.beyond_grid, diffuse, out=np.zeros_like(diffuse), where=diffuse > 0)
    if profile.n_channels <= 4:
        names = [channel_name(profile.channels, k) for k in range(len(shares))]
        pairs = zip(names, shares, strict=True)
        return ", ".join(f"{name} {_percent(share)}" for name, share in pairs)
    worst = int(np.argmax(shares))
    return f"at most {_percent(shares[worst])} ({channel_name(profile.channels, worst)})"


def _digits(value: float) -> str:
    """Return three significant digits, with trailing zeros."""
    return f"{value:#.3g}".rstrip(".")


def _percent(share: float) -> str:
    return "<0.0001 %" if 0 < share < 1e-6 else f"{100.0 * share:.2g} %"
