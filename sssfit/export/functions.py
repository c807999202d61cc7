"""The passes of a table of taps as functions of a shader.

A function is the body of a pixel shader. It takes the pictures that the pass reads, the middle of
the pixel that is written, and the size of a texel of the picture that is fetched from all around;
it returns light and coverage. With coverage A a picture holds A times light, and A, so a bilinear
fetch has the sums of both, and every pass is sum w A E / sum w A (``sssfit.render.taps``).
"""

import math
from collections.abc import Iterator, Sequence

from sssfit.errors import KernelError
from sssfit.export.dialects import KINDS, Dialect, literal, switch
from sssfit.export.passes import Pass
from sssfit.kernel import Taps

MOST_CHANNELS = 3  # of a picture whose fourth one is coverage
_FETCHED = (("sampler", "bilinear"), ("float2", "position"), ("float2", "texel"))
_LONGEST = 80  # of the arguments of a function in one line
_PER_PI = literal(1.0 / math.pi)
# The hash pcg2d of the pixel turns a disk, 2654435769 = 2^32 / phi a frame (sssfit.render.disk).
_TURN = """\
    {x} = {uint}(position.x) * 1664525u + 1013904223u;
    {y} = {uint}(position.y) * 1664525u + 1013904223u;
    x = x + y * 1664525u;
    y = y + x * 1664525u;
    x = x ^ (x >> 16u);
    y = y ^ (y >> 16u);
    x = x + y * 1664525u;
    y = y + x * 1664525u;
    x = (x ^ (x >> 16u)) + frame * 2654435769u;
    return {float}(x) * 1.4629180792671596e-9; // 2 pi / 2^32"""


class Functions:
    """The functions of tables with the same stages, in one dialect.

    Parameters
    ----------
    taps : Taps
    passes : sequence of Pass
    dialect : Dialect
    prefix : str
        Prefix of all names.
    is_indexed : bool
        Whether the arrays hold several profiles, of which an argument names one.
    is_jittered : bool
        Whether pixels can move the outer taps of a pass, behind a switch.
    is_tilted : bool
        Whether a pixel has mm of its own along either side.

    Attributes
    ----------
    beside : tuple of (str, str)
        Arguments after the pictures, of functions that several passes call.

    Raises
    ------
    KernelError
        The pictures have more channels than light and coverage leave room for.
    """

    beside: tuple[tuple[str, str], ...] = ()

    def __init__(
        self,
        taps: Taps,
        passes: Sequence[Pass],
        dialect: Dialect,
        prefix: str,
        *,
        is_indexed: bool,
        is_jittered: bool = False,
        is_tilted: bool = False,
    ) -> None:
        if len(taps.channels) > MOST_CHANNELS:
            raise KernelError(
                f"the table has {len(taps.channels)} channels; passes are written for at most "
                f"{MOST_CHANNELS}, since the fourth one of a picture is coverage."
            )
        self.taps, self.dialect, self.prefix = taps, dialect, prefix
        self.profile = (("uint", "profile"),) if is_indexed else ()
        self.frame = (("uint", "frame"),) if is_jittered else ()
        self.scale = "float2" if is_tilted else "float", "mm_per_pixel"
        self.light, self.rgb = KINDS[len(taps.channels) - 1], f".{'rgb'[: len(taps.channels)]}"
        self.passes = passes
        self.kinds = {each.kind for each in passes}
        self.has_sums = "sum" in self.kinds
        self.shares = any(len(each.stages) > 1 for each in passes)
        counts = [len(each.weights) for each in taps.stages]
        self.first = [sum(counts[:k]) for k in range(len(counts))]

    def lines(self) -> Iterator[str]:
        """Yield the lines of all functions."""
        kinds = self.kinds
        helpers = {
            "second": self._blur,
            "line": self._blur,
            "star": self._star,
            "disk": self._turn,
            "halve": self._halve,
        }
        parts = [self._covered()] if self.has_sums or self.shares or "disk" in kinds else []
        parts += self._own_helpers()
        parts += [self._moved()] if self.frame else []
        parts += dict.fromkeys(make() for kind, make in helpers.items() if kind in kinds)
        parts += [self._pass(each) for each in self.passes if each.is_own]
        for each in parts:
            yield from each.strip("\n").split("\n")
            yield ""

    def _own_helpers(self) -> list[str]:
        """Return further functions that the others call."""
        return []

    def _head(self, kind: str, name: str, arguments: Sequence[tuple[str, str]]) -> str:
        """Return a function's first line."""
        own = self.dialect
        types = {**own.types, "picture": own.picture, "sampler": own.sampler}
        words = [own.argument.format(kind=types[k], name=n) for k, n in arguments if types[k]]
        kind, full = types.get(kind, kind), f"{self.prefix}_{name}"
        apart = ",\n    " if sum(map(len, words)) > _LONGEST else ", "
        middle = (len(words) + 1) // 2
        halves = [", ".join(each) for each in (words[:middle], words[middle:]) if each]
        template = own.procedure if kind == "void" else own.function
        return template.format(kind=kind, name=full, arguments=apart.join(halves))

    def _call(self, name: str, *arguments: str) -> str:
        """Call one of the functions above; a dialect without samplers passes none."""
        shown = [each for each in arguments if each != "bilinear" or self.dialect.sampler]
        return f"{self.prefix}_{name}({', '.join(shown)})"

    def _at(self, name: str, index: str, rows: str = "TAPS") -> str:
        """Return an element of an array; each profile has so many rows of it."""
        of_profile = f"profile * {self.prefix}_{rows} + " if self.profile else ""
        return f"{self.prefix}_{name}[{of_profile}{index}]"

    def _fetch(self, picture: str, place: str) -> str:
        return self.dialect.fetch.format(picture=picture, place=place)

    def _both(self, name: str, picture: str, aways: Sequence[str], indent: str) -> str:
        """Return the lines that make the sum of mirrored fetches, a pair each."""
        first, *rest = [
            " + ".join(self._fetch(picture, f"place {sign} {each}") for sign in "-+")
            for each in aways
        ]
        lines = [f"{self.dialect.new('float4', name)} = {first};"]
        lines += [f"{name} += {each};" for each in rest]
        return "\n".join(indent + each for each in lines)

    def _load(self, picture: str) -> str:
        return self.dialect.load.format(picture=picture, place="position")

    def _vector(self, kind: str, *values: str) -> str:
        return values[0] if kind == "float" else f"{self.dialect.types[kind]}({', '.join(values)})"

    def _all(self, value: str) -> str:
        """Return the same value in each channel; HLSL makes no vector of a single number."""
        return self._vector(self.light, *[value] * len(self.taps.channels))

    def _axis(self, each: Pass) -> str:
        """Return the direction of a pass, right and down."""
        return self._vector("float2", *(literal(number) for number in each.axis or (1.0, 0.0)))

    def _whole(self, light: str, cover: str) -> str:
        """Return four numbers: light, that of one channel as grey, and coverage in the last."""
        channels = len(self.taps.channels)
        beside = [light if channels == 1 else "0.0"] * (MOST_CHANNELS - channels)
        return self._vector("float4", light, *beside, cover)

    def _covered(self) -> str:
        """Return the function that ends most passes, where several need it."""
        arguments = [(self.light, "light"), (self.light, "part"), ("float", "cover")]
        return f"""
// Light as the next pass reads it, with its coverage.
{self._head("float4", "Covered", arguments)} {{
{self._returned("light", "part", "cover")}
}}"""

    def _returned(self, light: str, part: str, cover: str) -> str:
        """Return the lines that end a function: light over what was covered, times coverage."""
        shown = f"{cover} * {light} / max({part}, {self._all('1e-20')})"
        return f"""\
{switch(self.prefix, "COVERAGE")}
{self._shown(shown, cover)}
#else
    return {self._whole(light, "1.0")};
#endif"""

    def _shown(self, light: str, cover: str) -> str:
        """Return the lines that return light and coverage; that of one channel needs a name."""
        if len(self.taps.channels) > 1:
            return f"    return {self._whole(light, cover)};"
        named = f"    {self.dialect.new('float', 'shown')} = {light};"
        return f"{named}\n    return {self._whole('shown', cover)};"

    def _end(self) -> str:
        """Return the lines that end a pass of a stage."""
        if self.has_sums or self.shares:
            return f"    return {self._call('Covered', 'light', 'part', 'own.a')};"
        return self._returned("light", "part", "own.a")

    def _begin(self, picture: str, size: str, axis: str = "") -> str:
        """Return the lines that find the pixel, a mm and the middle in texture coordinates."""
        new = self.dialect.new
        return f"""\
    {new("float2", "place")} = position * texel;
{self._per_mm(f"(mm_per_pixel * {size})" if size else "mm_per_pixel", axis)}
    {new("float4", "own")} = {self._fetch(picture, "place")};"""

    def _per_mm(self, mm: str, axis: str) -> str:
        """Return the lines that find a mm, along an axis if any, given the mm of a texel."""
        new, along = self.dialect.new, f"{axis} * " if axis else ""
        line = f"    {new('float2', 'per_mm')} = {along}texel / {mm};"
        if not (axis and self.frame):
            return line
        moved = f"    {new('float2', 'moved')} = {self._call('Moved', axis, 'position', 'frame')}"
        return f"{line}\n{self._if_jittered(f'{moved} * texel / {mm};')}"

    def _if_jittered(self, lines: str) -> str:
        return f"{switch(self.prefix, 'JITTER')}\n{lines}\n#endif"

    def _away(self, index: str, stage: str) -> str:
        """Return the lines that find how far away a fetch lies, in texture coordinates."""
        offset, outer = self._at("OFFSET_MM", index), f"{self.prefix}_OUTER[{stage}]"
        line = f"        {self.dialect.new('float2', 'away')} = {offset} * per_mm;"
        if not self.frame:
            return line
        moved = f"            away = {offset} * moved;"
        lines = "\n".join((f"        if ({index} >= {outer}) {{", moved, "        }"))
        return f"{line}\n{self._if_jittered(lines)}"

    def _two(self, weight: str) -> str:
        """Return the lines that add two mirrored fetches."""
        return f"""\
{self._both("both", "picture", ["away"], " " * 8)}
        light += {weight} * both{self.rgb};
        part += {weight} * both.a;"""

    def _blur(self) -> str:
        new, p = self.dialect.new, self.prefix
        weight, middle = self._at("WEIGHT", "i"), self._at("WEIGHT", "first")
        numbers = (("uint", "stage"), ("float2", "axis"), ("picture", "picture"), *self.beside)
        return f"""
// A pass of a stage: the middle, and mirrored pairs of bilinear fetches.
{self._head("float4", "Blur", [*numbers, *_FETCHED, self.scale, *self.frame, *self.profile])} {{
{self._begin("picture", f"{p}_SIZE[stage]", "axis")}
    {new("uint", "first")} = {p}_FIRST[stage];
    {new(self.light, "light")} = {middle} * own{self.rgb};
    {new(self.light, "part")} = {middle} * own.a;
    for ({new("uint", "i")} = first + 1u; i < {p}_FIRST[stage + 1u]; i++) {{
{self._away("i", "stage")}
{self._two(weight)}
    }}
{self._end()}
}}"""

    def _star(self) -> str:
        new, p = self.dialect.new, self.prefix
        numbers = (("uint", "stage"), ("picture", "picture"), *self.beside)
        return f"""
// A stage in one pass: the middle, four diagonal fetches and four on the axes.
{self._head("float4", "Star", [*numbers, *_FETCHED, self.scale, *self.profile])} {{
{self._begin("picture", f"{p}_SIZE[stage]")}
    {new("uint", "first")} = {p}_FIRST[stage];
{self._nine()}
{self._end()}
}}"""

    def _nine(self) -> str:
        """Return the lines that add up the fetches of a star."""
        new, rgb = self.dialect.new, self.rgb
        w0, w1, w2 = (self._at("WEIGHT", f"first + {k}u") for k in range(3))
        o1, o2 = (self._at("OFFSET_MM", f"first + {k}u") for k in (1, 2))
        turned, x, y = (
            self._vector("float2", *each)
            for each in (("away.x", "0.0 - away.y"), ("away.x", "0.0"), ("0.0", "away.y"))
        )
        return f"""\
    {new("float2", "away")} = {o1} * per_mm;
    {new("float2", "turned")} = {turned};
{self._both("corners", "picture", ["away", "turned"], " " * 4)}
    away = {o2} * per_mm;
{self._both("beside", "picture", [x, y], " " * 4)}
    {new(self.light, "light")} = {w0} * own{rgb} + {w1} * corners{rgb} + {w2} * beside{rgb};
    {new(self.light, "part")} = {w0} * own.a + {w1} * corners.a + {w2} * beside.a;"""

    def through(self) -> str:
        """Return the function that reads the table of ``sssfit.export.through``."""
        new, k = self.dialect.new, "THROUGH_ROWS"
        mm = [self._at("THROUGH_MM", each, k) for each in ("i - 1u", "i")]
        share = [self._at("THROUGH", each, k) for each in ("i - 1u", "i", "0u")]
        return f"""
{self._head(self.light, "Through", [("float", "thickness_mm"), *self.profile])} {{
    {new(self.light, "share")} = {share[2]};
    for ({new("uint", "i")} = 1u; i < {self.prefix}_{k}; i++) {{
        {new("float", "width")} = max({mm[1]} - {mm[0]}, 1e-6);
        {new("float", "part")} = clamp((thickness_mm - {mm[0]}) / width, 0.0, 1.0);
        share += part * ({share[1]} - {share[0]});
    }}
    return share;
}}"""

    def _turn(self) -> str:
        new, types = self.dialect.new, self.dialect.types
        body = _TURN.format(
            x=new("uint", "x"), y=new("uint", "y"), uint=types["uint"], float=types["float"]
        )
        arguments = [("float2", "position"), ("uint", "frame")]
        return f"""
// The angle by which a pixel turns its fetches in a frame: the first word of the hash pcg2d.
{self._head("float", "Turn", arguments)} {{
{body}
}}"""

    def _moved(self) -> str:
        """Return the function that turns and lengthens an axis, as in ``sssfit.render.jitter``."""
        new, p = self.dialect.new, self.prefix
        arguments = [("float2", "axis"), ("float2", "position"), ("uint", "frame")]
        far = f"position + {self._vector('float2', '613.0', '977.0')}"
        first, second = (self._call("Turn", each, "frame") for each in ("position", far))
        turned = self._vector("float2", "c * axis.x - s * axis.y", "s * axis.x + c * axis.y")
        moved = f"""{self._turn().strip()}

// The axis of a pixel's outer taps, turned and made longer or shorter by two random numbers.
{self._head("float2", "Moved", arguments)} {{
    {new("float", "turn")} = {p}_JITTER_RADIANS * ({first} * {_PER_PI} - 1.0);
    {new("float", "longer")} = {second} * {_PER_PI} - 1.0; // both from -1 to 1
    longer = 1.0 + {p}_JITTER_SCALE * longer;
    {new("float", "c")} = cos(turn);
    {new("float", "s")} = sin(turn);
    return longer * {turned};
}}"""
        return self._if_jittered(moved)

    def _pass(self, each: Pass) -> str:
        """Return the function of a pass that is not a call of those above alone."""
        several = len(each.stages) > 1
        make = self._terms if several else self._disk if each.kind == "disk" else self._sum
        arguments = [*(("picture", name) for name in each.pictures), *_FETCHED]
        arguments += [] if each.kind == "sum" else [self.scale]
        arguments += [("uint", "frame")] if each.takes_frame(jitter=bool(self.frame)) else []
        struct = self.dialect.struct.format(
            name=f"{self.prefix}_Terms", kind=self.dialect.types["float4"], count=len(each.stages)
        )
        head = self._head(
            f"{self.prefix}_Terms" if several else "float4", each.name, [*arguments, *self.profile]
        )
        lines = [line if line.startswith("#") else f"    {line}" for line in make(each)]
        return "\n".join([*([struct] if several else []), f"{head} {{", *lines, "}"])

    def _halve(self) -> str:
        return f"""
// Half the size: one fetch at the corner of four texels.
{self._head("float4", "Halve", [("picture", "picture"), *_FETCHED])} {{
    return {self._fetch("picture", "2.0 * position * texel")};
}}"""

    def _sum(self, each: Pass) -> Iterator[str]:
        """Yield the lines that add up the pictures of a level: its last stage, or a coarser sum."""
        new = self.dialect.new
        adds, cover = each.adds, "own.a"
        if each.kind == "sum":
            yield from self._coarser(each)
            adds = adds[1:]
        else:
            share = self._at("BLEND", f"{each.stages[0] + 1}u", "PICTURES")
            yield f"{new('float4', 'blurred')} = {self._last(each)};"
            yield f"{new(self.light, 'light')} = {share} * blurred{self.rgb};"
            cover = "0.0" if each.is_added else "blurred.a"  # the target has it already
        for name, row in adds:
            share = self._at("BLEND", f"{row}u", "PICTURES")
            yield f"light += {share} * {self._load(name)}{self.rgb};"
        yield f"return {self._whole('light', cover)};"

    def _coarser(self, each: Pass) -> Iterator[str]:
        """Yield the lines that add a coarser sum, over what it covers there, and a pixel's own."""
        new, place = self.dialect.new, "0.5 * position * texel"
        yield f"{new('float4', 'coarse')} = {self._fetch(each.reads, place)};"
        yield f"{new('float4', 'own')} = {self._load(each.adds[0][0])};"
        part = f"coarse.{'a' * len(self.taps.channels)}"
        coarse = self._call("Covered", f"coarse{self.rgb}", part, "own.a")
        yield f"{new(self.light, 'light')} = {coarse}{self.rgb} + {self._own_share(each)};"

    def _own_share(self, each: Pass) -> str:
        """Return what a sum adds of the picture that it takes its coverage from."""
        return f"{self._at('BLEND', f'{each.adds[0][1]}u', 'PICTURES')} * own{self.rgb}"

    def _last(self, each: Pass) -> str:
        """Return a call of the last pass of a stage."""
        profile = [name for _, name in self.profile]
        given = [each.reads, *each.depths, "bilinear", "position", "texel", "mm_per_pixel"]
        stage = f"{each.stages[0]}u"
        if each.kind == "star":
            return self._call("Star", stage, *given, *profile)
        frame = [name for _, name in self.frame]
        return self._call("Blur", stage, self._axis(each), *given, *frame, *profile)

    def _terms(self, each: Pass) -> Iterator[str]:
        """Yield the lines of the first pass of several terms, which fetches once for all."""
        new, first = self.dialect.new, [self.first[k] for k in each.stages]
        yield from (
            line.strip() for line in self._begin(each.reads, "", self._axis(each)).split("\n")
        )
        for k, start in enumerate(first):
            middle = self._at("WEIGHT", f"{start}u")
            yield f"{new(self.light, f'light{k}')} = {middle} * own{self.rgb};"
            yield f"{new(self.light, f'part{k}')} = {middle} * own.a;"
        count = len(self.taps.stages[each.stages[0]].weights)
        yield f"for ({new('uint', 'i')} = 1u; i < {count}u; i++) {{"
        rows = [f"{start}u + i" if start else "i" for start in first]
        away = self._away(rows[0], f"{each.stages[0]}u")
        yield from (line.removeprefix("    ") for line in away.split("\n"))
        yield from self._both("both", each.reads, ["away"], " " * 4).split("\n")
        for k, row in enumerate(rows):
            yield f"    light{k} += {self._at('WEIGHT', row)} * both{self.rgb};"
            yield f"    part{k} += {self._at('WEIGHT', row)} * both.a;"
        yield "}"
        yield f"{self.dialect.variable_of.format(kind=f'{self.prefix}_Terms', name='made')};"
        for k in range(len(first)):
            yield f"made.term[{k}] = {self._call('Covered', f'light{k}', f'part{k}', 'own.a')};"
        yield "return made;"

    def _disk(self, each: Pass) -> Iterator[str]:
        """Yield the lines of single fetches on a spiral that each pixel turns by its own angle."""
        new, begin = self.dialect.new, self._begin(each.reads, "").split("\n")
        yield from (line.strip() for line in begin)
        count, weight = len(self.taps.stages[0].weights), self._at("WEIGHT", "i")
        yield f"{new('float', 'turn')} = {self._call('Turn', 'position', 'frame')};"
        yield f"{new(self.light, 'light')} = {self._at('WEIGHT', '0u')} * own{self.rgb};"
        yield f"{new(self.light, 'part')} = {self._at('WEIGHT', '0u')} * own.a;"
        yield f"{new('float', 'c')} = cos(turn);"
        yield f"{new('float', 's')} = sin(turn);"
        yield f"for ({new('uint', 'i')} = 1u; i < {count}u; i++) {{"
        x, y = (f"{self._at('PLACE_MM', 'i')}.{each}" for each in "xy")
        turned = self._vector("float2", f"c * {x} - s * {y}", f"s * {x} + c * {y}")
        yield f"    {new('float2', 'away')} = {turned} * per_mm;"
        yield f"    {new('float4', 'there')} = {self._fetch(each.reads, 'place + away')};"
        yield f"    light += {weight} * there{self.rgb};"
        yield f"    part += {weight} * there.a;"
        yield "}"
        yield f"{new('float4', 'blurred')} = {self._call('Covered', 'light', 'part', 'own.a')};"
        share = self._at("BLEND", "1u", "PICTURES")
        yield f"{new(self.light, 'shown')} = {share} * blurred{self.rgb};"
        if each.adds:
            yield f"shown += {self._at('BLEND', '0u', 'PICTURES')} * own{self.rgb};"
        yield f"return {self._whole('shown', 'own.a')};"
