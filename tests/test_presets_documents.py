"""Documents of presets, read by the programs and the schemas that they are for."""

import json
import re
import shutil
import subprocess

import jsonschema
import numpy as np
import pytest
from shader_runs import needs

from sssfit.export.presets import preset_of, preset_text
from sssfit.material import load_material
from sssfit.optics import normal_reflectance
from sssfit.simulate import simulate_exact

# The properties of the Khronos extensions' schemas, in words of JSON Schema.
_SHARE = {"type": "number", "minimum": 0.0, "maximum": 1.0}
_COLOUR = {"type": "array", "items": _SHARE, "minItems": 3, "maxItems": 3}
EXTENSIONS = {
    "KHR_materials_ior": {"ior": {"type": "number", "minimum": 1.0}},
    "KHR_materials_volume": {
        "thicknessFactor": {"type": "number", "minimum": 0.0},
        "attenuationDistance": {"type": "number", "exclusiveMinimum": 0.0},
        "attenuationColor": _COLOUR,
    },
    "KHR_materials_diffuse_transmission": {
        "diffuseTransmissionFactor": _SHARE,
        "diffuseTransmissionColorFactor": _COLOUR,
    },
    "KHR_materials_volume_scatter": {
        "multiscatterColor": _COLOUR,
        "scatterAnisotropy": {"type": "number", "minimum": -1.0, "maximum": 1.0},
    },
}


def of_object(properties, *required):
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    }


SCHEMA = of_object(
    {
        "asset": of_object(
            {"version": {"const": "2.0"}, "generator": {"type": "string"}}, "version"
        ),
        "extensionsUsed": {
            "type": "array",
            "items": {"enum": list(EXTENSIONS)},
            "uniqueItems": True,
            "minItems": len(EXTENSIONS),
        },
        "materials": {
            "type": "array",
            "minItems": 1,
            "items": of_object(
                {
                    "name": {"type": "string"},
                    "pbrMetallicRoughness": of_object(
                        {"metallicFactor": _SHARE, "roughnessFactor": _SHARE}
                    ),
                    "extensions": of_object(
                        {name: of_object(each) for name, each in EXTENSIONS.items()}, *EXTENSIONS
                    ),
                }
            ),
        },
    },
    "asset",
    "materials",
)


@pytest.fixture(scope="module")
def skin1():
    return simulate_exact(load_material("skin1"))


@pytest.mark.parametrize("name", ["skin1", "ketchup", "wholemilk"])
def test_gltf_fits_the_schemas_of_its_extensions(name):
    document = json.loads(preset_text(preset_of("gltf", load_material(name))))
    jsonschema.validate(document, SCHEMA)
    (material,) = document["materials"]
    assert material["name"] == name


@pytest.mark.parametrize("name", ["openpbr", "materialx"])
def test_materialx_reads_and_validates_the_document(skin1, name):
    mx = pytest.importorskip("MaterialX")
    found = preset_of(name, skin1)
    document = mx.createDocument()
    mx.readFromXmlString(document, preset_text(found))
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    document.setDataLibrary(library)
    is_valid, said = document.validate()
    assert is_valid, said
    (shader,) = [each for each in document.getNodes() if each.getType() == "surfaceshader"]
    definition = shader.getNodeDef()
    assert definition is not None
    for each in shader.getInputs():
        known = definition.getActiveInput(each.getName())
        assert known is not None, each.getName()
        assert known.getType() == each.getType(), each.getName()
        value = each.getValue()
        if each.getName() == "subsurface_color":
            written = [value[k] for k in range(3)]
            np.testing.assert_allclose(written, found["subsurface_color"], rtol=1e-6)


PARAMETER = re.compile(r'"(string|rgb|float) (\w+)" \[ (?:"([^"]*)"|([-\d.e+ ]+)) \]')


def test_pbrts_directives_are_those_of_its_file_format(skin1):
    """MakeNamedMedium, MediumInterface and Material with typed lists, as it documents them."""
    found = preset_of("pbrt", skin1, scale=1000.0)
    code = [line.split("#")[0] for line in preset_text(found).splitlines()]
    words = [line.strip() for line in code if line.strip()]
    directives = [each.split()[0] for each in words if not each.startswith('"')]
    assert directives == [
        "MakeNamedMedium",
        "AttributeBegin",
        "MediumInterface",
        "Material",
        "AttributeEnd",
    ]
    values = {}
    for kind, name, word, numbers in PARAMETER.findall("\n".join(words)):
        values[name] = word if kind == "string" else [float(each) for each in numbers.split()]
        assert len(values[name]) == (3 if kind == "rgb" else len(values[name]))
    assert values["type"] == "homogeneous"
    layer = skin1.material.layers[0]
    np.testing.assert_allclose(values["sigma_a"], layer.sigma_a_per_mm, rtol=1e-8)
    np.testing.assert_allclose(values["sigma_s"], layer.sigma_s_per_mm, rtol=1e-8)
    assert (values["scale"], values["g"], values["eta"]) == ([1000.0], [0.0], [1.3])


# What makes a whole program of a preset's text, for a compiler: its front and its end.
PROGRAMS = {
    "godot": (
        "#version 450\n#define USE_25_SAMPLES\n",
        "layout(location = 0) out vec4 found;\n"
        "void main() { found = skin_kernel[kernel_size - 1] + kernel[1].xyxy; }\n",
        ["-S", "frag"],
    ),
    "iryoku": (
        "",
        "float4 main() : SV_Target { return kernel[SSSS_N_SAMPLES - 1] * sssWidth; }\n",
        ["-D", "-e", "main", "-S", "frag", "-V"],
    ),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_compiler_takes_the_tables(skin1, tmp_path, name):
    needs("hlsl")
    front, end, flags = PROGRAMS[name]
    path = tmp_path / "table.frag"
    path.write_text(front + preset_text(preset_of(name, skin1)) + end, encoding="utf-8")
    command = ["glslangValidator", *flags, path.name]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout


def test_node_takes_the_script_for_babylon(skin1, tmp_path):
    if shutil.which("node") is None:
        pytest.skip("needs node")
    path = tmp_path / "profile.js"
    path.write_text(preset_text(preset_of("babylon", skin1)), encoding="utf-8")
    run = subprocess.run(["node", "--check", path], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr


# The scene of `test_mitsuba_draws_our_edge`, in mm: a camera looks down at a block of the medium,
# lit from all sides but where a black sheet, 0.02 mm above it, covers half of it: Mitsuba's rays
# start up to 5e-3 mm above a surface so far from the origin, and must not start above the sheet.
_BLOCK_MM, _DEEP_MM, _GAP_MM = 60.0, 60.0, 0.02


def scene_of(text, spp, columns, rows, field_mm):
    """Mitsuba's scene as XML around the preset's text."""
    medium, interface = "medium_skin1", "interface_skin1"
    shapes = f"""
  <integrator type="volpathmis"><integer name="max_depth" value="-1" />
    <integer name="rr_depth" value="200" /></integrator>
  <emitter type="constant"><rgb name="radiance" value="1" /></emitter>
  <shape type="cube">
    <transform name="to_world"><scale x="{_BLOCK_MM}" y="{_BLOCK_MM}" z="{_DEEP_MM}" />
      <translate z="{-_DEEP_MM}" /></transform>
    <ref id="{interface}" /><ref name="interior" id="{medium}" />
  </shape>
  <shape type="rectangle">
    <transform name="to_world"><scale x="{_BLOCK_MM}" y="{2 * _BLOCK_MM}" />
      <translate x="{-_BLOCK_MM}" z="{_GAP_MM}" /></transform>
    <bsdf type="twosided"><bsdf type="diffuse">
      <rgb name="reflectance" value="0" /></bsdf></bsdf>
  </shape>
  <sensor type="orthographic">
    <transform name="to_world"><scale x="{0.5 * field_mm}" y="{0.5 * field_mm}" />
      <lookat origin="{0.5 * field_mm},0,50" target="{0.5 * field_mm},0,0" up="0,1,0" />
    </transform>
    <sampler type="independent"><integer name="sample_count" value="{spp}" /></sampler>
    <film type="hdrfilm"><integer name="width" value="{columns}" />
      <integer name="height" value="{rows}" /><rfilter type="box" />
      <string name="pixel_format" value="rgb" /><string name="component_format" value="float32" />
    </film>
  </sensor>
</scene>
"""
    return text.replace("</scene>\n", shapes.lstrip("\n"))


@pytest.mark.slow
def test_mitsuba_draws_our_edge(skin1):
    """The light that comes back beside an edge of light, by Mitsuba's walk and by the profile.

    Seen along the normal under equal radiance from all directions, a surface shows the total of the
    profile by reciprocity; beside the shadow of a sheet, its integral over the lit half plane, plus
    the specular reflection.
    """
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    columns, field_mm, runs, fine = 24, 12.0, 6, 20
    text = scene_of(preset_text(preset_of("mitsuba", skin1)), 256, columns, columns, field_mm)
    scene = mi.load_string(text)
    rows = np.concatenate([np.array(mi.render(scene, seed=k), dtype=float) for k in range(runs)])
    found, stderr = rows.mean(axis=0), rows.std(axis=0, ddof=1) / np.sqrt(len(rows))
    if found[0].sum() > found[-1].sum():  # the camera's x may run to the left
        found, stderr = found[::-1], stderr[::-1]
    line = skin1.line_kernel(field_mm / columns / fine)
    step = np.cumsum(line, axis=0)[len(line) // 2 :]  # light from the left end to each right edge
    wanted = step[: columns * fine].reshape(columns, fine, 3).mean(axis=1)
    wanted = wanted + normal_reflectance(1.3)
    sigmas = (found - wanted) / stderr
    assert np.abs(sigmas).max() < 4.5
    assert abs(sigmas.mean()) < 4.5 / np.sqrt(columns)  # channels share their walks
    assert (stderr / wanted).max() < 0.02
