"""Runs exported compute shaders on a software driver, in the order of their dispatches."""

import functools
import struct
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from shader_runs import device_of, needs

from sssfit.export.compute import GROUP, levels_of

VECTORS = {"hlsl": "float2", "glsl": "vec2", "wgsl": "vec2f"}


def run_compute(
    text, dialect, tables, light, mm_per_pixel, *, prefix="SSS", profile=None, whole=False
):
    """The result (H, W, C) of exported source on light (H, W, C); the whole of it has alpha too."""
    pictures, run = prepared_compute(
        text, dialect, tables, light, mm_per_pixel, prefix=prefix, profile=profile
    )
    run(1.0)
    return device_of(dialect).pixels(pictures["M0"])[..., : 4 if whole else light.shape[2]]


def prepared_compute(
    text, dialect, tables, light, mm_per_pixel, *, prefix="SSS", profile=None, half=False
):
    """Pictures by their names, and what makes all dispatches on a part of either side."""
    needs(dialect)
    height, width = light.shape[:2]
    whole = np.ones((height, width, 4), np.float32)
    whole[..., : light.shape[2]] = light
    device = device_of(dialect)
    make = _Vulkan(device) if dialect == "wgsl" else _OpenGL(device, dialect)
    pictures, dispatches = {"E": device.picture(whole, half=False)}, []
    levels = levels_of(tables)
    mine = [] if profile is None else [f"{profile}u"]

    def add(body, reads, writes, sizes, groups):
        halves = [half and name != "M0" for name in writes]
        for name, size, each in zip(writes, sizes, halves, strict=True):
            pictures[name] = make.target(size, each)
        ends = [pictures[each] for each in (*reads, *writes)]
        numbers = [*pictures[reads[0]].size[:2], mm_per_pixel]
        dispatches.append((make.dispatch(text, body, ends, tuple(halves), numbers), groups))

    sizes = [[-(-side // 2**k) for side in (width, height)] for k in range(len(levels) + 1)]
    for each in levels:
        call = ", ".join(["t0", "group", "thread", "size", "mm", *mine])
        all_of = f"{prefix}_Level{each.number}({call})"
        own = sizes[each.number : each.number + len(each.writes)]
        groups = [-(-side // each.tile) for side in own[0]]
        add(stored(dialect, all_of, each, prefix), (each.reads,), each.writes, own, groups)
    for each in reversed(levels[:-1]):
        n, sampler = each.number, [] if dialect == "glsl" else ["bilinear"]
        vector = VECTORS[dialect]
        at = f"{vector}(group * {GROUP}u + thread) + {vector}(0.5, 0.5)"
        texel = f"{vector}(1.0, 1.0) / {vector}(size)"
        call = ", ".join(["t0", "t1", *sampler, at, texel])
        body = store(dialect, 0, GROUP, f"{prefix}_Add({call})")
        groups = [-(-side // GROUP) for side in sizes[n]]
        add(body, (f"M{n + 1}", f"P{n}"), (f"M{n}",), [sizes[n]], groups)

    def run(part):
        for dispatch, groups in dispatches:
            some = [round(each * part) for each in groups]
            if all(some):
                dispatch(some)

    return pictures, run


def stored(dialect, call, level, prefix):
    """The statements that call a level and store what it returns."""
    if level.is_last:
        return store(dialect, 0, level.tile, call)
    made = f"var all = {call};" if dialect == "wgsl" else f"{prefix}_Tiled all = {call};"
    halves = store(dialect, 1, level.tile // 2, "all.term[1]")
    return f"{made} {store(dialect, 0, level.tile, 'all.term[0]')} {halves}"


def store(dialect, k, tile, value):
    """The statements that store a value where a thread is below the tile; all threads make it."""
    new = {"hlsl": "float4", "glsl": "vec4", "wgsl": "let"}[dialect]
    at = f"group * {tile}u + thread"
    how = {
        "hlsl": f"out{k}[{at}] = made{k};",
        "glsl": f"imageStore(out{k}, ivec2({at}), made{k});",
        "wgsl": f"textureStore(out{k}, {at}, made{k});",
    }[dialect]
    return f"{new} made{k} = {value}; if (thread.x < {tile}u && thread.y < {tile}u) {{ {how} }}"


class _OpenGL:
    def __init__(self, device, dialect):
        self.device, self.dialect = device, dialect

    def target(self, size, half):
        return self.device.picture(np.zeros((size[1], size[0], 4)), half=half)

    def dispatch(self, text, body, ends, halves, numbers):
        """What runs a shader on pictures: those that are read, then those that are written."""
        reads = len(ends) - len(halves)
        program = program_of(self.dialect, text, body, reads, halves)

        def run(groups):
            for k, each in enumerate(ends):
                if k < reads:
                    each.use(k)
                else:
                    each.bind_to_image(k - reads, read=False, write=True)
            for name in program:
                plain = name.removeprefix("SPIRV_Cross_Combined")
                if plain.startswith(("t0", "t1", "out")):
                    program[name].value = int(plain.removeprefix("out").removeprefix("t")[0])
                elif name.endswith("size"):
                    program[name].value = tuple(numbers[:2])
                elif name.endswith("mm"):
                    program[name].value = numbers[2]
            program.run(*groups)
            self.device.context.memory_barrier()

        return run


@functools.cache
def program_of(dialect, text, body, reads, halves):
    """A program of OpenGL."""
    make = glsl_compute if dialect == "glsl" else hlsl_compute
    return device_of(dialect).context.compute_shader(make(text, body, reads, halves))


def glsl_compute(text, body, reads, halves):
    """A compute shader around exported GLSL."""
    samplers = "".join(f"uniform sampler2D t{k};\n" for k in range(reads))
    outs = "".join(
        f"layout(rgba{16 if each else 32}f, binding = {k}) writeonly uniform image2D out{k};\n"
        for k, each in enumerate(halves)
    )
    return (
        f"#version 450\nlayout(local_size_x = {GROUP}, local_size_y = {GROUP}) in;\n{text}\n"
        f"{samplers}{outs}uniform ivec2 size;\nuniform float mm;\nvoid main() {{\n"
        f"uvec2 group = gl_WorkGroupID.xy, thread = gl_LocalInvocationID.xy; {body} }}"
    )


def hlsl_source_compute(text, body, reads, writes):
    """A compute shader around exported HLSL."""
    textures = "".join(f"Texture2D<float4> t{k};\n" for k in range(reads))
    outs = "".join(f"RWTexture2D<float4> out{k};\n" for k in range(writes))
    return (
        f"{text}\n{textures}{outs}SamplerState bilinear;\nuniform int2 size;\nuniform float mm;\n"
        f"[numthreads({GROUP}, {GROUP}, 1)]\nvoid main(uint3 g : SV_GroupID, uint3 t : "
        f"SV_GroupThreadID) {{ uint2 group = g.xy, thread = t.xy; {body} }}"
    )


def hlsl_compute(text, body, reads, halves):
    """The GLSL that spirv-cross makes of exported HLSL, which spirv-val accepts; for 32 bits."""
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder) / "shader.comp", Path(folder) / "shader.spv"
        source.write_text(hlsl_source_compute(text, body, reads, len(halves)), encoding="utf-8")
        flags = ["-D", "-e", "main", "-V", "-S", "comp", "--auto-map-bindings"]
        command = ["glslangValidator", *flags, "-o", binary, source]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{done.stdout}\n{source.read_text()}"
        subprocess.run(["spirv-val", "--target-env", "vulkan1.1", binary], check=True)
        command = ["spirv-cross", binary, "--version", "450", "--glsl-emit-ubo-as-plain-uniforms"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class _Vulkan:
    def __init__(self, own):
        self.own, self.gpu = own, own.device

    def target(self, size, half):
        assert not half
        use = self.own.wgpu.TextureUsage
        return self.gpu.create_texture(
            size=(*size, 1),
            format="rgba32float",
            usage=use.TEXTURE_BINDING | use.STORAGE_BINDING | use.COPY_SRC,
        )

    def dispatch(self, text, body, ends, halves, numbers):
        layout, pipeline = pipeline_of(text, body, len(ends) - len(halves), len(halves))
        view = self.gpu.create_buffer_with_data(
            data=struct.pack("iiff", *numbers, 0.0), usage=self.own.wgpu.BufferUsage.UNIFORM
        )
        own = [{"buffer": view, "offset": 0, "size": 16}, self.own.sampler]
        own += [each.create_view() for each in ends]
        group = self.gpu.create_bind_group(
            layout=layout, entries=[{"binding": k, "resource": each} for k, each in enumerate(own)]
        )

        def run(groups):
            encoder = self.gpu.create_command_encoder()
            worked = encoder.begin_compute_pass()
            worked.set_pipeline(pipeline)
            worked.set_bind_group(0, group)
            worked.dispatch_workgroups(*groups)
            worked.end()
            self.gpu.queue.submit([encoder.finish()])

        return run


@functools.cache
def pipeline_of(text, body, reads, writes):
    """The layout of a program's resources, and the program, of WebGPU."""
    device = device_of("wgsl")
    gpu, stage = device.device, {"visibility": device.wgpu.ShaderStage.COMPUTE}
    kinds = [{"buffer": {"type": "uniform"}}, {"sampler": {"type": "filtering"}}]
    kinds += [{"texture": {"sample_type": "float"}}] * reads
    store = {"access": "write-only", "format": "rgba32float"}
    kinds += [{"storage_texture": store}] * writes
    layout = gpu.create_bind_group_layout(
        entries=[{"binding": k, **stage, **each} for k, each in enumerate(kinds)]
    )
    module = gpu.create_shader_module(code=wgsl_compute(text, body, reads, writes))
    pipeline = gpu.create_compute_pipeline(
        layout=gpu.create_pipeline_layout(bind_group_layouts=[layout]),
        compute={"module": module, "entry_point": "main"},
    )
    return layout, pipeline


def wgsl_compute(text, body, reads, writes):
    """A compute shader around exported WGSL."""
    names = [f"var t{k}: texture_2d<f32>" for k in range(reads)]
    names += [f"var out{k}: texture_storage_2d<rgba32float, write>" for k in range(writes)]
    bound = "".join(f"@group(0) @binding({2 + k}) {each};\n" for k, each in enumerate(names))
    return f"""{text}
struct View {{ size: vec2i, mm: f32 }}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var bilinear: sampler;
{bound}@compute @workgroup_size({GROUP}, {GROUP}) fn main(
    @builtin(workgroup_id) g: vec3u, @builtin(local_invocation_id) t: vec3u) {{
    let group = g.xy; let thread = t.xy; let size = view.size; let mm = view.mm; {body}
}}"""
