"""Meshes made by formulas, for tests of diffusion in texture space."""

import numpy as np

from sssfit.scene.mesh import Mesh


def quad(side_mm=100.0, pieces=1):
    """A flat square that fills its texture and looks along z."""
    steps = np.linspace(0.0, 1.0, pieces + 1)
    u, v = (each.ravel() for each in np.meshgrid(steps, steps))
    points = np.stack((side_mm * (u - 0.5), side_mm * (v - 0.5), np.zeros_like(u)), axis=1)
    return Mesh("quad", points, np.stack((u, v), axis=1), grid_faces(pieces, pieces))


def grid_faces(rows, columns):
    first = np.array([i * (columns + 1) + j for i in range(rows) for j in range(columns)])
    above = first + columns + 1
    return np.concatenate(
        (np.stack((first, first + 1, above), 1), np.stack((first + 1, above + 1, above), 1))
    )


def sphere(radius_mm=50.0, rows=24, columns=48):
    """A UV sphere: longitude by u with its seam at the back, latitude by v."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    around, up = 2.0 * np.pi * (u - 0.5), np.pi * (v - 0.5)
    points = radius_mm * np.stack(
        (np.cos(up) * np.sin(around), np.sin(up), np.cos(up) * np.cos(around)), axis=-1
    )
    faces = grid_faces(rows, columns)
    faces = faces[(faces > columns).sum(1) > 1]  # at the poles one of two has no area
    last = rows * (columns + 1)
    faces = faces[(faces < last).sum(1) > 1]
    uv = np.stack((0.01 + 0.98 * u, v), axis=-1).reshape(-1, 2)
    return Mesh("sphere", points.reshape(-1, 3), uv, faces)


def obj_text(mesh):
    """The mesh as a file."""
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.positions_mm]
    lines += [f"vt {u:.6g} {v:.6g}" for u, v in mesh.uv]
    lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in mesh.faces]
    return "\n".join(lines) + "\n"


def cube(side_mm=80.0):
    """Six faces, a chart of its own for each in a grid of 3 x 2 with gutters."""
    points, uv, faces = [], [], []
    for k, (axis, sign) in enumerate((a, s) for a in range(3) for s in (-1.0, 1.0)):
        normal = np.zeros(3)
        normal[axis] = sign
        right = np.roll(normal, 1)
        up = np.cross(normal, right)
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        points += [0.5 * side_mm * (normal + a * right + b * up) for a, b in corners]
        low = np.array([(k % 3) / 3.0 + 0.02, (k // 3) / 2.0 + 0.02])
        uv += [low + np.array([(a + 1) / 2 * 0.29, (b + 1) / 2 * 0.46]) for a, b in corners]
        faces += [(4 * k, 4 * k + 1, 4 * k + 2), (4 * k, 4 * k + 2, 4 * k + 3)]
    return Mesh("cube", np.array(points), np.array(uv), np.array(faces))
