"""Runs exported passes on a software driver, in the order of the pass list.

GLSL runs by moderngl (EGL, llvmpipe), HLSL too after glslang and spirv-cross, and WGSL by wgpu
(Vulkan, lavapipe). In CI these must be there; elsewhere a test skips with a reason.
"""

import functools
import importlib.util
import os
import re
import shutil
import struct
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from sssfit.export.passes import pass_list

TOOLS = {"glsl": ("moderngl",), "hlsl": ("moderngl",), "wgsl": ("wgpu",)}
PROGRAMS = ("glslangValidator", "spirv-val", "spirv-cross")
# Mesa's drivers compile each shader for pictures of a few pixels: without optimisation, and for
# narrow vectors, their tests take three fifths of the time.
os.environ |= {"GALLIVM_PERF": "nopt", "LP_NATIVE_VECTOR_WIDTH": "128"}
PRECISION = "".join(f"precision highp {each};\n" for each in ("float", "int", "sampler2D"))
_TRIANGLE = np.array([-1, -1, 3, -1, -1, 3], np.float32)
_PLANE = {"texel": (1.0, 1.0), "mm": (1.0, 1.0), "axis": (0.0, 0.0)}
NUMBERS = _PLANE | {"stage": 0, "frame": 0, "profile": 0}  # the uniforms of shaders
_VIEW = "6f3I4x"  # how they lie in WGSL's
_GLSL_VERTEX = "#version 450\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }"


def needs(dialect):
    """Skip where a driver or compiler is missing, but not in CI."""
    missing = [each for each in TOOLS[dialect] if importlib.util.find_spec(each) is None]
    if dialect == "hlsl":
        missing += [each for each in PROGRAMS if shutil.which(each) is None]
    if missing and os.environ.get("CI") == "true":
        pytest.fail(f"{', '.join(missing)} missing, and CI installs them")
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")


def run(
    text,
    dialect,
    taps,
    light,
    mm_per_pixel,
    *,
    cover=None,
    depth=None,
    prefix="SSS",
    half=False,
    frame=0,
    jitter=False,
    profile=None,
    normalized=False,
    whole=False,
):
    """The result (H, W, C) of exported source on light (H, W, C), with clamped borders.

    The whole of it has alpha too.

    With depth (H, W) [mm] the source must follow it; with mm a pixel (right, down) take them apart.
    """
    settings = {"cover": cover, "depth": depth, "prefix": prefix, "half": half, "frame": frame}
    settings |= {"jitter": jitter, "profile": profile, "literal": False}
    draws = _draws(text, dialect, taps, light, mm_per_pixel, normalized=normalized, **settings)
    last = None
    for targets, draw in draws:
        draw(1.0)
        last = targets[0]
    return device_of(dialect).pixels(last)[..., : 4 if whole else light.shape[2]]


def prepared(text, dialect, taps, light, mm_per_pixel, *, normalized):
    """A function that draws all passes in half floats, on a part of either side of the picture.

    Each pass has a shader of its own, which is what a renderer's times are measured with.
    """
    settings = {
        "cover": None,
        "depth": None,
        "prefix": "SSS",
        "half": True,
        "frame": 0,
        "jitter": False,
        "profile": None,
        "literal": True,
    }
    draws = list(
        _draws(text, dialect, taps, light, mm_per_pixel, normalized=normalized, **settings)
    )

    def draw_all(part):
        for _, draw in draws:
            draw(part)

    return draw_all


def _draws(
    text,
    dialect,
    taps,
    light,
    mm_per_pixel,
    *,
    cover,
    depth,
    prefix,
    half,
    frame,
    jitter,
    profile,
    normalized,
    literal,
):
    """Yield the targets of each pass and what draws it, in the order of the passes.

    Unless numbers are to be literal, stages and frames are uniforms, and passes share a shader:
    drivers and glslang compile half as many.
    """
    needs(dialect)
    height, width = light.shape[:2]
    whole = np.zeros((height, width, 4), np.float32)
    cover = np.ones((height, width)) if cover is None else cover
    whole[..., : light.shape[2]] = light * cover[..., None]
    whole[..., 3] = cover
    device = device_of(dialect)
    pictures = {"E": device.picture(whole, half=False)}
    if depth is not None:
        deep = np.repeat((depth * cover)[..., None], 4, axis=2).astype(np.float32)
        pictures["D0"] = device.picture(deep, half=False)
    mm = "mm.x" if np.isscalar(mm_per_pixel) else "mm"
    for each in pass_list(taps, normalized=normalized, depth=depth is not None):
        size = [-(-side // 2**each.level) for side in (width, height)]
        reads = each.pictures
        numbers = NUMBERS | {"stage": each.stages[0], "frame": frame, "profile": profile or 0}
        numbers["axis"] = each.axis or NUMBERS["axis"]
        numbers["texel"] = tuple(1.0 / side for side in pictures[reads[0]].size[:2])
        numbers["mm"] = tuple(np.broadcast_to(mm_per_pixel, 2).tolist())
        words = dict(zip(numbers, numbers, strict=True))
        if literal:
            words = {key: _literal(value, dialect) for key, value in numbers.items()}
        if profile is None:
            del words["profile"]
        targets, draw = device.prepare(
            text,
            _call(each, dialect, prefix, words, jitter, mm),
            [pictures[name] for name in reads],
            size,
            numbers,
            count=len(each.writes),
            onto=pictures.get(each.writes[0]) if each.is_added else None,
            half=half and each.writes[0] != "M0",
            prefix=prefix,
        )
        pictures |= dict(zip(each.writes, targets, strict=True))
        yield targets, draw


def _literal(value, dialect):
    """A whole number, or a vector of two, in the words of a dialect."""
    vector = {"hlsl": "float2", "glsl": "vec2", "wgsl": "vec2f"}[dialect]
    return f"{vector}{value}" if isinstance(value, tuple) else f"{value}u"


def _call(each, dialect, prefix, words, jitter, mm):
    """The call of a pass's function, with these words for its numbers."""
    sampler = [] if dialect == "glsl" else ["bilinear"]
    arguments = [*(f"t{k}" for k in range(len(each.pictures))), *sampler, "position", "texel"]
    if each.takes_stage:
        first = [words["stage"], *([words["axis"]] if each.axis else [])]
        arguments = [*first, *arguments]
    if each.kind not in ("halve", "sum"):
        arguments.append(mm)
    if each.takes_frame(jitter=jitter):
        arguments.append(words["frame"])
    if "profile" in words and (each.depths or each.kind != "halve"):
        arguments.append(words["profile"])
    return f"{prefix}_{each.name}({', '.join(arguments)})"


@functools.cache
def device_of(dialect):
    """The driver that runs a dialect."""
    return _Vulkan() if dialect == "wgsl" else _OpenGL(dialect)


@functools.cache
def _context():
    """One context serves both, since only the last that was made is current."""
    import moderngl

    return moderngl.create_context(standalone=True, backend="egl")


class _OpenGL:
    def __init__(self, dialect):
        import moderngl

        self.dialect, self.gl = dialect, moderngl
        self.context = _context()
        self.vertices = self.context.buffer(_TRIANGLE.tobytes())
        self.programs = {}

    def picture(self, pixels, half):
        height, width = pixels.shape[:2]
        kind = np.float16 if half else np.float32
        made = self.context.texture(
            (width, height),
            4,
            np.ascontiguousarray(pixels, kind).tobytes(),
            dtype="f2" if half else "f4",
        )
        made.repeat_x = made.repeat_y = False
        made.filter = self.gl.LINEAR, self.gl.LINEAR
        return made

    def pixels(self, picture):
        kind = np.float16 if picture.dtype == "f2" else np.float32
        found = np.frombuffer(picture.read(), kind).reshape(picture.height, picture.width, 4)
        return found.astype(np.float64)

    def prepare(self, text, call, pictures, size, numbers, *, count, onto, half, prefix):
        """The targets of a pass, and a function that draws it."""
        program = self._program(text, call, len(pictures), count, prefix)
        empty = np.zeros((size[1], size[0], 4))
        targets = [self.picture(empty, half) for _ in range(count)] if onto is None else [onto]
        frame = self.context.framebuffer(color_attachments=targets)
        vertices = self.context.simple_vertex_array(program, self.vertices, "at")
        members = {name: program[name] for name in program}
        given = [
            (each, value)
            for name, each in members.items()
            for key, value in numbers.items()
            if isinstance(each, self.gl.Uniform) and name.endswith(key)
        ]
        samplers = {
            each: int(found[1])
            for name, each in members.items()
            if (found := re.match(r"(?:SPIRV_Cross_Combined)?t(\d+)", name))
        }

        def draw(part):
            frame.use()
            middle = [round(0.5 * side * (1.0 - part)) for side in size]
            frame.scissor = (*middle, *(round(side * part) for side in size))
            for k, each in enumerate(pictures):
                each.use(k)
            for each, place in samplers.items():
                each.value = place
            for each, value in given:
                each.value = value
            if onto is not None:
                self.context.enable(self.gl.BLEND)
                self.context.blend_func = self.gl.ONE, self.gl.ONE
            vertices.render(vertices=3)
            self.context.disable(self.gl.BLEND)

        return targets, draw

    def _program(self, text, call, pictures, count, prefix):
        key = text, call, pictures, count
        if key not in self.programs:
            make = glsl_program if self.dialect == "glsl" else hlsl_program
            fragment = make(text, call, pictures, count, prefix)
            self.programs[key] = self.context.program(_GLSL_VERTEX, fragment)
        return self.programs[key]


def struct_of(prefix, call):
    """The structure that a function of several targets returns."""
    return f"{prefix}_{'Halved' if call.startswith(f'{prefix}_Halve(') else 'Terms'}"


def glsl_program(text, call, pictures, count, prefix):
    """A fragment shader around exported GLSL."""
    textures = "".join(f"uniform sampler2D t{k};\n" for k in range(pictures))
    outs = "".join(f"layout(location = {k}) out vec4 out{k};\n" for k in range(count))
    body = f"out0 = {call};"
    if count > 1:
        body = f"{struct_of(prefix, call)} all = {call};" + "".join(
            f" out{k} = all.term[{k}];" for k in range(count)
        )
    return (
        f"#version 450\n{text}\n{textures}uniform vec2 texel, mm, axis;\n"
        f"uniform uint stage, frame, profile;\n{outs}"
        f"void main() {{ vec2 position = gl_FragCoord.xy; {body} }}"
    )


def hlsl_source(text, call, pictures, count, prefix):
    """A pixel shader around exported HLSL."""
    textures = "".join(f"Texture2D<float4> t{k};\n" for k in range(pictures))
    outs = "".join(f"float4 out{k} : SV_Target{k}; " for k in range(count))
    body = f"o.out0 = {call};"
    if count > 1:
        body = f"{struct_of(prefix, call)} all = {call};" + "".join(
            f" o.out{k} = all.term[{k}];" for k in range(count)
        )
    return (
        f"{text}\n{textures}SamplerState bilinear;\nuniform float2 texel, mm, axis;\n"
        f"uniform uint stage, frame, profile;\nstruct Out {{ {outs}}};\n"
        "Out main(float4 at : SV_Position) {\n"
        f"float2 position = at.xy; Out o; {body} return o; }}"
    )


def spirv_of(text, folder, language="hlsl"):
    """Compile a fragment shader to SPIR-V that spirv-val accepts; return its path."""
    source, binary = Path(folder) / f"shader.{language}", Path(folder) / "shader.spv"
    source.write_text(text, encoding="utf-8")
    # GLSL here is that of OpenGL, where a uniform needs no block.
    flags = ["-D", "-e", "main", "-V"] if language == "hlsl" else ["-G"]
    mapped = ["--auto-map-bindings", "--auto-map-locations"]
    done = subprocess.run(
        ["glslangValidator", *flags, "-S", "frag", *mapped, "-o", binary, source],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{text}"
    target = ["--target-env", "vulkan1.1" if language == "hlsl" else "opengl4.5"]
    subprocess.run(["spirv-val", *target, binary], check=True)
    return binary


def hlsl_program(text, call, pictures, count, prefix):
    """The GLSL that spirv-cross makes of exported HLSL."""
    with tempfile.TemporaryDirectory() as folder:
        binary = spirv_of(hlsl_source(text, call, pictures, count, prefix), folder)
        command = ["spirv-cross", binary, "--version", "450", "--glsl-emit-ubo-as-plain-uniforms"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class _Vulkan:
    def __init__(self):
        os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.mkdtemp())
        # Its OpenGL backend would take the current context from moderngl.
        os.environ.setdefault("WGPU_BACKEND_TYPE", "Vulkan")
        import wgpu

        self.wgpu = wgpu
        adapter = wgpu.gpu.request_adapter_sync()
        self.device = adapter.request_device_sync(
            required_features=["float32-filterable", "float32-blendable"]
        )
        self.sampler = self.device.create_sampler(mag_filter="linear", min_filter="linear")
        self.pipelines = {}

    def _texture(self, width, height, half):
        use = self.wgpu.TextureUsage
        return self.device.create_texture(
            size=(width, height, 1),
            format="rgba16float" if half else "rgba32float",
            usage=use.TEXTURE_BINDING | use.COPY_DST | use.COPY_SRC | use.RENDER_ATTACHMENT,
        )

    def picture(self, pixels, half):
        height, width = pixels.shape[:2]
        kind = np.float16 if half else np.float32
        made = self._texture(width, height, half)
        self.device.queue.write_texture(
            {"texture": made}, np.ascontiguousarray(pixels, kind).tobytes(),
            {"bytes_per_row": width * 4 * kind().itemsize, "rows_per_image": height},
            (width, height, 1),
        )  # fmt: skip
        return made

    def pixels(self, picture):
        width, height = picture.size[:2]
        half = picture.format == "rgba16float"
        row = width * (8 if half else 16)
        stride = -(-row // 256) * 256
        data = self.device.queue.read_texture(
            {"texture": picture},
            {"bytes_per_row": stride, "rows_per_image": height},
            (width, height, 1),
        )
        rows = np.frombuffer(data, np.uint8).reshape(height, stride)[:, :row]
        kind = np.float16 if half else np.float32
        return np.ascontiguousarray(rows).view(kind).reshape(height, width, 4).astype(np.float64)

    def prepare(self, text, call, pictures, size, numbers, *, count, onto, half, prefix):
        """The targets of a pass, and a function that draws it, on the whole picture."""
        targets = [self._texture(*size, half) for _ in range(count)] if onto is None else [onto]
        key = text, call, len(pictures), count, targets[0].format, onto is not None
        if key not in self.pipelines:
            self.pipelines[key] = self._pipeline(text, call, len(pictures), targets, onto, prefix)
        pipeline = self.pipelines[key]
        view = self.device.create_buffer_with_data(
            data=struct.pack(
                _VIEW,
                *numbers["texel"], *numbers["mm"], *numbers["axis"],
                numbers["stage"], numbers["frame"], numbers["profile"],
            ),
            usage=self.wgpu.BufferUsage.UNIFORM,
        )  # fmt: skip
        own = [{"binding": 0, "resource": {"buffer": view, "offset": 0, "size": view.size}}]
        own.append({"binding": 1, "resource": self.sampler})
        views = [each.create_view() for each in pictures]
        own += [{"binding": 2 + k, "resource": each} for k, each in enumerate(views)]
        group = self.device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=own)
        how = {"load_op": "clear" if onto is None else "load", "store_op": "store"}
        how["clear_value"] = (0, 0, 0, 0)

        def draw(_):
            encoder = self.device.create_command_encoder()
            attached = [{"view": each.create_view(), **how} for each in targets]
            drawn = encoder.begin_render_pass(color_attachments=attached)
            drawn.set_pipeline(pipeline)
            drawn.set_bind_group(0, group)
            drawn.draw(3)
            drawn.end()
            self.device.queue.submit([encoder.finish()])

        return targets, draw

    def _pipeline(self, text, call, pictures, targets, onto, prefix):
        module = self.device.create_shader_module(
            code=wgsl_program(text, call, pictures, len(targets), prefix)
        )
        stage = self.wgpu.ShaderStage.FRAGMENT
        entries = [
            {"binding": 0, "visibility": stage, "buffer": {"type": "uniform"}},
            {"binding": 1, "visibility": stage, "sampler": {"type": "filtering"}},
            *(
                {"binding": 2 + k, "visibility": stage, "texture": {"sample_type": "float"}}
                for k in range(pictures)
            ),
        ]
        layout = self.device.create_pipeline_layout(
            bind_group_layouts=[self.device.create_bind_group_layout(entries=entries)]
        )
        add = {"src_factor": "one", "dst_factor": "one", "operation": "add"}
        blend = {"blend": {"color": add, "alpha": add}} if onto is not None else {}
        return self.device.create_render_pipeline(
            layout=layout,
            vertex={"module": module, "entry_point": "vertex"},
            primitive={"topology": "triangle-list"},
            fragment={
                "module": module,
                "entry_point": "fragment",
                "targets": [{"format": each.format, **blend} for each in targets],
            },
        )


def wgsl_program(text, call, pictures, count, prefix):
    """Vertex and fragment shaders around exported WGSL."""
    textures = "".join(
        f"@group(0) @binding({2 + k}) var t{k}: texture_2d<f32>;\n" for k in range(pictures)
    )
    outs = ", ".join(f"@location({k}) out{k}: vec4f" for k in range(count))
    body = f"o.out0 = {call};"
    if count > 1:
        body = f"var all = {call};" + "".join(f" o.out{k} = all.term[{k}];" for k in range(count))
    return f"""{text}
struct View {{ texel: vec2f, mm: vec2f, axis: vec2f, stage: u32, frame: u32, profile: u32 }}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var bilinear: sampler;
{textures}struct Out {{ {outs} }}
@vertex fn vertex(@builtin(vertex_index) k: u32) -> @builtin(position) vec4f {{
    return vec4f(f32(k / 2u) * 4.0 - 1.0, f32(k % 2u) * 4.0 - 1.0, 0.0, 1.0);
}}
@fragment fn fragment(@builtin(position) at: vec4f) -> Out {{
    let position = at.xy; let texel = view.texel; let mm = view.mm; let axis = view.axis;
    let stage = view.stage; let frame = view.frame; let profile = view.profile;
    var o: Out; {body} return o;
}}"""
