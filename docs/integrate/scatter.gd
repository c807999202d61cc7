@tool
extends CompositorEffect
@export_multiline var source: String  # an export in GLSL with --coverage
@export_multiline var body: String  # the GLSL below
@export var mm_per_pixel := 0.3
const LIGHT := "vec4 c = texelFetch(t0, at, 0); float m = float(c.a != 0.0); made = vec4(m * c.rgb, m);"
const ADD := "made = texelFetch(t0, at, 0); if (made.a == 0.0) return; made.a = imageLoad(result, at).a;"
const ROW := r"(?m)^// (SSS_\w+)(?:\((\d+)(?:, (x|y|[\d.]+ deg))?\))? +(.+?) {2,}(\w+) +1(?:/(\d+))? +\d+$"
const LIST := r"(?m)^// call .*\n((?:// .* \d+\n)*)"
const OTHER := r"uint (?:frame|profile)\b|vec2 mm_per_pixel|\bD0\b"
var rd: RenderingDevice
var sampler: RID
var pipelines := {}

func _init() -> void:
    effect_callback_type = EFFECT_CALLBACK_TYPE_POST_SKY
    needs_separate_specular = true
    access_resolved_color = true

func _render_callback(_type: int, data: RenderData) -> void:
    var rows := passes()
    if rows.is_empty(): return
    var buffers: RenderSceneBuffersRD = data.get_render_scene_buffers()
    if not rd:
        rd = RenderingServer.get_rendering_device()
        var state := RDSamplerState.new() # clamped by default
        state.min_filter = RenderingDevice.SAMPLER_FILTER_LINEAR
        state.mag_filter = RenderingDevice.SAMPLER_FILTER_LINEAR
        sampler = rd.sampler_create(state)
    var color := buffers.get_color_layer(0)
    var pictures := { "E": run(buffers, "E", LIGHT, [color], 1) }
    for row in rows:
        var name := row.get_string(1)
        var words := Array(row.get_string(4).split(" "))
        var reads := words.map(func(each): return pictures[each])
        words = range(reads.size()).map(func(k): return "t%d" % k) + ["position", "texel"]
        var angle := deg_to_rad({ "x": 0.0, "y": 90.0 }.get(row.get_string(3), row.get_string(3).to_float()))
        if row.get_string(3): words.push_front("vec2(%.9f, %.9f)" % [cos(angle), sin(angle)])
        if row.get_string(2): words.push_front(row.get_string(2) + "u")
        if RegEx.create_from_string("vec4 " + name + r"\([^)]*mm_per_pixel").search(source): words.append("mm_per_pixel")
        var call := "made = %s(%s);" % [name, ", ".join(words)]
        pictures[row.get_string(5)] = run(buffers, row.get_string(5), call, reads, maxi(1, row.get_string(6).to_int()))
    run(buffers, "add", ADD, [pictures["M0"]], 1, color)

func passes() -> Array[RegExMatch]: # none, and an error, where one of the list cannot be drawn
    var list := RegEx.create_from_string(LIST).search(source)
    var text := list.get_string(1) if list else ""
    var rows := RegEx.create_from_string(ROW).search_all(text)
    if text and rows.size() == text.count("\n") and not RegEx.create_from_string(OTHER).search(source): return rows
    push_error("scatter.gd cannot draw this export; docs/integrate.md says which it can.")
    return []

func run(buffers: RenderSceneBuffersRD, name: String, code: String, reads: Array, part: int, target := RID()) -> RID:
    var size := (buffers.get_internal_size() + Vector2i.ONE * (part - 1)) / part
    if not target.is_valid():
        var usage := RenderingDevice.TEXTURE_USAGE_SAMPLING_BIT | RenderingDevice.TEXTURE_USAGE_STORAGE_BIT
        target = buffers.create_texture("sss", name, RenderingDevice.DATA_FORMAT_R16G16B16A16_SFLOAT, usage,
                RenderingDevice.TEXTURE_SAMPLES_1, size, 1, 1, true, false)
    var types := [RenderingDevice.UNIFORM_TYPE_IMAGE, RenderingDevice.UNIFORM_TYPE_SAMPLER_WITH_TEXTURE]
    var uniforms: Array[RDUniform] = []
    var samplers := ""
    for k in reads.size() + 1:
        uniforms.append(RDUniform.new())
        uniforms[k].binding = k
        uniforms[k].uniform_type = types[mini(k, 1)]
        for id in ([sampler, reads[k - 1]] if k else [target]): uniforms[k].add_id(id)
        if k: samplers += "layout(set = 0, binding = %d) uniform sampler2D t%d;\n" % [k, k - 1]
    if not pipelines.has(name):
        var text := RDShaderSource.new()
        text.source_compute = "#version 450\n" + source + samplers + body.replace("#CODE", code)
        var shader := rd.shader_create_from_spirv(rd.shader_compile_spirv_from_source(text))
        pipelines[name] = [shader, rd.compute_pipeline_create(shader)]
    var list := rd.compute_list_begin()
    rd.compute_list_bind_compute_pipeline(list, pipelines[name][1])
    rd.compute_list_bind_uniform_set(list, UniformSetCacheRD.get_cache(pipelines[name][0], 0, uniforms), 0)
    rd.compute_list_set_push_constant(list, PackedFloat32Array([mm_per_pixel, 0, 0, 0]).to_byte_array(), 16)
    rd.compute_list_dispatch(list, (size.x + 7) / 8, (size.y + 7) / 8, 1)
    rd.compute_list_end()
    return target
