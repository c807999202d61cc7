"""A lit head: a face-like height field of real size, seen in perspective under a sharp light.

Its forms are in `_head_shape` and `_head_face`, its fine relief in `_head_detail`; `_field` lights
it. The picture is grey: it shows the light that arrives at the surface, not that of a painted face.
Nothing is measured from a person.
"""

import math
from typing import Any

from sssfit.process import thread_count
from sssfit.scene._field import Lighting, light_field, light_through
from sssfit.scene._head_shape import FLOOR_MM
from sssfit.scene._head_surface import coarse_bust, solid_head, visible_part
from sssfit.scene.patterns import check_range, check_size
from sssfit.scene.record import Scene

# Half size of a picture that shows the face with a margin, around its middle [mm].
FACE_HEIGHT_MM, FACE_WIDTH_MM = 210.0, 165.0
# The tip of the nose is 22 mm in front; from a shorter distance the ears are hidden.
MIN_DISTANCE_MM = 100.0
# Up to this angle from the view axis only the front casts shadows of the key light; beyond it, the
# whole solid.
FRONT_DEGREES = 85.0


def whole_face_mm_per_pixel(height: int, width: int) -> float:
    """Return the smallest ``mm_per_pixel`` at which the whole face fits."""
    check_size("head", height, width, 1.0)
    return max(FACE_HEIGHT_MM / height, FACE_WIDTH_MM / width)


def _direction(side_degrees: float, up_degrees: float) -> tuple[float, float, float]:
    """Return the unit vector at these degrees to the left of the view axis and above it."""
    side, up = math.radians(side_degrees), math.radians(up_degrees)
    return -math.sin(side) * math.cos(up), math.sin(up), math.cos(side) * math.cos(up)


def _fill_direction(side_degrees: float, up_degrees: float) -> tuple[float, float, float]:
    """Return the direction of the fill light: in front of the face, on the other side."""
    before = math.copysign(min(abs(side_degrees), 180.0 - abs(side_degrees)), side_degrees)
    return _direction(-0.8 * before, 0.3 * up_degrees)


def head_scene(
    *,
    height: int,
    width: int,
    mm_per_pixel: float,
    distance_mm: float = 600.0,
    light_degrees: float = 45.0,
    light_up_degrees: float = 35.0,
    fill: float = 0.06,
    ambient: float = 0.05,
    detail_mm: float = 0.1,
    smooth: bool = True,
    transmit: bool = False,
    threads: int | None = None,
) -> Scene:
    """Render the irradiance of the lit head.

    Parameters
    ----------
    height, width : int
        Size in pixels. The middle of the picture is between nose and eyes; the rest is cropped.
    mm_per_pixel : float [mm]
        Pixel size on the plane at ``distance_mm``, which goes through the front of the cheeks: the
        tip of the nose is 22 mm in front of it, the ears are 80 mm behind.
    distance_mm : float [mm]
        Distance of the camera from that plane, at least 100.
    light_degrees : float [degrees]
        Angle of the key light to the left of the view axis, -180 to 180; beyond 90 it is behind the
        head.
    light_up_degrees : float [degrees]
        Angle of the key light above it, -85 to 85. At normal incidence the key light gives an
        irradiance of 1.
    fill, ambient : float
        Irradiance of a weak light from the other side and of a sky above; neither casts shadows.
    detail_mm : float [mm]
        Depth of a pore, 0 to 0.5; wrinkles, lips and brows scale with it. Relief finer than three
        nodes of the grid (2.25 pixels) is left out.
    smooth : bool
        Average 5 to 21 samples per pixel; without it a pixel shows its centre.
    transmit : bool
        Also give the scene ``thickness_mm`` and ``back_irradiance`` of the key light.
    threads : int, optional
        Threads to use, by default all cores. The result does not depend on them.

    Returns
    -------
    Scene
        Irradiance averaged over the visible part of the pixel's object, specular light (a
        Blinn-Phong highlight, as the exitance of an equally bright matt surface), depth of the
        pixel's centre, and mask: 1 skin, 2 eyeballs, 0 background, where there is no light and the
        depth is inf. With ``transmit``, for pixels that face away from the key light: its path
        inside the head to the pixel's centre, and its irradiance at entry, 0 in shadow. Both are 0
        elsewhere. An ear is 3 mm thick.

    Raises
    ------
    RenderError
        A value is out of range.
    """
    check_size("head", height, width, mm_per_pixel)
    check_range("head", "distance_mm", distance_mm, MIN_DISTANCE_MM, 1e6)
    check_range("head", "light_degrees", light_degrees, -180.0, 180.0)
    check_range("head", "light_up_degrees", light_up_degrees, -85.0, 85.0)
    for option, light in (("fill", fill), ("ambient", ambient)):
        check_range("head", option, light, 0.0, 1.0)
    check_range("head", "detail_mm", detail_mm, 0.0, 0.5)
    cores = thread_count(threads)
    view = (height, width, mm_per_pixel, distance_mm)
    fine, whole = visible_part(*view, detail_mm, cores)
    key = _direction(light_degrees, light_up_degrees)
    is_behind = abs(light_degrees) > FRONT_DEGREES
    solid = solid_head(cores) if transmit or is_behind else None
    seeing: dict[str, Any] = {
        "shape": (height, width),
        "mm_per_pixel": mm_per_pixel,
        "distance_mm": distance_mm,
        "floor_mm": FLOOR_MM,
        "threads": cores,
    }
    seen = light_field(
        fine,
        Lighting(key, _fill_direction(light_degrees, light_up_degrees), (1.0, fill, ambient)),
        coarse=None if whole else coarse_bust(cores),
        behind=solid if is_behind else None,
        smooth=smooth,
        **seeing,
    )
    thickness, back = None, None
    if transmit and solid is not None:
        thickness, cosines = light_through(fine, solid, key, **seeing)
        back = cosines[..., None]
    return Scene(
        "head",
        seen.irradiance[..., None],
        mm_per_pixel,
        distance_mm=distance_mm,
        depth_mm=seen.depth_mm,
        mask=seen.labels,
        specular=seen.specular[..., None],
        thickness_mm=thickness,
        back_irradiance=back,
    )
