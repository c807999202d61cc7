"""The comment above a table of taps: what it is and comes from, what it costs, how it is run."""

import math
from collections.abc import Iterator, Sequence

from sssfit.export.passes import Pass, fetches_of, pass_list
from sssfit.kernel import Taps
from sssfit.messages import counted

_ROUNDING = 1e-12
# Of its own pixels, those on which skin1's cascade stays within 1 (docs/cascades.md, Distance).
SERVES = 0.78, 1.34


def certificate(taps: Taps) -> Iterator[str]:
    """Yield what a table is, where it comes from, what it costs and how near it is."""
    meta = taps.meta
    given = {
        key: each for key, each in meta.get("settings", {}).items() if each not in (None, False)
    }
    settings = ", ".join(f"{key} {value}" for key, value in given.items())
    sha = f", sha256 {meta['profile_sha256'][:16]}" if meta.get("profile_sha256") else ""
    yield (
        f"Subsurface scattering taps: {meta.get('material') or 'unknown material'}, {taps.method}"
        f"{f' ({settings})' if settings else ''}. sssfit {meta.get('version') or '(unknown)'}."
    )
    yield f"Profile: {meta.get('profile_method') or 'unknown'}{sha}."
    read = "each stage reads the one before" if taps.chained else "all stages read the irradiance"
    every = taps.cost.all_passes
    more = f", {every} with those that change the picture's size" if every > taps.passes else ""
    yield (
        f"{taps.structure}: {taps.fetches:.6g} fetches a pixel in {counted(taps.passes, 'pass')}"
        f"{more}; {read}."
    )
    yield (
        f"Made for pixels of {taps.mm_per_pixel:.9g} mm; channels {', '.join(taps.channels)}; "
        "linear light."
    )
    yield _distances(taps)
    yield (
        f"Energy: {values_text(taps.energy.tolist())}; spectral error: "
        f"{errors_text(taps.errors['spectral'].tolist())}."
    )


def _distances(taps: Taps) -> str:
    """Say on which pixels the table serves, and so at which distances."""
    own = taps.mm_per_pixel
    if all(each.level == 0 for each in taps.stages):
        return f"Serves pixels of {own:.3g} mm and more; nearer by, points of light fall apart."
    least, most = (own * each for each in SERVES)
    return (
        f"Serves pixels of {least:.3g} to {most:.3g} mm, judging by skin1, whose table for 0.3 mm "
        f"stays within 1 Delta E on {SERVES[0]:g} to {SERVES[1]:g} times its own pixels; much "
        "narrower or wider kernels may differ. For other distances mix the numbers of two tables "
        "with these stages, an octave apart."
    )


def pass_table(
    taps: Taps,
    prefix: str,
    *,
    normalized: bool,
    depth: bool = False,
    jitter: bool = False,
    tilted: bool = False,
) -> Iterator[str]:
    """Yield the passes as a table, and what their functions take."""
    passes = pass_list(taps, normalized=normalized, depth=depth)
    yield ""
    yield (
        "Passes in their order, each called by an entry point of yours. E is the irradiance, M0 "
        "the result; sizes are rounded up."
    )
    rows = [("call", "reads", "writes", "size", "fetches")]
    for each in passes:
        size = f"1/{2**each.level}" if each.level else "1"
        writes = " ".join(each.writes) + ("+" if each.is_added else "")
        reads = " ".join(each.pictures)
        rows.append((f"{prefix}_{each.call}", reads, writes, size, str(each.fetches)))
    yield from columns(rows, (16, 16, 8, 6))
    if any(each.is_added for each in passes):
        yield "A + is added to what the target holds (blend ONE, ONE)."
    yield "position: middle of the pixel that is written (SV_Position, gl_FragCoord), rows as in E."
    yield "texel: 1 / size of the first picture that is read; mm_per_pixel: of the full picture,"
    if depth:
        yield from _of_depth(passes)
    else:
        yield "2 d tan(vertical fov / 2) / rows at depth d, over a pixel's own scale of the blur."
    if tilted:
        yield "Right and down apart: each is that times sqrt(1 + s^2), s the change of depth in mm"
        yield "over as many mm along this side, from the neighbours' depth or ddx and ddy."
    if any(each.takes_frame(jitter=jitter) for each in passes):
        yield "frame: its number; each moves the fetches, so filter the result over time."
    yield "Sampler: bilinear, clamped. Alpha is coverage, and light is multiplied by it."


def columns(rows: Sequence[Sequence[str]], least: Sequence[int]) -> Iterator[str]:
    """Yield rows of a table; columns have these widths, or those of their words and two spaces.

    Scripts split rows where there are two spaces (docs/integrate.md).
    """
    longest = [max(len(row[k]) for row in rows if k < len(row)) + 2 for k in range(len(least))]
    widths = [*map(max, longest, least), 0]
    for row in rows:
        words = (each.ljust(width) for each, width in zip(row, widths, strict=False))
        yield "".join(words).rstrip()


def _of_depth(passes: Sequence[Pass]) -> Iterator[str]:
    """Yield what passes that follow depth read besides light."""
    yield "of a surface at depth 1 mm, 2 tan(vertical fov / 2) / rows, over a pixel's own scale."
    yield "D0, D1, ... hold coverage times depth in mm in their first channel, in 32 bits; where"
    yield "coverage is 0 nothing is read. " + (
        f"{fetches_of(passes):.6g} fetches a pixel with those of depth."
    )


def how_to_run(taps: Taps) -> Iterator[str]:
    """Yield what the arrays mean, for those who write the passes themselves."""
    yield "Stage s works on the picture halved LEVEL[s] times; its taps begin at FIRST[s]."
    kinds = {each.kind for each in taps.stages}
    if "pair" in kinds:
        yield (
            "Kind 0 is a pass along x and the same along y: WEIGHT[first] times the middle, and "
            "WEIGHT[i] times each of the two bilinear fetches OFFSET_MM[i] away on either side."
        )
    if "star" in kinds:
        yield (
            "Kind 1 is one pass of nine fetches: the middle, the four that lie the second offset "
            "away along both axes, by the second weight, and the four on the axes, by the third."
        )
    if "disk" in kinds:
        yield (
            "Kind 2 is one pass of single bilinear fetches at PLACE_MM, right and down, turned by "
            "an angle for each pixel and frame. A middle of weight 0 is not fetched."
        )
    if "line" in kinds:
        yield (
            "Kind 3 is one pass like one of kind 0, in the direction of ANGLE_DEGREES: from x to "
            "the right towards y down."
        )
    if any(each.kind == "pair" and each.angle_degrees for each in taps.stages):
        yield "Kind 0 with an angle runs along it and then perpendicular to it."
    yield "Result: BLEND[0] times the irradiance, and BLEND[s+1] times each stage's picture, added."
    if any(each.level for each in taps.stages):
        yield (
            "Halve by one bilinear fetch at the corner of 2 x 2 texels. Add up level by level, the "
            "coarsest first, each read by one bilinear fetch."
        )


def values_text(values: Sequence[float]) -> str:
    """Return a value for each channel as text."""
    return ", ".join(f"{each + 0.0:.6g}" for each in values)  # not -0


def errors_text(values: Sequence[float]) -> str:
    """Return an error for each channel as text; rounding of sums of pixels counts as 0."""
    return ", ".join(
        "unknown" if math.isnan(each) else f"{0.0 if abs(each) < _ROUNDING else each:.6g}"
        for each in values
    )
