"""The languages of tables and passes: how each declares, calls and fetches.

A dialect is data; ``constants`` and ``functions`` write in it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sssfit.files import has_mark
from sssfit.messages import printable

# What a line is that differs in another engine or language (sssfit.export.remarks). No semicolon,
# which ends a line for Babylon.js.
_FETCH = "texture call, bilinear at level 0"
_LOAD = "texture call, one texel"
_TYPES = "texture and sampler types"
_ARRAY = "array syntax"
_SHARED = "group memory"
_BARRIER = "group barrier"
_MADE = "array syntax, an output each"
_OUTPUT = "output: light and coverage"

KINDS = ("float", "float2", "float3", "float4")  # of one to four channels


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language says what a shader needs; templates are those of ``str.format``.

    Parameters
    ----------
    name : str
    types : mapping
        Names of float, float2, float3, float4 and uint; for passes also of int, int2, int4, uint2.
    constant : str
        With kind, name, dims and value.
    array : tuple of str
        Before and after the rows, with kind, name, dims and count.
    vector : str
        A value for each channel, with kind and values.
    number : str
        With value.
    function, procedure, argument, variable : str
        A function's first line with kind, name and arguments, and that of one that returns nothing;
        the others with kind and name.
    picture, sampler : str
        Types of arguments; without a sampler a picture has its own.
    fetch, load : str
        With picture and place: a bilinear fetch at texture coordinates; a texel at its middle.
    struct, variable_of : str
        A structure of an array ``term``, with kind, name and count; a variable of it.
    shared : str
        An array of floats of a group of threads, with name and count.
    barrier : str
        Waits for all threads of a group.
    has_defines : bool
        Whether there is a preprocessor.
    remarks : tuple of (str, str)
        Patterns of lines that differ in another language or engine, and what these lines are.
    versions, compute_versions : str
        The first versions that compile passes and compute shaders, where a file must name them.
    deep : str
        What a device must have to fetch from pictures of 32 bits, where it may lack it.
    """

    name: str
    types: Mapping[str, str]
    constant: str
    array: tuple[str, str]
    vector: str
    number: str = "{value}"
    function: str = "{kind} {name}({arguments})"
    procedure: str = "void {name}({arguments})"
    argument: str = "{kind} {name}"
    variable: str = "{kind} {name}"
    picture: str = ""
    sampler: str = ""
    fetch: str = ""
    load: str = ""
    struct: str = "struct {name} {{ {kind} term[{count}]; }};"
    variable_of: str = "{kind} {name}"
    shared: str = ""
    barrier: str = ""
    has_defines: bool = True
    remarks: tuple[tuple[str, str], ...] = ()
    versions: str = ""
    compute_versions: str = ""
    deep: str = ""

    @property
    def has_passes(self) -> bool:
        """Whether passes can be written in it, not tables alone."""
        return bool(self.fetch)

    @property
    def mark(self) -> str:
        """The first line of our files, which may be replaced."""
        return f"// sssfit.{self.name}/1"

    def is_ours(self, path: Path) -> bool:
        """Return whether a file is source that we wrote in this language."""
        return has_mark(path, {self.mark.encode(): b""})

    def literal(self, values: Sequence[float]) -> str:
        """Return a constant of single precision for each channel, as one value."""
        numbers = [self.number.format(value=literal(each)) for each in values]
        if len(numbers) == 1:
            return numbers[0]
        kind = self.types[KINDS[min(len(numbers), len(KINDS)) - 1]]  # of C, for any number
        return self.vector.format(kind=kind, values=", ".join(numbers))

    def new(self, kind: str, name: str) -> str:
        """Return the left side of a variable's declaration."""
        return self.variable.format(kind=self.types[kind], name=name)


_WHOLE = ("uint", "uint2", "int", "int2", "int4")
_HLSL_TYPES = {each: each for each in (*KINDS, *_WHOLE)}
HLSL = Dialect(
    "hlsl",
    _HLSL_TYPES,
    constant="static const {kind} {name} = {value};",
    array=("static const {kind} {name}[{count}] = {{", "}};"),
    vector="{kind}({values})",
    picture="Texture2D<float4>",
    sampler="SamplerState",
    fetch="{picture}.SampleLevel(bilinear, {place}, 0.0)",
    load="{picture}.Load(int3(int2({place}), 0))",
    shared="groupshared float {name}[{count}];",
    barrier="GroupMemoryBarrierWithGroupSync()",
    remarks=(
        (r"\.SampleLevel\(", _FETCH),
        (r"\.Load\(", _LOAD),
        (r"Texture2D<|SamplerState ", _TYPES),
        (r"^static const \w+ \w+\[", _ARRAY),
        (r"^groupshared ", _SHARED),
        (r"GroupMemoryBarrier", _BARRIER),
        (r"^struct ", _MADE),
        (r"^ +return float4\(", _OUTPUT),
    ),
)
GLSL = replace(
    HLSL,
    name="glsl",
    types=dict(
        zip(
            (*KINDS, *_WHOLE),
            ("float", "vec2", "vec3", "vec4", "uint", "uvec2", "int", "ivec2", "ivec4"),
            strict=True,
        )
    ),
    constant="const {kind} {name} = {value};",
    array=("const {kind} {name}[{count}] = {kind}[{count}](", ");"),
    picture="sampler2D",
    sampler="",
    fetch="textureLod({picture}, {place}, 0.0)",
    load="texelFetch({picture}, ivec2({place}), 0)",
    shared="shared float {name}[{count}];",
    barrier="barrier()",
    remarks=(
        (r"textureLod\(", _FETCH),
        (r"texelFetch\(", _LOAD),
        (r"sampler2D ", "texture types, each with its sampler"),
        (r"^const \w+ \w+\[", _ARRAY),
        (r"^shared ", _SHARED),
        (r"barrier\(\)", _BARRIER),
        (r"^struct ", _MADE),
        (r"^ +return vec4\(", _OUTPUT),
    ),
    versions="130 or 300 es",
    compute_versions="430 or 310 es",
    deep="In WebGL 2 and OpenGL ES fetching from D0, D1, ... needs OES_texture_float_linear, and "
    "writing them EXT_color_buffer_float.",
)
WGSL = Dialect(
    "wgsl",
    dict(
        zip(
            (*KINDS, *_WHOLE),
            ("f32", "vec2f", "vec3f", "vec4f", "u32", "vec2u", "i32", "vec2i", "vec4i"),
            strict=True,
        )
    ),
    constant="const {name}: {kind} = {value};",
    array=("const {name} = array<{kind}, {count}>(", ");"),
    vector="{kind}({values})",
    function="fn {name}({arguments}) -> {kind}",
    procedure="fn {name}({arguments})",
    argument="{name}: {kind}",
    variable="var {name}",
    picture="texture_2d<f32>",
    sampler="sampler",
    fetch="textureSampleLevel({picture}, bilinear, {place}, 0.0)",
    load="textureLoad({picture}, vec2i({place}), 0)",
    struct="struct {name} {{ term: array<{kind}, {count}> }}",
    variable_of="var {name}: {kind}",
    shared="var<workgroup> {name}: array<f32, {count}>;",
    deep="Fetching from D0, D1, ... needs a device with the feature float32-filterable.",
    barrier="workgroupBarrier()",
    has_defines=False,
    remarks=(
        (r"textureSampleLevel\(", _FETCH),
        (r"textureLoad\(", _LOAD),
        (r"texture_2d<|: sampler\b", _TYPES),
        (r"^const \w+ = array<", _ARRAY),
        (r"^var<workgroup> ", _SHARED),
        (r"workgroupBarrier\(\)", _BARRIER),
        (r"^struct ", _MADE),
        (r"^ +return vec4f\(", _OUTPUT),
    ),
)
C = Dialect(
    "c",
    {**dict.fromkeys(KINDS, "float"), "uint": "unsigned"},
    constant="static const {kind} {name}{dims} = {value};",
    array=("static const {kind} {name}[{count}]{dims} = {{", "}};"),
    vector="{{{values}}}",
    number="{value}f",
)
DIALECTS = {each.name: each for each in (HLSL, GLSL, WGSL, C)}


def literal(value: float) -> str:
    """Return a single-precision literal in as few digits as are read back to the same bits.

    Subnormal numbers become 0, as on GPUs.
    """
    single = np.float32(value)
    if abs(single) < np.finfo(np.float32).tiny:
        return "0.0"
    text = np.format_float_scientific(single, trim="0", exp_digits=1)
    plain = np.format_float_positional(single, trim="0")
    return plain if len(plain) <= len(text) else text


def switch(prefix: str, feature: str) -> str:
    """Return the line after which lines stand that are for a feature alone.

    Babylon.js takes a name alone for the question whether it is defined, and compares numbers as
    all others do.
    """
    return f"#if {prefix}_{feature} == 1"


def commented(words: str) -> str:
    """Return a line of comment, with # apart: Babylon.js finds directives anywhere in a line."""
    return f"// {printable(words).replace('#', '# ')}".rstrip()
