"""A cascade as compute shaders, one a level: its stages run on a tile in groupshared memory.

A group of threads loads the pixels that it writes (tile) and as many on all sides as the stages of
the level reach (halo). Passes go from one half of the group's memory to the other, so only the sum
of a level and the picture of half the size go to the device's memory. What lies outside the picture
is read as the nearest texel inside by every pass, as a clamped sampler does.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sssfit.errors import KernelError
from sssfit.export.certificate import columns
from sssfit.export.dialects import Dialect
from sssfit.export.functions import Functions
from sssfit.export.profiles import has_own_pixels
from sssfit.kernel import Taps

GROUP = 16  # threads a side: 256 are the most that WebGPU promises
# Of groupshared memory: what WebGPU and Vulkan promise; Direct3D has twice as much, which would
# leave room for half as many groups at a time.
MOST_BYTES = 16384
_BYTES = 2 * 4  # of a number, and of that of the pass before
_HALF_FLOATS = 8  # bytes of a texel between dispatches


@dataclass(frozen=True, slots=True)
class Level:
    """What a group does on one resolution.

    Parameters
    ----------
    number : int
        How often its picture is halved.
    stages : range
    reaches : tuple of int
        Texels around one that each stage's fetches touch.
    tile : int
        Texels a side of what is written, even and at most `GROUP`.
    is_last : bool
        Whether nothing is halved any more.
    """

    number: int
    stages: range
    reaches: tuple[int, ...]
    tile: int
    is_last: bool

    @property
    def halo(self) -> int:
        """Texels around the tile that are loaded, too."""
        return sum(self.reaches)

    @property
    def side(self) -> int:
        """Texels a side of what is loaded."""
        return self.tile + 2 * self.halo

    @property
    def reads(self) -> str:
        """Its picture, by the names of ``sssfit.export.passes``."""
        return f"H{self.number}" if self.number else "E"

    @property
    def writes(self) -> tuple[str, ...]:
        """Its sum, P where coarser ones are missing, and the picture of half the size."""
        n = self.number
        return (f"M{n}",) if self.is_last else (f"P{n}", f"H{n + 1}")


def levels_of(tables: Sequence[Taps]) -> list[Level]:
    """Return the levels of tables with the same stages, with the largest tiles that fit.

    Raises
    ------
    KernelError
        A table is no cascade of pairs along the axes and stars, or a halo leaves no room.
    """
    first = tables[0]
    if not first.chained or not all(s.kind == "star" or s.is_upright for s in first.stages):
        raise KernelError(
            f"compute shaders are written for cascades of pairs along the axes and stars, and "
            f"{first.structure} is none; export its passes."
        )
    count = 1 + first.stages[-1].level
    most = math.isqrt(MOST_BYTES // (_BYTES * len(first.channels)))
    found = []
    for level in range(count):
        stages = [k for k, each in enumerate(first.stages) if each.level == level]
        reaches = [max(_reach(each, k) for each in tables) for k in stages]
        halo = sum(reaches)
        tile = min(GROUP, (most - 2 * halo) // 2 * 2)
        if tile < 2:
            raise KernelError(
                f"the stages of level {level} reach {halo} texels, and {MOST_BYTES} "
                f"bytes of groupshared memory hold {most} x {most}; expected at most "
                f"{(most - 2) // 2} texels. Export the passes."
            )
        own = range(stages[0], stages[-1] + 1)
        found.append(Level(level, own, tuple(reaches), tile, level == count - 1))
    return found


def _reach(taps: Taps, k: int) -> int:
    """Return how many texels around it a stage's fetches touch on the table's own pixels."""
    stage = taps.stages[k]
    return math.floor(float(stage.offsets_mm.max()) / (taps.mm_per_pixel * 2.0**stage.level)) + 1


def shared_bytes(taps: Taps, levels: Sequence[Level]) -> int:
    """Return the bytes of groupshared memory, of which a level may need less."""
    return _BYTES * len(taps.channels) * max(each.side for each in levels) ** 2


def bytes_moved(levels: Sequence[Level], *, with_halos: bool) -> float:
    """Return bytes read and written a pixel in half floats, each picture once or with halos."""
    pictures = 0.0
    for each in levels:
        read = (each.side / each.tile) ** 2 if with_halos else 1.0
        # Half the size is a quarter of the texels; adding up reads that and a sum, and writes one.
        moved = read + 1.0 if each.is_last else read + 1.25 + 2.25
        pictures += moved / 4.0**each.number
    return _HALF_FLOATS * pictures


def compute_table(tables: Sequence[Taps], levels: Sequence[Level], prefix: str) -> Iterator[str]:
    """Yield the dispatches as a table, and what their functions take."""
    taps = tables[0]
    yield ""
    yield f"Dispatches in their order, groups of {GROUP} x {GROUP} threads. E is the irradiance, M0"
    yield "the result; sizes are rounded up. A group of Level writes a tile, and holds it with a"
    yield f"halo around it in {shared_bytes(taps, levels)} bytes of groupshared memory."
    sizes = [f"1/{2**each.number}" if each.number else "1" for each in levels]
    rows: list[tuple[str, ...]] = [("call", "reads", "writes", "size", "tile", "halo")]
    for each, size in zip(levels, sizes, strict=True):
        name, writes = f"{prefix}_Level{each.number}", " ".join(each.writes)
        rows.append((name, each.reads, writes, size, str(each.tile), str(each.halo)))
    inner = reversed(range(len(levels) - 1))
    rows += ((f"{prefix}_Add", f"M{n + 1} P{n}", f"M{n}", sizes[n]) for n in inner)
    yield from columns(rows, (16, 8, 8, 6, 6))
    once, whole = (bytes_moved(levels, with_halos=halos) for halos in (False, True))
    yield f"Bytes a pixel in half floats: {once:.4g}, and {whole - once:.3g} of halos, which caches"
    yield f"may hold; the passes one by one move {taps.bytes_per_pixel():.4g}."
    yield "Level: all threads call it; thread is that in the group, size that of what is read."
    yield "Threads below the tile write term[0] to group * tile + thread of the first picture,"
    yield "those below half of it term[1] to group * tile / 2 + thread of the other, if inside."
    yield "Add: position is the middle of the texel that is written, texel 1 / size of M."
    yield "mm_per_pixel: of the full picture, 2 d tan(vertical fov / 2) / rows at depth d. Halos"
    own = "each profile's own" if has_own_pixels(tables) else f"{taps.mm_per_pixel:.6g} mm"
    yield f"are those for {own}; for less the blur stays as many texels wide."
    yield "Sampler: bilinear, clamped."


class ComputeFunctions(Functions):
    """The functions of tables with the same stages, for levels in groupshared memory.

    It takes what `Functions` takes but passes, their ``levels``, and ``has_own_pixels``, whether
    each profile has a pixel size of its own, below which its halo would not suffice.
    """

    def __init__(
        self,
        taps: Taps,
        levels: Sequence[Level],
        dialect: Dialect,
        prefix: str,
        *,
        is_indexed: bool,
        has_own_pixels: bool = False,
    ) -> None:
        super().__init__(taps, (), dialect, prefix, is_indexed=is_indexed)
        self.levels = levels
        self.least_mm = f"{prefix}_MM_PER_PIXEL{'[profile]' if has_own_pixels else ''}"
        self.side = max(each.side for each in levels)
        self.own_profile = [name for _, name in self.profile]

    def lines(self) -> Iterator[str]:
        """Yield the lines of all functions."""
        kinds = {each.kind for each in self.taps.stages}
        parts = [self._memory(), self._kept(), self._load_tile()]
        parts += [self._along(), self._pair()] if "pair" in kinds else []
        parts += [self._around(), self._star()] if "star" in kinds else []
        parts += [self._four()] if len(self.levels) > 1 else []
        parts += [self._level(each) for each in self.levels]
        parts += [self._add()] if len(self.levels) > 1 else []
        for each in parts:
            yield from each.strip("\n").split("\n")
            yield ""

    def _whole_numbers(self, *values: str) -> str:
        return self._vector("int2", *values)

    def _memory(self) -> str:
        """Return the memory of a group, and what a level returns."""
        channels = len(self.taps.channels)
        shared = self.dialect.shared.format(
            name=f"{self.prefix}_GROUP", count=2 * channels * self.side**2
        )
        struct = self.dialect.struct.format(
            name=f"{self.prefix}_Tiled", kind=self.dialect.types["float4"], count=2
        )
        of_two = f"\n{struct}" if len(self.levels) > 1 else ""
        return f"""
// Texels before and after a pass, {self.side} a row, with a number for each channel.
{shared}{of_two}"""

    def _kept(self) -> str:
        new, group = self.dialect.new, f"{self.prefix}_GROUP"
        channels = len(self.taps.channels)
        places = [f"{group}[i + {c}]" if c else f"{group}[i]" for c in range(channels)]
        parts = [f".{each}" for each in "xyz"[:channels]] if channels > 1 else [""]
        stores = "\n".join(
            f"    {place} = light{part};" for place, part in zip(places, parts, strict=True)
        )
        row = f"(slot * {self.side} + at.y) * {self.side} + at.x"
        index = f"{new('int', 'i')} = {row if channels == 1 else f'{channels} * ({row})'};"
        place = [("int2", "at"), ("int", "slot")]
        return f"""
// A texel of either slot of the memory.
{self._head(self.light, "Kept", place)} {{
    {index}
    return {self._vector(self.light, *places)};
}}

{self._head("void", "Keep", [(self.light, "light"), *place])} {{
    {index}
{stores}
}}"""

    def _load_tile(self) -> str:
        new = self.dialect.new
        inside = f"clamp(corner + at, {self._whole_numbers('0', '0')}, size - 1)"
        load = self.dialect.load.format(picture="picture", place=inside)
        arguments = [("picture", "picture"), ("int2", "corner"), ("int", "side")]
        return f"""
// The texels that a group needs, from the corner on.
{self._head("void", "Load", [*arguments, ("int", "thread"), ("int2", "size")])} {{
    for ({new("int", "i")} = thread; i < side * side; i += {GROUP**2}) {{
        {new("int2", "at")} = {self._whole_numbers("i % side", "i / side")};
        {self._call("Keep", f"{load}{self.rgb}", "at", "0")};
    }}
    {self.dialect.barrier};
}}"""

    def _inside(self, place: str, slot: str) -> str:
        """Return the nearest texel within the picture, which the ends bound."""
        return self._call("Kept", f"clamp({place}, ends.xy, ends.zw)", slot)

    def _texel(self, place: str) -> str:
        return self._call("Kept", place, "0")

    def _along(self) -> str:
        new, p = self.dialect.new, self.prefix
        inner, outer = (
            " + ".join(self._inside(f"at {sign} {each}", "slot") for sign in "-+")
            for each in ("near", "far")
        )
        arguments = [("uint", "stage"), ("int2", "axis"), ("int2", "at"), ("int", "slot")]
        arguments += [("int4", "ends"), ("float", "mm_per_texel"), *self.profile]
        return f"""
// A pass at a texel: the middle, and mirrored fetches, each between two texels. What lies outside
// the picture, between whose ends it is, is the nearest texel inside.
{self._head(self.light, "Along", arguments)} {{
    {new("uint", "first")} = {p}_FIRST[stage];
    {new(self.light, "light")} = {self._at("WEIGHT", "first")} * {self._inside("at", "slot")};
    for ({new("uint", "i")} = first + 1u; i < {p}_FIRST[stage + 1u]; i++) {{
        {new("float", "away")} = {self._at("OFFSET_MM", "i")} / mm_per_texel;
        {new("int2", "near")} = {self.dialect.types["int"]}(away) * axis;
        {new("int2", "far")} = near + axis;
        {new(self.light, "inner")} = {inner};
        {new(self.light, "outer")} = {outer};
        light += {self._at("WEIGHT", "i")} * (inner + (away - floor(away)) * (outer - inner));
    }}
    return light;
}}"""

    def _of_a_stage(self) -> list[tuple[str, str]]:
        given = [("uint", "stage"), ("int", "side"), ("int", "before"), ("int", "after")]
        given += [("int", "thread"), ("int4", "ends"), ("float", "mm_per_pixel")]
        return [*given, *self.profile]

    def _begun(self) -> str:
        """Return the line that finds the size of a texel, for which the halo suffices."""
        size = f"max(mm_per_pixel, {self.least_mm}) * {self.prefix}_SIZE[stage]"
        return f"{self.dialect.new('float', 'mm_per_texel')} = {size};"

    def _loop(self, made: str, slot: str, indent: str) -> str:
        """Return the lines in which threads make texels from ``low`` on, and then wait."""
        new, at = self.dialect.new, self._whole_numbers("i % many.x", "i / many.x")
        lines = [
            f"for ({new('int', 'i')} = thread; i < many.x * many.y; i += {GROUP**2}) {{",
            f"    {new('int2', 'at')} = low + {at};",
            f"    {self._call('Keep', made, 'at', slot)};",
            "}",
            f"{self.dialect.barrier};",
        ]
        return "\n".join(indent + each for each in lines)

    def _pair(self) -> str:
        given = ("stage", self._whole_numbers("1 - y", "y"), "at", "y", "ends", "mm_per_texel")
        made = self._call("Along", *given, *self.own_profile)
        new, low = self.dialect.new, self._whole_numbers("after", "before + y * (after - before)")
        return f"""
// A stage, along x to the other slot of the memory and along y back, on texels that later ones
// need: those at least "after" from the ends of the tile, from such at least "before".
{self._head("void", "Blur", self._of_a_stage())} {{
    {self._begun()}
    for ({new("int", "y")} = 0; y < 2; y++) {{
        {new("int2", "low")} = {low};
        {new("int2", "many")} = side - 2 * low;
{self._loop(made, "1 - y", " " * 8)}
    }}
}}"""

    def _around(self) -> str:
        new, p, kind = self.dialect.new, self.prefix, self.dialect.types["float"]
        rows = [
            [self._inside(f"near + {self._whole_numbers(x, y)}", "0") for x in "01"] for y in "01"
        ]
        upper, lower = (f"(1.0 - part.x) * {left} + part.x * {right}" for left, right in rows)
        corner = self._vector("float2", f"{kind}(k & 1u)", f"{kind}((k >> 1u) & 1u)")
        turned = self._vector("float2", "to.x + to.y", "to.x - to.y")
        arguments = [("uint", "stage"), ("int2", "at"), ("int4", "ends"), ("float", "mm_per_texel")]
        return f"""
// A star at a texel: the middle, four diagonal fetches and four on the axes, between four texels
// each. What lies outside the picture, between whose ends it is, is the nearest texel inside.
{self._head(self.light, "Around", [*arguments, *self.profile])} {{
    {new("uint", "first")} = {p}_FIRST[stage];
    {new(self.light, "light")} = {self._at("WEIGHT", "first")} * {self._inside("at", "0")};
    for ({new("uint", "k")} = 0u; k < 8u; k++) {{
        {new("uint", "i")} = first + 1u + (k >> 2u);
        {new("float2", "to")} = 2.0 * {corner} - 1.0;
        if (k >= 4u) {{
            to = 0.5 * {turned}; // on the axes
        }}
        to *= {self._at("OFFSET_MM", "i")} / mm_per_texel;
        {new("float2", "part")} = to - floor(to);
        {new("int2", "near")} = at + {self.dialect.types["int2"]}(floor(to));
        {new(self.light, "upper")} = {upper};
        {new(self.light, "lower")} = {lower};
        light += {self._at("WEIGHT", "i")} * (upper + part.y * (lower - upper));
    }}
    return light;
}}"""

    def _star(self) -> str:
        made = self._call("Around", "stage", "at", "ends", "mm_per_texel", *self.own_profile)
        new, low = self.dialect.new, self._whole_numbers("after", "after")
        return f"""
// A stage in one pass, and back to the first slot of the memory.
{self._head("void", "Star", self._of_a_stage())} {{
    {self._begun()}
    {new("int2", "low")} = {low};
    {new("int2", "many")} = side - 2 * low;
{self._loop(made, "1", " " * 4)}
{self._loop(self._call("Kept", "at", "1"), "0", " " * 4)}
}}"""

    def _four(self) -> str:
        to = [self._whole_numbers(x, y) for y in "01" for x in "01"]
        first, *others = [self._inside(f"at + {each}", "0") for each in to]
        total = "\n".join(f"    light += {each};" for each in others)
        return f"""
// The mean of 2 x 2 texels.
{self._head(self.light, "Four", [("int2", "at"), ("int4", "ends")])} {{
    {self.dialect.new(self.light, "light")} = {first};
{total}
    return 0.25 * light;
}}"""

    def _level(self, level: Level) -> str:
        new, int2, zero = (
            self.dialect.new,
            self.dialect.types["int2"],
            self._whole_numbers("0", "0"),
        )
        arguments = [("picture", level.reads), ("uint2", "group"), ("uint2", "thread")]
        arguments += [("int2", "size"), ("float", "mm_per_pixel"), *self.profile]
        kind = "float4" if level.is_last else f"{self.prefix}_Tiled"
        own = f"{self.dialect.types['int']}(thread.y * {GROUP}u + thread.x)"
        last = self._whole_numbers(*[str(level.side - 1)] * 2)
        ends = f"max({zero} - corner, {zero}), min(size - 1 - corner, {last})"
        begun = self._all("0.0")
        if level.number == 0:
            begun = f"{self._at('BLEND', '0u', 'PICTURES')} * {self._texel('at')}"
        return "\n".join(
            [
                f"{self._head(kind, f'Level{level.number}', arguments)} {{",
                f"    {new('int2', 'corner')} = {int2}(group * {level.tile}u) - {level.halo};",
                f"    {new('int4', 'ends')} = {self._vector('int4', ends)};",
                f"    {new('int', 'own')} = {own};",
                f"    {self._call('Load', level.reads, 'corner', str(level.side), 'own', 'size')};",
                f"    {new('int2', 'at')} = {int2}(thread) + {level.halo};",
                f"    {new(self.light, 'light')} = {begun};",
                *(line for k in level.stages for line in self._stage(k, level)),
                *self._made(level),
                "}",
            ]
        )

    def _stage(self, k: int, level: Level) -> Iterator[str]:
        """Yield the lines that run a stage and add its picture."""
        name = "Blur" if self.taps.stages[k].kind == "pair" else "Star"
        before = sum(level.reaches[: k - level.stages[0]])
        margins = str(before), str(before + level.reaches[k - level.stages[0]])
        given = [f"{k}u", str(level.side), *margins, "own", "ends", "mm_per_pixel"]
        given += self.own_profile
        yield f"    {self._call(name, *given)};"
        share = self._at("BLEND", f"{k + 1}u", "PICTURES")
        yield f"    light += {share} * {self._texel('at')};"

    def _made(self, level: Level) -> Iterator[str]:
        """Yield the lines that end a level: its sum, and the mean of 2 x 2 texels."""
        if level.is_last:
            yield f"    return {self._whole('light', '1.0')};"
            return
        made = self.dialect.variable_of.format(kind=f"{self.prefix}_Tiled", name="made")
        four = self._call("Four", f"at + {self.dialect.types['int2']}(thread)", "ends")
        yield f"    {made};"
        yield f"    made.term[0] = {self._whole('light', '1.0')};"
        yield f"    {self.dialect.new(self.light, 'mean')} = {four};"
        yield f"    made.term[1] = {self._whole('mean', '1.0')};"
        yield "    return made;"

    def _add(self) -> str:
        arguments = [("picture", "coarse"), ("picture", "sum"), ("sampler", "bilinear")]
        arguments += [("float2", "position"), ("float2", "texel")]
        fetch = self._fetch("coarse", "0.5 * position * texel")
        return f"""
// The sum of a level and of all coarser ones.
{self._head("float4", "Add", arguments)} {{
{self._shown(f"{self._load('sum')}{self.rgb} + {fetch}{self.rgb}", "1.0")}
}}"""
