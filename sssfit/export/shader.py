"""Tables of taps as source of a language: constants, and the passes that use them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.certificate import certificate, how_to_run, pass_table
from sssfit.export.compute import ComputeFunctions, compute_table, levels_of
from sssfit.export.constants import Writer, check_prefix, in_half
from sssfit.export.depth import DepthFunctions, check_depth, depth_rates
from sssfit.export.dialects import Dialect, commented, switch
from sssfit.export.functions import Functions
from sssfit.export.jitter import check_jitter, jitter_lines
from sssfit.export.passes import pass_list
from sssfit.export.profiles import has_own_pixels, pixel_constant, profile_constants
from sssfit.export.remarks import remarked
from sssfit.export.through import ROWS, through_table
from sssfit.kernel import Stage, Taps
from sssfit.kernel.structure import turn_on_disk
from sssfit.messages import of_material

_COPIES = {
    "pair": 2.0,
    "star": 4.0,
    "disk": 1.0,
    "line": 2.0,
}  # fetches of a row of weights, per pass
KIND_NUMBERS = ("pair", "star", "disk", "line")


@dataclass(frozen=True, slots=True)
class Style:
    """How a table is written.

    Parameters
    ----------
    prefix : str
        Prefix of all names.
    with_passes : bool
        Whether the functions of the passes follow the constants.
    normalized : bool
        Whether the blend adds up to 1 and the energy is a constant of its own.
    half : bool
        Whether numbers are rounded to half floats.
    features : tuple of str
        Those of `FEATURES` that are on where nothing else is said.
    tilted : bool
        Whether passes take the mm of a pixel along either side apart.
    compute : bool
        Whether compute shaders, one a level, replace the passes.
    """

    prefix: str = "SSS"
    with_passes: bool = True
    normalized: bool = True
    half: bool = False
    features: tuple[str, ...] = ()
    tilted: bool = False
    compute: bool = False

    def has(self, feature: str) -> bool:
        """Return whether a feature is on; depth is followed within coverage alone."""
        return feature in self.features or (feature == "COVERAGE" and "DEPTH" in self.features)


FEATURES = {  # what each does
    "COVERAGE": "light stays within the mask that alpha holds",
    "DEPTH": "a fetch loses weight by its difference in depth",
    "JITTER": "each pixel and frame moves the outer taps",
    "TRANSMITTANCE": "a function tells the light through a thickness",
}
_WITHOUT_BEING_ASKED = ("COVERAGE",)  # has few lines, so each source has them behind its switch


def source(tables: Sequence[Taps], dialect: Dialect, style: Style) -> str:
    """Return source of a dialect for one table, or for several with the same stages.

    Raises
    ------
    KernelError
        The prefix is no identifier, the tables have other stages or channels, or passes cannot be
        written for them.
    """
    _check(tables, style)
    passes = dialect.has_passes and style.with_passes
    words = [line for each in tables for line in certificate(each)]
    words += _table(tables, style) if passes else how_to_run(tables[0])
    words += list(_notes(tables, style, passes=passes))
    words += list(_needs(dialect, style)) if passes else []
    lines = [dialect.mark, *(commented(each) for each in words)]
    lines += _defines(dialect, style) if passes else []
    lines += _constants(tables, dialect, style, passes=passes)
    if passes:
        functions = _functions(tables, dialect, style)
        if style.has("TRANSMITTANCE"):
            lines += [
                "",
                *_through(tables, functions, Writer(dialect, style.prefix, half=style.half)),
            ]
        lines += ["", *functions.lines()]
    text = lines if dialect.has_defines else _resolved(lines, style)
    return "\n".join(remarked(text, dialect)).rstrip("\n") + "\n"


def _table(tables: Sequence[Taps], style: Style) -> Iterator[str]:
    """Return the passes or dispatches in words."""
    if style.compute:
        return compute_table(tables, levels_of(tables), style.prefix)
    return pass_table(
        tables[0],
        style.prefix,
        normalized=style.normalized,
        depth=style.has("DEPTH"),
        jitter=style.has("JITTER"),
        tilted=style.tilted,
    )


def _functions(tables: Sequence[Taps], dialect: Dialect, style: Style) -> Functions:
    """Return the functions of the passes or dispatches."""
    first, is_indexed = tables[0], len(tables) > 1
    if style.compute:
        levels = levels_of(tables)
        return ComputeFunctions(
            first,
            levels,
            dialect,
            style.prefix,
            is_indexed=is_indexed,
            has_own_pixels=has_own_pixels(tables),
        )
    depth = style.has("DEPTH")
    kind = DepthFunctions if depth else Functions
    return kind(
        first,
        pass_list(first, normalized=style.normalized, depth=depth),
        dialect,
        style.prefix,
        is_indexed=is_indexed,
        is_jittered=style.has("JITTER"),
        is_tilted=style.tilted,
    )


def _notes(tables: Sequence[Taps], style: Style, *, passes: bool) -> Iterator[str]:
    """Yield what else has to be known of the constants."""
    p = style.prefix
    if style.normalized:
        yield f"The passes have unit energy: multiply by {p}_ALBEDO, or by a texture's own albedo."
    if any(each.has_negative_weights for each in tables):
        yield "Some weights are negative: unsigned formats between the passes would cut light off."
        if passes:
            yield "Within a mask their sums may vanish, so keep coverage for other tables."
    if passes:
        yield from _colours(tables[0].channels)
    if passes and tables[0].chained:
        yield "Half floats between the passes cost nothing that is seen. Linear light throughout."


def _colours(channels: Sequence[str]) -> Iterator[str]:
    """Yield where pictures hold the light of fewer channels than three."""
    if len(channels) == 1:
        yield f"Light of the one channel, {channels[0]}, is read in red and written as grey."
    elif len(channels) == 2:
        yield f"Light of {channels[0]} is in red and that of {channels[1]} in green; blue is 0."


def _needs(dialect: Dialect, style: Style) -> Iterator[str]:
    """Yield what a program must name or ask for: a version of the language, or of the device."""
    first = dialect.compute_versions if style.compute else dialect.versions
    if first:
        yield f"Needs GLSL version {first} or later; the directive is left to the program."
    if dialect.deep and style.has("DEPTH"):
        yield dialect.deep


def _check(tables: Sequence[Taps], style: Style) -> None:
    check_prefix(style.prefix)
    first = tables[0]
    beside = [each.lower() for each in style.features if each != "TRANSMITTANCE"]
    beside += ["tilt"] if style.tilted else []
    if style.compute and beside:
        raise KernelError(
            f"compute shaders keep no {' and no '.join(beside)}; export the passes, which do."
        )
    if style.has("DEPTH") and style.tilted:
        raise KernelError(
            "passes that follow depth are narrower on a slope already; export with depth or with "
            "tilt, not both."
        )
    if style.has("DEPTH"):
        for each in tables:
            check_depth(each)
    if style.has("JITTER"):
        check_jitter(first)
    if style.has("COVERAGE") and any(each.has_negative_weights for each in tables):
        raise KernelError(
            "weights below 0 could make the sum of a pass vanish at a mask's border; export the "
            "table without coverage, or fit one without such weights, such as a cascade."
        )
    for each in tables[1:]:
        _check_alike(first, each)


def _check_alike(first: Taps, other: Taps) -> None:
    """Refuse two tables that cannot share a source."""
    if other.channels != first.channels:
        own, others = (
            f"{', '.join(each.channels)} of {of_material(each.meta.get('material'))}"
            for each in (first, other)
        )
        raise KernelError(
            f"tables of one file share their channels, and {others} are not {own}; export each on "
            "its own, or fit profiles whose channels have the same names and order."
        )
    if pass_list(other) != pass_list(first):
        raise KernelError(
            f"tables of one file share their passes, and those of {other.structure} are not those "
            f"of {first.structure}; fit them with the same stages."
        )


def _defines(dialect: Dialect, style: Style) -> Iterator[str]:
    """Yield the switches, which may be set before the file is included."""
    if not dialect.has_defines:
        return
    p = style.prefix
    always = () if style.compute else _WITHOUT_BEING_ASKED
    for each in dict.fromkeys((*always, *style.features)):
        name = f"{p}_{each}"
        yield f"#ifndef {name} // 1: {FEATURES[each]}"
        yield from (f"#define {name} {int(each in style.features)}", "#endif")
    if style.has("DEPTH"):
        yield switch(p, "DEPTH")
        yield "// Every pass then divides by what is near and covered."
        yield from (f"#undef {p}_COVERAGE", f"#define {p}_COVERAGE 1", "#endif")


def _resolved(lines: Sequence[str], style: Style) -> Iterator[str]:
    """Yield the lines that a preprocessor would leave, for a dialect without one."""
    kept = [True]
    for line in lines:
        word = line.split()[0] if line.strip() else ""
        if word == "#if":
            kept.append(style.has(line.split()[1].removeprefix(f"{style.prefix}_")))
        elif word == "#else":
            kept[-1] = not kept[-1]
        elif word == "#endif":
            kept.pop()
        elif all(kept):
            yield line


def _constants(
    tables: Sequence[Taps], dialect: Dialect, style: Style, *, passes: bool
) -> Iterator[str]:
    """Yield the constants: stages, offsets, weights and blend, profile after profile."""
    first, write = tables[0], Writer(dialect, style.prefix, half=style.half)
    counts = [len(each.weights) for each in first.stages]
    yield from pixel_constant(tables, write)
    if len(tables) > 1:
        yield from profile_constants(tables, write)
        yield write.scalar("uint", "TAPS", [sum(counts)])
        yield write.scalar("uint", "PICTURES", [len(first.blend)])
    if len(tables) > 1 and passes and style.has("DEPTH"):
        yield write.scalar("uint", "STAGES", [len(first.stages)])
    if style.normalized and len(tables) == 1:
        yield write.vector("ALBEDO", first.energy.tolist())
    elif style.normalized:
        yield from write.rows("ALBEDO", [each.energy.tolist() for each in tables])
    if passes:
        sizes = [2.0**each.level for each in first.stages]
        yield from write.rows("SIZE", [[each] for each in sizes])
    else:
        yield write.scalar("uint", "STAGES", [len(first.stages)])
        yield write.wholes("LEVEL", [each.level for each in first.stages])
        yield write.wholes("KIND", [KIND_NUMBERS.index(each.kind) for each in first.stages])
        angles = [[each.angle_degrees] for each in first.stages]
        yield from write.rows("ANGLE_DEGREES", angles) if any(map(any, angles)) else ()
    yield write.wholes("FIRST", [0, *np.cumsum(counts).tolist()])
    places = [row for each in tables for row in _places(each)]
    yield from write.rows("PLACE_MM" if first.is_disk else "OFFSET_MM", places)
    yield from jitter_lines(first, write) if passes and style.has("JITTER") else ()
    weights = [each.weights for table in tables for each in table.stages]
    yield from write.rows("WEIGHT", np.concatenate(weights).tolist())
    if passes and style.has("DEPTH"):
        yield from write.rows("RATE", [row for each in tables for row in depth_rates(each)])
    if _writes_blend(first, style, passes=passes):
        blends = [_blend(each, style) for each in tables]
        yield from write.rows("BLEND", np.concatenate(blends).tolist())


def _through(tables: Sequence[Taps], functions: Functions, write: Writer) -> Iterator[str]:
    """Yield the table of light through a thickness, and the function that reads it."""
    found, p = [through_table(each) for each in tables], write.prefix
    yield switch(p, "TRANSMITTANCE")
    error = max(each.error for each in found)
    yield "// The share of light that comes through a thickness in mm, linear between the rows;"
    yield f"// the largest error is {error:.2g}, of 1. Multiply the light on the far side by it,"
    yield "// and add it to the irradiance before the first pass."
    yield write.scalar("uint", "THROUGH_ROWS", [ROWS])
    yield from write.rows(
        "THROUGH_MM", [[mm] for each in found for mm in each.thickness_mm.tolist()]
    )
    yield from write.rows("THROUGH", [row for each in found for row in each.share.tolist()])
    yield from functions.through().strip("\n").split("\n")
    yield "#endif"


def _places(taps: Taps) -> Iterator[list[float]]:
    """Yield where the taps lie [mm]: a distance, or of a disk right and down."""
    for stage in taps.stages:
        yield [0.0, 0.0] if taps.is_disk else [0.0]
        for k, each in enumerate(stage.offsets_mm.tolist()):
            turn = 2.0 * math.pi * turn_on_disk(k)
            yield [each * math.cos(turn), each * math.sin(turn)] if taps.is_disk else [each]


def _writes_blend(taps: Taps, style: Style, *, passes: bool) -> bool:
    """Return whether there is a blend, which passes of a single stage alone do without."""
    is_left_out = passes and not style.compute
    return not is_left_out or pass_list(taps, normalized=style.normalized)[-1].is_blended


def _blend(taps: Taps, style: Style) -> FloatArray:
    """Return the blend, of unit energy where the energy is written apart."""
    energy = np.where(taps.energy != 0.0, taps.energy, 1.0)
    blend: FloatArray = taps.blend / energy if style.normalized else taps.blend
    return blend


def energy_in_half(taps: Taps, dialect: Dialect, style: Style) -> FloatArray:
    """Return the energy (C,) of the constants of a table as `source` rounds them to half floats.

    Passes that keep light within a mask divide by the sum of their rounded weights.
    """
    passes = dialect.has_passes and style.with_passes
    blend = _blend(taps, style)
    if _writes_blend(taps, style, passes=passes):
        blend = in_half(blend)
    total, passed = blend[0].copy(), np.ones(len(taps.channels))
    for stage, share in zip(taps.stages, blend[1:], strict=True):
        whole = _sum_in_half(stage)
        if passes and style.has("COVERAGE"):
            whole = np.ones_like(whole)
        passed = passed * whole if taps.chained else whole
        total += share * passed
    energy: FloatArray = total * in_half(taps.energy) if style.normalized else total
    return energy


def _sum_in_half(stage: Stage) -> FloatArray:
    """Return what all fetches of a stage add up to (C,) with rounded weights."""
    rows = in_half(stage.weights)
    whole: FloatArray = rows[0] + _COPIES[stage.kind] * rows[1:].sum(axis=0)
    return whole**2 if stage.kind == "pair" else whole
