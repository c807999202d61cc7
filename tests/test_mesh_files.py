"""Meshes from files of other programs: texture coordinates, seams, normals, and what is refused."""

import json
import struct

import numpy as np
import pytest

from sssfit.errors import FileError, RenderError
from sssfit.scene.mesh_files import load_mesh

# A square of two triangles, 2 wide; its texture takes the middle of the tile.
POINTS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype="<f4")
UV = np.array([[0.25, 0.25], [0.75, 0.25], [0.75, 0.5], [0.25, 0.5]], dtype="<f4")
FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype="<u4")
TILTED = np.array([[0.6, 0, 0.8], [0, 0.6, 0.8], [-0.6, 0, 0.8], [0, -0.6, 0.8]], dtype="<f4")


def obj(uv=True, normals=False, extra=""):
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS]
    lines += [f"vt {u} {v}" for u, v in UV] if uv else []
    lines += [f"vn {2 * x} {2 * y} {2 * z}" for x, y, z in TILTED] if normals else []
    form = "{0}" + ("/{0}" if uv else "/" if normals else "") + ("/{0}" if normals else "")
    lines += ["f " + " ".join(form.format(k + 1) for k in face) for face in FACES]
    return ("\n".join([*lines, extra]) + "\n").encode()


def ply(normals=False):
    names = ("x", "y", "z", "s", "t", *(("nx", "ny", "nz") if normals else ()))
    head = ["ply", "format ascii 1.0", f"element vertex {len(POINTS)}"]
    head += [f"property float {each}" for each in names]
    head += [f"element face {len(FACES)}", "property list uchar int vertex_indices", "end_header"]
    columns = np.hstack((POINTS, UV, *((TILTED,) if normals else ())))
    rows = [" ".join(map(str, each)) for each in columns.tolist()]
    rows += ["3 " + " ".join(map(str, each)) for each in FACES.tolist()]
    return ("\n".join([*head, *rows]) + "\n").encode()


def glb(material=True, normals=(False,)):
    """glTF has v downwards; each further mesh lies 5 above the last, a quarter turn about x."""
    parts = [POINTS.tobytes(), np.stack((UV[:, 0], 1 - UV[:, 1]), 1).tobytes(), FACES.tobytes()]
    parts += [TILTED.tobytes()]
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": list(range(len(normals)))}],
        "scene": 0,
        "nodes": [
            {
                "mesh": k,
                "translation": [0, 5 * k, 0],
                "rotation": [k * 0.5**0.5, 0, 0, 0.5 ** (k / 2)],
            }
            for k in range(len(normals))
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {
                            "POSITION": 0,
                            "TEXCOORD_0": 1,
                            **({"NORMAL": 3} if has_normals else {}),
                        },
                        "indices": 2,
                        **({"material": 0} if material else {}),
                    }
                ]
            }
            for has_normals in normals
        ],
        "materials": [{"name": "skin"}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 4,
                "type": "VEC3",
                "min": POINTS.min(0).tolist(),
                "max": POINTS.max(0).tolist(),
            },
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5125, "count": 6, "type": "SCALAR"},
            {"bufferView": 3, "componentType": 5126, "count": 4, "type": "VEC3"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": ends[k], "byteLength": len(parts[k])} for k in range(4)
        ],
        "buffers": [{"byteLength": ends[-1]}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data = b"".join(parts)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


@pytest.mark.parametrize("has_normals", [False, True])
@pytest.mark.parametrize("ending", ["obj", "ply", "glb"])
def test_files_give_the_same_square(tmp_path, ending, has_normals):
    """Normals are the file's where it has some, of length 1."""
    content = {
        "obj": obj(normals=has_normals),
        "ply": ply(normals=has_normals),
        "glb": glb(normals=(has_normals,)),
    }
    path = tmp_path / f"square.{ending}"
    path.write_bytes(content[ending])
    mesh = load_mesh(path, mm_per_unit=10.0)
    assert mesh.name == path.stem
    corners = mesh.faces.ravel()
    np.testing.assert_allclose(mesh.positions_mm[corners], 10.0 * POINTS[FACES.ravel()])
    np.testing.assert_allclose(mesh.uv[corners], UV[FACES.ravel()], atol=1e-7)
    normals = TILTED if has_normals else np.array([[0.0, 0.0, 1.0]] * 4)
    np.testing.assert_allclose(mesh.normals[corners], normals[FACES.ravel()], atol=1e-7)
    np.testing.assert_allclose(mesh.stretch_mm(), [[40.0, 80.0]] * 2)


@pytest.mark.parametrize("first", [False, True])
def test_of_several_meshes_those_with_normals_keep_them(tmp_path, first):
    """They turn with their mesh: a quarter turn about x takes y to z and z to -y."""
    path = tmp_path / "two.glb"
    path.write_bytes(glb(normals=(first, True)))
    mesh = load_mesh(path)
    assert len(mesh.faces) == 4
    x, y, z = TILTED.T
    second = mesh.normals[np.abs(mesh.positions_mm[:, 1] - 5.0) < 1e-6]
    np.testing.assert_allclose(second, np.stack((x, -z, y), axis=1), atol=1e-7)
    normals = TILTED if first else [[0.0, 0.0, 1.0]] * 4
    is_first = np.abs(mesh.positions_mm[:, 1]) < 1.5
    np.testing.assert_allclose(mesh.normals[is_first], normals, atol=1e-7)


def test_objects_of_a_file_are_one_mesh_and_vertices_on_a_seam_are_apart(tmp_path):
    """Texture coordinates of a place differ by chart; normals do not."""
    path = tmp_path / "two.obj"
    lines = ["o one", "v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "v 2 0 1", "v 2 1 1"]
    lines += ["vt 0 0", "vt .4 0", "vt .4 1", "vt 0 1", "vt .6 0", "vt 1 0", "vt 1 1", "vt .6 1"]
    lines += ["f 1/1 2/2 3/3 4/4", "o two", "f 2/5 5/6 6/7 3/8"]
    path.write_text("\n".join(lines) + "\n")
    mesh = load_mesh(path)
    assert len(mesh.faces) == 4
    on_seam = (mesh.positions_mm == [1.0, 0.0, 0.0]).all(axis=1)
    assert sorted(np.unique(mesh.uv[on_seam, 0]).round(6)) == [0.4, 0.6]
    assert np.ptp(mesh.normals[on_seam], axis=0).max() < 1e-12


@pytest.mark.parametrize(("shift", "tiles"), [(0.4, 1), (0.0, 2)])
def test_materials_keep_their_texture_coordinates_or_take_a_tile_each(tmp_path, shift, tiles):
    """They overlap where each has a texture of its own; trimesh packs them into a few texels."""
    (tmp_path / "two.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 1 0\n")
    extra = [f"v {x} {y} 5" for x, y, _ in POINTS] + [f"vt {u} {v + shift}" for u, v in UV]
    extra += ["usemtl b", "f 5/5 6/6 7/7", "f 5/5 7/7 8/8"]
    path = tmp_path / "two.obj"
    path.write_bytes(b"mtllib two.mtl\nusemtl a\n" + obj(extra="\n".join(extra)))
    mesh = load_mesh(path)
    is_second = mesh.positions_mm[:, 2] > 1.0
    for which, moved in ((~is_second, 0.0), (is_second, shift)):
        columns, rows = (mesh.uv[which] * tiles).T
        assert sorted((columns % 1.0).round(6)) == [0.25, 0.25, 0.75, 0.75]
        expected = sorted([0.25 + moved, 0.25 + moved, 0.5 + moved, 0.5 + moved])
        np.testing.assert_allclose(sorted(rows % 1.0), expected)
    corners = {tuple(each) for each in mesh.uv.round(6)}
    assert len(corners) == 8  # no texel is both's


@pytest.mark.parametrize(
    ("name", "content", "error", "said"),
    [
        ("a.obj", obj(uv=False), RenderError, "no texture coordinates"),
        ("b.obj", b"# nothing\n", (FileError, RenderError), "b.obj"),
        ("c.obj", obj(extra="v nan 0 0\nvt 0 0\nf 1/1 2/2 5/5"), RenderError, "NaN"),
        ("a.glb", glb(material=False), RenderError, "only where the mesh has a material"),
        ("d.glb", b"glTF" + bytes(3), FileError, "not a mesh that can be read"),
        ("e.ply", b"ply\nformat ascii 1.0\nend_header\n", (FileError, RenderError), "e.ply"),
        ("f.fbx", b"", FileError, ".obj, .ply, .gltf, .glb"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_line(tmp_path, name, content, error, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(error) as caught:
        load_mesh(path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_are_not_there_and_units_without_length_are_refused(tmp_path):
    with pytest.raises(FileError, match=r"missing\.obj"):
        load_mesh(tmp_path / "missing.obj")
    with pytest.raises(RenderError, match="mm_per_unit = 0"):
        load_mesh(tmp_path / "missing.obj", mm_per_unit=0.0)
