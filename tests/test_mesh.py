"""Meshes: what is wrong with people's files is said in one line; areas, normals and stretch."""

import dataclasses

import numpy as np
import pytest
from meshes import cube, quad, sphere

from sssfit.errors import RenderError, SssfitWarning
from sssfit.render.drawn import draw_texture
from sssfit.scene.head_mesh import HEIGHT_MM, head_mesh
from sssfit.scene.mesh import Mesh


def given(**changes):
    usual = {
        "name": "x",
        "positions_mm": np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        "uv": np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        "faces": np.array([[0, 1, 2]]),
    }
    return usual | changes


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"positions_mm": np.full((3, 3), np.nan)}, "NaN or infinite at 3 of 3 vertices"),
        ({"positions_mm": np.zeros((3, 2))}, "shape (3, 2)"),
        ({"positions_mm": np.zeros((3, 3))}, "no triangle has an area"),
        ({"uv": None}, "no texture coordinates"),
        ({"uv": np.zeros((2, 2))}, "uv has 2 rows"),
        ({"uv": np.full((3, 2), 1.5)}, "reaches from 1.5 to 1.5"),
        ({"faces": np.array([[0, 1, 3]])}, "vertices 0 to 3"),
        ({"faces": np.zeros((0, 3), int)}, "at least one triangle"),
        ({"faces": np.array([[0.0, 1.0, 2.0]])}, "whole numbers"),
        ({"faces": np.array([[0, 1, 2, 2]])}, "shape (1, 4)"),
        ({"normals": np.zeros((3, 3))}, "3 normals are 0"),
        ({"normals": np.full((3, 3), np.inf)}, "NaN or infinite"),
    ],
)
def test_what_is_wrong_with_a_mesh_is_said_in_one_line(changes, said):
    with pytest.raises(RenderError) as caught:
        Mesh(**given(**changes))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_triangles_without_an_area_are_left_out_with_a_warning():
    with pytest.warns(SssfitWarning, match="1 triangle without an area left out"):
        mesh = Mesh(**given(faces=np.array([[0, 1, 2], [0, 1, 1]])))
    assert len(mesh.faces) == 1


def test_a_mesh_cannot_be_changed():
    mesh = quad()
    with pytest.raises(ValueError, match="read-only"):
        mesh.positions_mm[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        mesh.name = "other"


def test_a_quad_has_its_sides_as_stretch_and_looks_along_z():
    mesh = quad(70.0, pieces=3)
    np.testing.assert_allclose(mesh.stretch_mm(), 70.0)
    np.testing.assert_allclose(mesh.normals, np.broadcast_to([0.0, 0.0, 1.0], (16, 3)))
    assert mesh.area_mm2.sum() == pytest.approx(70.0**2)


def test_normals_are_smooth_over_a_spheres_seam():
    mesh = sphere(rows=40, columns=80)
    used = np.unique(mesh.faces)
    cosine = np.einsum("nk,nk->n", mesh.normals[used], mesh.positions_mm[used] / 50.0)
    assert cosine.min() > np.cos(np.radians(180.0 / 40))  # a step of latitude
    across = [np.linalg.norm(mesh.positions_mm - p, axis=1) < 1e-9 for p in mesh.positions_mm[used]]
    for same in across[100:140]:
        np.testing.assert_allclose(np.ptp(mesh.normals[same], axis=0), 0.0, atol=1e-12)


def test_a_spheres_stretch_is_that_of_its_latitude():
    """2 pi r cos(latitude) along u over .98 of the texture, pi r along v."""
    mesh = sphere(50.0, rows=96, columns=192)
    height = mesh.positions_mm[mesh.faces].mean(axis=1)[:, 1]
    ring = 2.0 * np.pi * np.sqrt(50.0**2 - height**2) / 0.98
    here = np.abs(height) < 40.0
    found = mesh.stretch_mm()[here]
    np.testing.assert_allclose(found[:, 0], ring[here], rtol=0.03)
    np.testing.assert_allclose(found[:, 1], np.pi * 50.0, rtol=0.03)


@pytest.fixture(scope="module")
def head():
    return head_mesh()


def test_the_head_is_closed_and_looks_outward(head):
    """Each edge, by places, is there once in each direction."""
    assert 20_000 < len(head.faces) < 30_000
    places = np.unique(np.round(head.positions_mm, 6), axis=0, return_inverse=True)[1].ravel()
    edges = np.concatenate([places[head.faces[:, [k, (k + 1) % 3]]] for k in range(3)])
    edges = edges[edges[:, 0] != edges[:, 1]]
    there = {tuple(each) for each in edges.tolist()}
    assert len(there) == len(edges)
    assert all((b, a) in there for a, b in there)
    points = head.positions_mm[head.faces]
    volume = np.einsum("ij,ij->i", points[:, 0], np.cross(points[:, 1], points[:, 2])).sum() / 6.0
    assert 2.5e6 < volume < 5e6  # 2.5 to 5 litres
    assert np.ptp(head.positions_mm[:, 1]) == pytest.approx(HEIGHT_MM)
    assert head.positions_mm[:, 2].argmax() in np.unique(head.faces)


def test_the_heads_charts_do_not_overlap(head):
    size = 256
    corners = head.uv[head.faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
    covered = draw_texture(head, size).covered.mean()
    assert covered == pytest.approx(area, abs=0.01)  # where charts overlap it is less


def test_a_cubes_charts_are_as_large_as_its_faces():
    mesh = cube()
    assert mesh.area_mm2.sum() == pytest.approx(6.0 * 80.0**2)
    outward = np.einsum("nk,nk->n", mesh.face_normals, mesh.positions_mm[mesh.faces].mean(axis=1))
    assert (outward > 0.0).all()
