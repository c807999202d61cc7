"""A table of taps as text: shader source with its arrays, and a JSON document; with a comment."""

import json
from collections.abc import Iterator

import numpy as np

from sssfit.export.document import errors_text, values_text
from sssfit.export.numbers import array, literal, vector_kind
from sssfit.kernel import Taps
from sssfit.kernel.taps_json import pack
from sssfit.messages import counted, printable

MARK = "// sssfit.hlsl/1"  # of the dense kernels' files too
_KINDS = ("pair", "star", "disk", "line")


def taps_description(taps: Taps) -> list[str]:
    """Return the lines of the comment: what the table is, what it costs, and how it is run."""
    meta = taps.meta
    given = {
        key: each for key, each in meta.get("settings", {}).items() if each not in (None, False)
    }
    settings = ", ".join(f"{key} {value}" for key, value in given.items())
    sha = f", sha256 {meta['profile_sha256'][:16]}" if meta.get("profile_sha256") else ""
    read = "each stage reads the one before" if taps.chained else "all stages read the irradiance"
    lines = [
        f"Subsurface scattering taps: {meta.get('material') or 'unknown material'}, {taps.method}"
        f"{f' ({settings})' if settings else ''}. sssfit {meta.get('version') or '(unknown)'}.",
        f"Profile: {meta.get('profile_method') or 'unknown'}{sha}.",
        f"{taps.structure}: {counted(taps.fetches, 'fetch', '.6g')} a pixel in "
        f"{counted(taps.passes, 'pass')}, "
        f"{taps.cost.all_passes} with those that change the picture's size; {read}.",
        f"Made for pixels of {taps.mm_per_pixel:.9g} mm; channels {', '.join(taps.channels)}; "
        "linear light.",
        f"Energy: {values_text(taps.energy.tolist())}; spectral error: "
        f"{errors_text(taps.errors['spectral'].tolist())}.",
        *_how_to_run(taps),
    ]
    return [printable(line) for line in lines]


def _how_to_run(taps: Taps) -> Iterator[str]:
    """Say what the arrays mean."""
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
            "Kind 2 is one pass of single bilinear fetches: tap k, from 0 after the middle, at the "
            "distance OFFSET_MM and the angle a + 2 pi k / 1.6180339887, with a turn a for each "
            "pixel and frame. A middle of weight 0 is not fetched."
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


def taps_hlsl(taps: Taps) -> str:
    """Return HLSL: constant arrays of stages, taps and blend.

    Taps are stored stage by stage, the middle first with the offset 0. One to four channels are
    float to float4; more channels take another index.
    """
    kind, last = vector_kind(len(taps.channels))
    offsets = [offset for each in taps.stages for offset in (0.0, *each.offsets_mm.tolist())]
    weights = np.concatenate([each.weights for each in taps.stages])
    counts = [len(each.weights) for each in taps.stages]
    whole = {
        "LEVEL": [each.level for each in taps.stages],
        "KIND": [_KINDS.index(each.kind) for each in taps.stages],
        "FIRST": [0, *np.cumsum(counts).tolist()],
    }
    angles = [each.angle_degrees for each in taps.stages]
    lines = [MARK, *(f"// {line}" for line in taps_description(taps))]
    lines += [
        f"static const uint SSS_STAGES = {len(taps.stages)};",
        f"static const float SSS_MM_PER_PIXEL = {literal(taps.mm_per_pixel)};",
        *(
            f"static const uint SSS_{name}[{len(values)}] = {{{', '.join(map(str, values))}}};"
            for name, values in whole.items()
        ),
        *(
            [
                f"static const float SSS_ANGLE_DEGREES[{len(angles)}] = "
                f"{{{', '.join(map(literal, angles))}}};"
            ]
            if any(angles)
            else []
        ),
        f"static const float SSS_OFFSET_MM[{len(offsets)}] = "
        f"{{{', '.join(map(literal, offsets))}}};",
        *array(f"{kind} SSS_WEIGHT[{len(weights)}]{last}", weights, kind),
        *array(f"{kind} SSS_BLEND[{len(taps.blend)}]{last}", taps.blend, kind),
    ]
    return "\n".join([*lines, ""])


def taps_document(taps: Taps) -> str:
    """Return the table's own JSON with a ``comment`` (list of lines) after its format."""
    first, *rest = pack(taps).decode().split("\n")
    lines = json.dumps(taps_description(taps), ensure_ascii=False)
    return "\n".join([first, rest[0], f' "comment": {lines},', *rest[1:]])
