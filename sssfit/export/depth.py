"""Passes that follow depth: every fetch loses weight by its depth difference.

They are those of ``sssfit.render.screen_taps``, and a switch goes back to passes without depth. A
picture of depth holds coverage times depth in mm, so a bilinear fetch of it over that of coverage
is the mean depth of what is covered.

Texels themselves are loaded, not fetched: with 96 texels a side, texture coordinates round by up to
96 x 6e-8 of a texel, and so much of a neighbour 100 mm deeper would add 6e-4 mm.
"""

from collections.abc import Iterator

from sssfit.errors import KernelError
from sssfit.export.dialects import switch
from sssfit.export.functions import Functions
from sssfit.export.passes import Pass
from sssfit.kernel import Taps


def check_depth(taps: Taps) -> None:
    """Refuse tables whose passes cannot be divided one by one by what is near.

    Raises
    ------
    KernelError
    """
    if taps.is_disk:
        raise KernelError("a disk of fetches serves flat pictures only; export it without depth.")
    if taps.has_negative_weights:
        raise KernelError(
            "weights below 0 could make the sum of a pass vanish at a step in depth; export the "
            "table without depth, or fit one without such weights, such as a cascade."
        )


def depth_rates(taps: Taps) -> list[list[float]]:
    """Return 1 / (2 v) [1/mm^2] of each stage and channel, v as in the renderer."""
    from sssfit.render.screen_taps import followed_variances  # it needs numba

    return [(0.5 / each).tolist() for each in followed_variances(taps)]


class DepthFunctions(Functions):
    """The functions of `Functions`, with depth behind a switch."""

    beside = (("picture", "depth"),)

    def _own_helpers(self) -> list[str]:
        corners = [self._corners()] if self.has_sums or "star" in self.kinds else []
        return [self._near(), *corners, *([self._larger()] if self.has_sums else [])]

    def _switched(self, on: str, off: str) -> str:
        """Return lines with depth, and those without."""
        return f"{switch(self.prefix, 'DEPTH')}\n{on}\n#else\n{off}\n#endif"

    def _nothing(self) -> str:
        return self._vector("float4", *["0.0"] * 4)

    def _rate(self, stage: str) -> str:
        return self._at("RATE", stage, "STAGES")

    def _near(self) -> str:
        new = self.dialect.new
        arguments = [("uint", "stage"), ("float4", "there"), ("float", "depth"), ("float", "z")]
        return f"""
// A fetch keeps exp(-(dz^2) / (2 v)), v the stage's variance; {self.prefix}_RATE is 1 / (2 v).
{self._head(self.light, "Near", [*arguments, *self.profile])} {{
    {new("float", "dz")} = depth / max(there.a, 1e-20) - z;
    return exp(-{self._rate("stage")} * dz * dz);
}}"""

    def _kept(self, there: str, depth: str) -> str:
        profile = [name for _, name in self.profile]
        return self._call("Near", "stage", there, depth, "z", *profile)

    def _begin(self, picture: str, size: str, axis: str = "") -> str:
        new, flat = self.dialect.new, super()._begin(picture, size, axis).split("\n")
        on = f"""\
    {new("float4", "own")} = {self._load(picture)};
    if (own.a == 0.0) {{
        return {self._nothing()};
    }}
    {new("float", "z")} = {self._load("depth")}.x / own.a; // mm from the eye
{self._per_mm(f"(mm_per_pixel * {size} * z)", axis)}"""
        return "\n".join([flat[0], self._switched(on, "\n".join(flat[1:]))])

    def _added(self, place: str, weight: str, indent: str) -> str:
        """Return the lines that add one fetch."""
        new, depth = self.dialect.new, self._fetch("depth", place)
        lines = (
            f"{new('float4', 'there')} = {self._fetch('picture', place)};",
            f"{new(self.light, 'near')} = {weight} * {self._kept('there', f'{depth}.x')};",
            f"light += near * there{self.rgb};",
            "part += near * there.a;",
        )
        return "\n".join(indent + each for each in lines)

    def _two(self, weight: str) -> str:
        new = self.dialect.new
        on = f"""\
        for ({new("float", "side")} = -1.0; side < 2.0; side += 2.0) {{
            {new("float2", "at")} = place + side * away;
{self._added("at", weight, " " * 12)}
        }}"""
        return self._switched(on, super()._two(weight))

    def _nine(self) -> str:
        new = self.dialect.new
        middle, weight = self._at("WEIGHT", "first"), self._at("WEIGHT", "i")
        turned = self._vector("float2", "corner.x + corner.y", "corner.x - corner.y")
        on = f"""\
    {new(self.light, "light")} = {middle} * own{self.rgb};
    {new(self.light, "part")} = {middle} * own.a;
    for ({new("uint", "k")} = 0u; k < 8u; k++) {{
        {new("uint", "i")} = first + 1u + (k >> 2u);
        {new("float2", "corner")} = 2.0 * {self._corner("k")} - 1.0;
        if (k >= 4u) {{
            corner = 0.5 * {turned}; // on the axes
        }}
        {new("float2", "at")} = place + corner * {self._at("OFFSET_MM", "i")} * per_mm;
{self._added("at", weight, " " * 8)}
    }}"""
        return self._switched(on, super()._nine())

    def _corners(self) -> str:
        kind = self.dialect.types["float"]
        corner = self._vector("float2", f"{kind}(i & 1u)", f"{kind}((i >> 1u) & 1u)")
        return f"""
// (0, 0), (1, 0), (0, 1), (1, 1).
{self._head("float2", "Corner", [("uint", "i")])} {{
    return {corner};
}}"""

    def _corner(self, index: str) -> str:
        return self._call("Corner", index)

    def _clamped(self, lowest: str, middle: str) -> str:
        """Return the line with a texel of four, within the picture."""
        place = f"{lowest}({middle}, 1.0 / texel - 0.5)"
        return f"{self.dialect.new('float2', 'at')} = {place};"

    def _loads(self) -> list[str]:
        """Return loads of light and depth of a texel."""
        texel = self.dialect.load.format
        return [texel(picture=each, place="at") for each in ("picture", "depth")]

    def _halve(self) -> str:
        new, p = self.dialect.new, self.prefix
        struct = self.dialect.struct.format(
            name=f"{p}_Halved", kind=self.dialect.types["float4"], count=2
        )
        made = self.dialect.variable_of.format(kind=f"{p}_Halved", name="made")
        at = self._clamped("min", f"2.0 * floor(position) + {self._corner('i')}")
        arguments = [("uint", "stage"), ("picture", "picture"), *self.beside]
        arguments += [("sampler", "bilinear"), ("float2", "position"), ("float2", "texel")]
        load, depth = self._loads()
        far = self._call("Near", "stage", "there", "z", "nearest", *(n for _, n in self.profile))
        on = f"""\
    {new("float", "nearest")} = 1e30;
    for ({new("uint", "i")} = 0u; i < 4u; i++) {{
        {at}
        {new("float", "cover")} = {load}.a;
        if (cover > 0.0) {{
            nearest = min(nearest, {depth}.x / cover);
        }}
    }}
    for ({new("uint", "i")} = 0u; i < 4u; i++) {{
        {at}
        {new("float4", "there")} = {load};
        {new("float", "z")} = {depth}.x;
        {new(self.light, "near")} = {far};
        {new("float", "taken")} = 0.25 * {self._widest()};
        made.term[0] += taken * there;
        made.term[1].x += taken * z;
    }}"""
        off = f"    made.term[0] = {self._fetch('picture', '2.0 * position * texel')};"
        return f"""
// Half the size: of four texels those that are as near as the nearest. Depth is a second target.
{struct}
{self._head(f"{p}_Halved", "Halve", [*arguments, *self.profile])} {{
    {made};
    made.term[0] = {self._nothing()};
    made.term[1] = made.term[0];
{self._switched(on, off)}
    return made;
}}"""

    def _widest(self) -> str:
        """Return the factor of the channel with the widest stage, which is the largest."""
        names = [f"near.{each}" for each in "xyz"[: len(self.taps.channels)]]
        if len(names) == 1:
            return "near"
        first, *rest = names
        for each in rest:
            first = f"max({first}, {each})"
        return first

    def _larger(self) -> str:
        new = self.dialect.new
        arguments = [("uint", "stage"), ("float", "z"), ("picture", "picture"), *self.beside]
        arguments += [("float2", "position"), ("float2", "texel")]
        load, depth = self._loads()
        middle = f"near + {self._corner('i')} * side"
        at = self._clamped("clamp", f"{middle}, {self._vector('float2', '0.0', '0.0')}")
        zero = self._all("0.0")
        rate = self._rate("stage")
        return f"""
// Light of the smaller picture at depth z: four texels, each with a depth factor relative to the
// least difference, so that their sum does not vanish.
{self._head(self.light, "Larger", [*arguments, *self.profile])} {{
    {new("float2", "near")} = floor(0.5 * position); // its own texel, the others on its side
    {new("float2", "side")} = 2.0 * position - 4.0 * near - 2.0;
    {new("float", "least")} = 1e30;
    for ({new("uint", "i")} = 0u; i < 4u; i++) {{
        {at}
        {new("float", "cover")} = {load}.a;
        {new("float", "dz")} = {depth}.x / max(cover, 1e-20) - z;
        if (cover > 0.0) {{
            least = min(least, dz * dz);
        }}
    }}
    {new(self.light, "light")} = {zero};
    {new(self.light, "part")} = {zero};
    for ({new("uint", "i")} = 0u; i < 4u; i++) {{
        {at}
        {new("float4", "there")} = {load};
        {new("float", "dz")} = {depth}.x / max(there.a, 1e-20) - z;
        {new("float2", "share")} = 0.75 - 0.5 * {self._corner("i")};
        {new(self.light, "taken")} = share.x * share.y * exp({rate} * (least - dz * dz));
        light += taken * there{self.rgb};
        part += taken * there.a;
    }}
    return light / max(part, {self._all("1e-20")});
}}"""

    def _coarser(self, each: Pass) -> Iterator[str]:
        new, (smaller, own) = self.dialect.new, each.depths
        yield switch(self.prefix, "DEPTH")
        yield f"{new('float4', 'own')} = {self._load(each.adds[0][0])};"
        yield "if (own.a == 0.0) {"
        yield f"    return {self._nothing()};"
        yield "}"
        yield f"{new('float', 'z')} = {self._load(own)}.x / own.a;"
        given = (f"{each.stages[0]}u", "z", each.reads, smaller, "position", "texel")
        larger = self._call("Larger", *given, *(name for _, name in self.profile))
        yield f"{new(self.light, 'light')} = own.a * {larger} + {self._own_share(each)};"
        yield "#else"
        yield from super()._coarser(each)
        yield "#endif"
