"""The code of docs/integrate.md, compiled around an export, and its list of passes against ours."""

import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from shader_runs import device_of, needs, spirv_of
from test_docs import STRUCTURE, code_blocks
from test_shaders import PITCH, apart, disk_of, light_of, of_two_materials, rendered
from test_taps import taps_of
from test_turned import turned

from sssfit.export import DIALECTS, Style, source
from sssfit.export.passes import pass_list

PAGE = "integrate.md"
FILES = (
    Path(__file__).parents[1] / "docs" / "integrate"
)  # the scripts of which the page shows parts
MASKED = Style(features=("COVERAGE",))
ENTRY = re.compile(r"^float4 (\w+)\(float4 at : SV_Position\)", re.MULTILINE)
ENTRIES = ["Blur", "Halve", "Sum3", "Sum2", "Sum1", "Sum0", "Light", "Add"]
# What the includes of HDRP's custom passes stand for, without stereo.
UNITY = """
#define TEXTURE2D_X(name) Texture2DArray<float4> name
#define LOAD_TEXTURE2D_X(name, place) name.Load(int4(int2(place), 0, 0))
"""
PASSES, OWN, COMPUTE, *OTHERS = code_blocks("hlsl", PAGE)
HLSL = dict(zip(("own", "unity", "unreal"), (OWN, *OTHERS), strict=True))
GODOT, *ES = code_blocks("glsl", PAGE)
PLAIN = Style()
# What the scripts draw, and what they have to refuse.
SERVED = {
    "cascade": taps_of(STRUCTURE, channels=3),
    "stars": taps_of("*|1-*|1", channels=3),
    "lines": turned("2-2-2", ["@0", "@60", "@120"], channels=3),
    "turned": turned("1-1|1-2", ["@45", "@135", "x30", ""], channels=3),
    "term": taps_of("6", channels=3, chained=False),
}
_CASCADE, _TERMS = [SERVED["cascade"]], [taps_of("2-1", channels=3, chained=False)]
REFUSED = {
    "terms": (_TERMS, PLAIN),
    "disk": ([disk_of(9)], PLAIN),
    "two tables": (of_two_materials(), PLAIN),
    "depth of a term": ([SERVED["term"]], Style(features=("DEPTH",))),
    "tilt": (_CASCADE, Style(tilted=True)),
    "compute": (_CASCADE, Style(compute=True)),
    "prefix": (_CASCADE, Style(prefix="SKIN")),
    "no passes": (_CASCADE, Style(with_passes=False)),
    **{each: (_CASCADE, Style(features=(each,))) for each in ("JITTER", "DEPTH")},
}
LANGUAGES = {"ScatterPass.cs": "csharp", "scatter.gd": "gdscript", "scatter.glsl": "glsl"}
LANGUAGES |= dict.fromkeys(("passes.js", "three-scattering.js", "babylon-scattering.js"), "js")


def script(name):
    """A file beside the page."""
    return (FILES / name).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def taps():
    return taps_of(STRUCTURE, channels=3)


@pytest.fixture(scope="module")
def glsl(taps):
    return source([taps], DIALECTS["glsl"], MASKED)


def accepted(text, stage, folder, *flags):
    """Let glslang check a shader of a stage."""
    all_accepted([text], stage, folder, *flags)


def all_accepted(texts, stage, folder, *flags):
    """Let glslang, which takes .1 s to start, check some shaders of a stage, each by itself."""
    needs("hlsl")
    paths = [Path(folder) / f"shader{k}.{stage}" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["glslangValidator", *flags, "-S", stage, *paths],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, "\n".join([done.stdout, *texts])


@pytest.mark.parametrize("engine", HLSL)
@pytest.mark.parametrize("entry", ENTRIES)
def test_hlsl_compiles_around_an_export(taps, engine, entry, tmp_path):
    needs("hlsl")
    code = PASSES + HLSL[engine]
    assert ENTRY.findall(code) == ENTRIES
    export = source([taps], DIALECTS["hlsl"], MASKED)
    before = UNITY if engine == "unity" else ""
    # The compiler is asked for an entry point of this name.
    spirv_of(f"#define {entry} main\n{export}\n{before}\n{code}", tmp_path)


@pytest.mark.parametrize("entry", ["Level0", "Add"])
def test_levels_compile_around_an_export(taps, entry, tmp_path):
    text = source([taps], DIALECTS["hlsl"], Style(compute=True))
    assert re.search(r"^// SSS_Level0 .* 16 +\d+$", text, re.MULTILINE)  # the page has this tile
    code = f"#define {entry} main\n{text}\n{COMPUTE}"
    accepted(code, "comp", tmp_path, "-D", "-V", "-e", "main", "--auto-map-bindings")


def test_compute_shaders_compile_around_an_export(taps, glsl, tmp_path):
    own = script("scatter.gd")
    calls = {"light": (script_text(own, "LIGHT"), 1), "add": (script_text(own, "ADD"), 1)}
    for each in listed(taps):
        axis = {"x": "vec2(1.0, 0.0)", "y": "vec2(0.0, 1.0)"}.get(each["axis"])
        words = [f"{each['stage']}u", axis] if axis else []
        words += [f"t{k}" for k in range(len(each["reads"]))] + ["position", "texel"]
        words += ["mm_per_pixel"] if each["name"] in ("SSS_Blur", "SSS_Sum3") else []
        calls[each["writes"]] = f"made = {each['name']}({', '.join(words)});", len(each["reads"])
    for code, pictures in calls.values():
        samplers = "".join(
            f"layout(set = 0, binding = {k + 1}) uniform sampler2D t{k};\n" for k in range(pictures)
        )
        text = f"#version 450\n{glsl}{samplers}{GODOT.replace('#CODE', code)}"
        accepted(text, "comp", tmp_path, "-V")


def script_text(own, name):
    """A constant text of the GDScript."""
    return re.search(rf'^const {name} := "(.*)"$', own, re.MULTILINE)[1]


@pytest.mark.parametrize("text", ES)
def test_webgl_shaders_compile(text, tmp_path):
    accepted(text, "frag", tmp_path)


def axis_of(axis):
    """A direction as the list of passes has it."""
    degrees = math.degrees(math.atan2(axis[1], axis[0]))
    return {(1.0, 0.0): "x", (0.0, 1.0): "y"}.get(axis, f"{degrees:.4g} deg")


def listed(taps):
    """Our list of passes, as the scripts of the page read it from the comment."""
    return [
        {
            "name": f"SSS_{each.name}",
            "stage": str(each.stages[0]) if each.name in ("Blur", "Star") else None,
            "axis": axis_of(each.axis) if each.name == "Blur" else None,
            "reads": list(dict.fromkeys((each.reads, *(name for name, _ in each.adds)))),
            "writes": each.writes[0],
            "size": 2**each.level,
        }
        for each in pass_list(taps, normalized=True)
    ]


def read_by_expressions(name, text):
    """The list of passes as a script's own regular expressions find it; None if it refuses it."""
    own = script(name)
    found = re.findall(r'[Rr](?:ow|OW)\b[^"]*"(?:\(\?m\))?(\^//[^"]+)"', own)
    found += re.findall(r'(?:List|LIST)\b[^"]*"(?:\(\?m\))?(\^//[^"]+)"', own)
    found += re.findall(r'(?:Other|OTHER)\b[^"]*"(uint[^"]+)"', own)
    row, rows, other = found
    passes = re.search(rows, text, re.MULTILINE)
    passes = passes[1] if passes else ""
    keys = ("name", "stage", "axis", "reads", "writes", "size")
    made = [
        dict(zip(keys, each.groups(), strict=True))
        | {"reads": each[4].split(" "), "size": int(each[6] or 1)}
        for each in re.finditer(row, passes, re.MULTILINE)
    ]
    refused = not made or len(made) != passes.count("\n") or re.search(other, text)
    return None if refused else made


@pytest.mark.parametrize("name", ["ScatterPass.cs", "scatter.gd"])
@pytest.mark.parametrize("served", SERVED)
def test_regular_expressions_find_every_pass(served, name):
    dialect = DIALECTS["hlsl" if name.endswith(".cs") else "glsl"]
    text = source([SERVED[served]], dialect, PLAIN)
    assert read_by_expressions(name, text) == listed(SERVED[served])


@pytest.mark.parametrize("name", ["ScatterPass.cs", "scatter.gd"])
@pytest.mark.parametrize("refused", REFUSED)
def test_regular_expressions_refuse_what_cannot_be_drawn(refused, name):
    tables, style = REFUSED[refused]
    text = source(tables, DIALECTS["hlsl" if name.endswith(".cs") else "glsl"], style)
    assert read_by_expressions(name, text) is None


def node():
    """Node.js, or no test."""
    program = shutil.which("node")
    if program is None:
        pytest.skip("needs node, which nothing else here does")
    return program


def made_by_javascript(text, folder):
    """The passes of exported GLSL, and their fragment shaders, as the page's script makes them."""
    (folder / "passes.mjs").write_text(script("passes.js"), encoding="utf-8")
    (folder / "export.glsl").write_text(text, encoding="utf-8")
    (folder / "run.mjs").write_text(
        "import { readFileSync } from 'node:fs';\n"
        "import { passesOf, fragmentOf } from './passes.mjs';\n"
        "const source = readFileSync('export.glsl', 'utf8');\n"
        "const passes = passesOf(source);\n"
        "const fragments = passes.map((pass) => fragmentOf(source, pass));\n"
        "console.log(JSON.stringify({ passes, fragments }));\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [node(), "run.mjs"], cwd=folder, capture_output=True, text=True, check=True
    )
    found = json.loads(done.stdout)
    return found["passes"], [f"#version 300 es\n{each}" for each in found["fragments"]]


@pytest.mark.parametrize("served", SERVED)
def test_javascript_makes_a_shader_for_every_pass(served, tmp_path):
    taps = SERVED[served]
    passes, fragments = made_by_javascript(source([taps], DIALECTS["glsl"], PLAIN), tmp_path)
    assert [{"stage": None, "axis": None, **each} for each in passes] == listed(taps)
    assert len(fragments) == len(passes)
    all_accepted(fragments, "frag", tmp_path)


@pytest.mark.parametrize("refused", REFUSED)
def test_javascript_ends_with_one_line_at_what_it_cannot_draw(refused, tmp_path):
    tables, style = REFUSED[refused]
    with pytest.raises(subprocess.CalledProcessError) as ended:
        made_by_javascript(source(tables, DIALECTS["glsl"], style), tmp_path)
    (line,) = [each for each in ended.value.stderr.splitlines() if each.startswith("Error: ")]
    assert line.startswith("Error: This script cannot draw an export with ")


@pytest.mark.parametrize("served", SERVED)
def test_shaders_made_by_javascript_show_what_the_renderer_shows(served, tmp_path):
    needs("glsl")
    taps = SERVED[served]
    style = Style(normalized=False, features=("COVERAGE",))
    passes, fragments = made_by_javascript(source([taps], DIALECTS["glsl"], style), tmp_path)
    size = 37, 50
    rows, columns = np.mgrid[: size[0], : size[1]]
    mask = np.hypot(rows - 18, columns - 25) < 15
    light = light_of(size, 3)
    device = device_of("glsl")
    covered = np.concatenate([light * mask[..., None], mask[..., None]], axis=-1)
    pictures = {"E": device.picture(covered, half=False)}
    for each, fragment in zip(passes, fragments, strict=True):
        shape = *(-(-side // each["size"]) for side in size), 4
        target = device.picture(np.zeros(shape), half=False)
        draw(device.context, fragment, [pictures[name] for name in each["reads"]], target)
        pictures[each["writes"]] = target
    found = device.pixels(pictures["M0"])[..., :3]
    assert apart(found, rendered(light, taps, coverage=mask.astype(float)) * mask[..., None]) < 1e-5


def draw(context, fragment, reads, target):
    """Draw a pass as the page's WebGL code does."""
    vertex = "#version 300 es\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }"
    program = context.program(vertex, fragment)
    corners = context.buffer(np.array([-1, -1, 3, -1, -1, 3], np.float32).tobytes())
    for k, each in enumerate(reads):
        each.use(k)
        program[f"t{k}"].value = k
    for name, value in (("texel", tuple(1 / s for s in reads[0].size)), ("mm_per_pixel", PITCH)):
        if name in program:
            program[name].value = value
    context.framebuffer(color_attachments=[target]).use()
    context.simple_vertex_array(program, corners, "at").render(vertices=3)


@pytest.mark.parametrize("name", ["three-scattering.js", "babylon-scattering.js"])
def test_javascript_of_the_engines_is_well_formed(name, tmp_path):
    (tmp_path / "engine.mjs").write_text(script(name), encoding="utf-8")
    subprocess.run([node(), "--check", "engine.mjs"], cwd=tmp_path, check=True)


def test_a_section_fits_a_screen_and_names_what_was_read():
    text = (FILES.parent / PAGE).read_text(encoding="utf-8")
    read = text.split("## Where the names were read", 1)[1]
    for engine in ("Unity", "Unreal", "Godot", "three.js", "Babylon.js"):
        assert f"- {engine}: " in read
    for section in re.split(r"^##+ ", text, flags=re.MULTILINE)[1:]:
        assert len(section.splitlines()) <= 55, section.splitlines()[0]


@pytest.mark.parametrize(("name", "language"), LANGUAGES.items())
def test_the_page_shows_parts_of_the_files_that_it_links(name, language):
    text = (FILES.parent / PAGE).read_text(encoding="utf-8")
    assert f"](integrate/{name})" in text
    shown = [each for each in code_blocks(language, PAGE) if each in script(name)]
    assert shown, name
    if language in ("csharp", "gdscript"):
        assert len(shown) == len(code_blocks(language, PAGE))


def test_every_part_of_javascript_is_in_a_file():
    whole = "".join(script(name) for name, language in LANGUAGES.items() if language == "js")
    for each in code_blocks("js", PAGE):
        assert each in whole
