"""A height field seen in perspective under a sharp key light: the buffers of a range of rows.

The camera is at (0, 0, distance) above the field's origin and looks down; a pixel is
``mm_per_pixel`` wide on the plane z = 0. The key light is directional: a point is lit if the ray
toward it meets nothing. There are five samples per pixel (its centre and four rooks), and sixteen
more where they disagree about visibility or light, so that the edges of shadows have no steps.

A light behind the field is blocked by the solid between its front and its back. For other lights
the field is a front only, and nothing passes behind it.

A solid is the tuple (front, back, x0, y0, spacing, low, high): heights [mm] on the same nodes,
bilinear in between, with no part below ``low`` or above ``high``. It is the set back <= z <= front,
and empty where the back is above the front. Over a cell both distances are quadratic in the ray's
parameter, so lengths have no steps.

A field is the tuple (heights, inner, levels, maxima, x0, y0, spacing): ``inner`` is above 0 where a
separate object, label 2, lies in the surface of label 1. A body is (the visible field, the one that
casts shadows from outside it, the solid, whether the key light is behind). A view is (mm_per_pixel,
distance, floor): everything below the floor is background. A lamp is (direction to the key light,
to the fill light, their strengths and the ambient light's, exponent, reflectance at normal
incidence).
"""

import math

import numpy as np
import numpy.typing as npt

from sssfit._jit import jit, jit_inline
from sssfit._jit.heightfield import NUDGE_MM, Vector, bilinear, clip_axis, first_hit, normal_at

FloatArray = npt.NDArray[np.float64]
# Largest gap of air between the visible surface, with its pores, and the smooth solid [mm].
GAP_MM = 0.5
Solid = tuple[FloatArray, FloatArray, float, float, float, float, float]


@jit_inline
def over_patch(
    heights: FloatArray, row: int, column: int, at: Vector, step: Vector
) -> tuple[float, float, float]:
    """Return the coefficients of the ray's height over a patch, C + B t + A t^2."""
    u, v = at[0] - column, at[1] - row
    dx, dy, dz = step
    corner = heights[row, column]
    b = heights[row, column + 1] - corner
    c = heights[row + 1, column] - corner
    e = heights[row + 1, column + 1] - corner - b - c
    linear = dz - (b * dx + c * dy + e * (u * dy + v * dx))
    return at[2] - (corner + b * u + c * v + e * u * v), linear, -e * dx * dy


@jit_inline
def add_roots(cuts: FloatArray, count: int, patch: Vector, length: float) -> int:
    """Sort the roots of C + B t + A t^2 within (0, length) into ``cuts``; return their number."""
    constant, linear, square = patch
    discriminant = linear * linear - 4.0 * square * constant
    if discriminant < 0.0:
        return count
    # The stable form, without differences of nearly equal numbers.
    q = -0.5 * (linear + math.copysign(math.sqrt(discriminant), linear))
    for which in range(2):
        above, below = (q, square) if which == 0 else (constant, q)
        if below == 0.0 or not 0.0 < above / below < length:
            continue
        place = count
        while place > 0 and cuts[place - 1] > above / below:
            cuts[place] = cuts[place - 1]
            place -= 1
        cuts[place] = above / below
        count += 1
    return count


@jit_inline
def value(patch: Vector, t: float) -> float:
    """C + B t + A t^2."""
    return patch[0] + t * (patch[1] + t * patch[2])


@jit
def first_run(
    solid: Solid, point: Vector, direction: Vector, cuts: FloatArray
) -> tuple[float, float, bool]:
    """Return start and end of a ray's first run inside a solid, in mm, and if it enters again.

    Both are -1 if it is never inside. Gaps under `GAP_MM` count as inside. ``cuts`` (6,) is work
    space.
    """
    front, back, x0, y0, spacing, low, high = solid
    x, y, z = (point[0] - x0) / spacing, (point[1] - y0) / spacing, point[2]
    step = (direction[0] / spacing, direction[1] / spacing, direction[2])
    near, far = clip_axis(x, step[0], front.shape[1] - 1.0, 0.0, 1e9)
    near, far = clip_axis(y, step[1], front.shape[0] - 1.0, near, far)
    near, far = clip_axis(z - low, step[2], high - low, near, far)
    start, stop, t = -1.0, -1.0, near
    while t < far:
        ahead = t + NUDGE_MM
        column = min(max(int(x + ahead * step[0]), 0), front.shape[1] - 2)
        row = min(max(int(y + ahead * step[1]), 0), front.shape[0] - 2)
        end = far
        if step[0] != 0.0:
            end = min(end, (column + (step[0] > 0.0) - x) / step[0])
        if step[1] != 0.0:
            end = min(end, (row + (step[1] > 0.0) - y) / step[1])
        end = max(end, ahead)
        at = (x + t * step[0], y + t * step[1], z + t * step[2])
        over = over_patch(front, row, column, at, step)
        under = over_patch(back, row, column, at, step)
        count = add_roots(cuts, 0, over, end - t)
        count = add_roots(cuts, count, under, end - t)
        cuts[count] = end - t
        before = 0.0
        for k in range(count + 1):
            middle = 0.5 * (before + cuts[k])
            if cuts[k] > before and value(over, middle) <= 0.0 <= value(under, middle):
                if stop >= 0.0 and t + before > stop + GAP_MM:
                    return start, stop, True
                start = t + before if stop < 0.0 else start
                stop = t + cuts[k]
            before = cuts[k]
        t = end
    return start, stop, False


@jit_inline
def outward(solid: Solid, point: Vector) -> Vector:
    """Return the normal of the front or the back, the nearer one, pointing out of the solid."""
    front, back, x0, y0, spacing = solid[:5]
    x, y = (point[0] - x0) / spacing, (point[1] - y0) / spacing
    over = abs(point[2] - bilinear(front, x, y))
    under = abs(point[2] - bilinear(back, x, y))
    if over <= under:
        return normal_at(front, spacing, x, y)
    normal = normal_at(back, spacing, x, y)
    return -normal[0], -normal[1], -normal[2]


Field = tuple[FloatArray, FloatArray, npt.NDArray[np.int64], FloatArray, float, float, float]
Body = tuple[Field, Field, Solid, bool]
View = tuple[float, float, float]
Lamp = tuple[Vector, Vector, Vector, float, float]

# Offset from the patch where the light's ray starts [mm]; the finest cells are 0.02 mm and more.
LIFT_MM = 1e-3
# The same from the solid's coarser front, along the normal: pores are 0.1 mm deep.
OFF_BODY_MM = 0.3
# Rooks: no two in a row or a column, so edges along either axis have five steps, not three.
FIRST = np.array([(0.5, 0.5), (0.1, 0.3), (0.7, 0.1), (0.9, 0.7), (0.3, 0.9)])
MORE = np.array([((i % 4 + 0.5) / 4.0, (i // 4 + 0.5) / 4.0) for i in range(16)])


@jit_inline
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@jit_inline
def intersect(field: Field, point: Vector, direction: Vector, near: float, far: float) -> float:
    """Return the first intersection of a ray, all in mm, with a field; -1 if there is none."""
    heights, _, levels, maxima, x0, y0, spacing = field
    start = ((point[0] - x0) / spacing, (point[1] - y0) / spacing, point[2])
    step = (direction[0] / spacing, direction[1] / spacing, direction[2])
    return first_hit(heights, levels, maxima, start, step, near, far)


@jit_inline
def leaves(field: Field, point: Vector, direction: Vector, near: float) -> float:
    """Return where a ray from inside leaves the field's rectangle."""
    heights, _, _, _, x0, y0, spacing = field
    start, slope = (point[0] - x0) / spacing, direction[0] / spacing
    near, far = clip_axis(start, slope, heights.shape[1] - 1.0, near, 1e9)
    start, slope = (point[1] - y0) / spacing, direction[1] / spacing
    near, far = clip_axis(start, slope, heights.shape[0] - 1.0, near, far)
    return far


@jit_inline
def in_shadow(fine: Field, coarse: Field, point: Vector, light: Vector) -> bool:
    """Return whether the ray toward the light meets the fine field or then the coarse one."""
    if intersect(fine, point, light, LIFT_MM, 1e9) >= 0.0:
        return True
    near = max(leaves(fine, point, light, LIFT_MM), LIFT_MM)
    return intersect(coarse, point, light, near, 1e9) >= 0.0


@jit_inline
def behind_body(solid: Solid, point: Vector, normal: Vector, light: Vector) -> bool:
    """Return whether the ray toward the light runs through the solid."""
    off = (
        point[0] + OFF_BODY_MM * normal[0],
        point[1] + OFF_BODY_MM * normal[1],
        point[2] + OFF_BODY_MM * normal[2],
    )
    return first_run(solid, off, light, np.empty(6))[1] >= 0.0


@jit_inline
def surface_normal(fine: Field, point: Vector) -> Vector:
    """Return the unit normal of the surface at a point, on the camera's side."""
    x, y = (point[0] - fine[4]) / fine[6], (point[1] - fine[5]) / fine[6]
    return normal_at(fine[0], fine[6], x, y)


@jit_inline
def specular_highlight(
    normal: Vector, light: Vector, eye: Vector, exponent: float, face_on: float
) -> float:
    """Return the Blinn-Phong highlight, times pi: the exitance of an equally bright matt surface.

    pi F (n + 8) / (8 pi) (N.H)^n, with Schlick's F = F0 + (1 - F0) (1 - E.H)^5 (Akenine-Moller,
    Haines, Hoffman 2008, "Real-Time Rendering", chapter 7).
    """
    length = math.sqrt(2.0 + 2.0 * dot(light, eye))
    if length == 0.0:
        return 0.0
    cosine = max((dot(normal, light) + dot(normal, eye)) / length, 0.0)
    # E.H is half the length of E + L.
    fresnel: float = face_on + (1.0 - face_on) * max(1.0 - 0.5 * length, 0.0) ** 5
    bright: float = fresnel * (exponent + 8.0) / 8.0 * cosine**exponent
    return bright


@jit_inline
def light_point(body: Body, point: Vector, eye: Vector, lamp: Lamp) -> tuple[float, float, bool]:
    """Return irradiance and highlight of a point, and whether the key light is blocked."""
    fine, coarse, solid, is_behind = body
    key, fill, strengths, exponent, face_on = lamp
    normal = surface_normal(fine, point)
    weak = strengths[1] * max(dot(normal, fill), 0.0)
    # The ambient light is a sky, twice as strong on surfaces that face up as on those facing ahead.
    irradiance = weak + strengths[2] * 0.5 * (1.0 + normal[1])
    highlight = weak * specular_highlight(normal, fill, eye, exponent, face_on)
    cosine = dot(normal, key)
    if cosine <= 0.0:
        return irradiance, highlight, True
    if is_behind:
        blocked = behind_body(solid, point, normal, key)
    else:
        blocked = in_shadow(fine, coarse, point, key)
    if blocked:
        return irradiance, highlight, True
    irradiance += strengths[0] * cosine
    highlight += strengths[0] * cosine * specular_highlight(normal, key, eye, exponent, face_on)
    return irradiance, highlight, False


@jit_inline
def visible_point(fine: Field, view: View, across: float, up: float) -> tuple[int, Vector, Vector]:
    """Label, point and direction to the eye; ``across`` and ``up`` in pixels from the middle."""
    pitch, distance, floor = view
    x, y = across * pitch, up * pitch
    length = math.sqrt(x * x + y * y + distance * distance)
    ray = (x / length, y / length, -distance / length)
    back = (-ray[0], -ray[1], -ray[2])
    t = intersect(fine, (0.0, 0.0, distance), ray, 0.0, 1e9)
    point = (t * ray[0], t * ray[1], distance + t * ray[2])
    if t < 0.0 or point[2] < floor:
        return 0, point, back
    inner = bilinear(fine[1], (point[0] - fine[4]) / fine[6], (point[1] - fine[5]) / fine[6])
    return (2 if inner > 0.0 else 1), point, back


@jit
def gather(
    body: Body,
    view: View,
    lamp: Lamp,
    corner: tuple[float, float],
    samples: FloatArray,
    label: int,
) -> tuple[int, float, float, bool]:
    """Count, irradiance and highlight of the samples that see ``label``; whether all agree."""
    count, irradiance, highlight, blocked = 0, 0.0, 0.0, 0
    for k in range(samples.shape[0]):
        across, up = corner[0] + samples[k, 0], corner[1] - samples[k, 1]
        seen, point, eye = visible_point(body[0], view, across, up)
        if seen == label:
            e, h, shadow = light_point(body, point, eye, lamp)
            count += 1
            irradiance += e
            highlight += h
            blocked += shadow
    agree = count == samples.shape[0] and (blocked == 0 or blocked == count)
    return count, irradiance, highlight, agree


@jit
def light_rows(
    body: Body,
    view: View,
    lamp: Lamp,
    smooth: bool,
    rows: tuple[int, int],
    depth: FloatArray,
    labels: npt.NDArray[np.int32],
    irradiance: FloatArray,
    specular: FloatArray,
) -> None:
    """Fill a range of rows of the buffers; one sample per pixel, its centre, if not ``smooth``."""
    height, width = depth.shape
    for i in range(rows[0], rows[1]):
        for j in range(width):
            corner = (j - 0.5 * width, 0.5 * height - i)
            label, point, _ = visible_point(body[0], view, corner[0] + 0.5, corner[1] - 0.5)
            if label == 0:
                continue
            labels[i, j] = label
            depth[i, j] = view[1] - point[2]
            first = FIRST if smooth else FIRST[:1]
            count, e, h, agree = gather(body, view, lamp, corner, first, label)
            if smooth and not agree:
                more, f, g, _ = gather(body, view, lamp, corner, MORE, label)
                count, e, h = count + more, e + f, h + g
            irradiance[i, j] = e / count
            specular[i, j] = h / count


@jit
def through_rows(
    fine: Field,
    solid: Solid,
    view: View,
    light: Vector,
    rows: tuple[int, int],
    thickness: FloatArray,
    behind: FloatArray,
) -> None:
    """Fill a range of rows: path of light inside to a pixel's centre [mm], cosine at entry.

    Only for points that face away from the light; it reaches others through air. The cosine is 0
    where another part of the solid casts a shadow.
    """
    height, width = thickness.shape
    cuts = np.empty(6)
    for i in range(rows[0], rows[1]):
        for j in range(width):
            label, point, _ = visible_point(
                fine, view, j - 0.5 * width + 0.5, 0.5 * height - i - 0.5
            )
            if label == 0 or dot(surface_normal(fine, point), light) > 0.0:
                continue
            start, stop, again = first_run(solid, point, light, cuts)
            if stop < 0.0 or start > GAP_MM:  # the smooth solid is missing here
                continue
            thickness[i, j] = stop - start
            if not again:
                entry = (
                    point[0] + stop * light[0],
                    point[1] + stop * light[1],
                    point[2] + stop * light[2],
                )
                behind[i, j] = max(dot(outward(solid, entry), light), 0.0)
