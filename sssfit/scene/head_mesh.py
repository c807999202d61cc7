"""The head as a closed mesh of about 25 000 triangles in three charts.

Every point of the surface is where a ray from the middle of the head leaves it for the last time:
front and back are the height fields of the made head. Rows run from the crown to the neck, closer
at mouth, nose and eyes; columns around the head, closer in front and at the ears. Behind the ears,
where a ray passes twice, the outer side counts. The chart of the sides takes the upper three
quarters of the texture, with its seam at the back; crown and neck are disks below it.
"""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.process import thread_count
from sssfit.scene._head_shape import back
from sssfit.scene._head_surface import bust
from sssfit.scene.mesh import Mesh

HEIGHT_MM = 250.0  # 2.5 units of 100 mm; the paper gives no size
_MIDDLE_MM = (0.0, 15.0, -95.0)
_LOWEST_MM = -140.0  # the neck ends here, where the shoulders begin
_COLUMNS, _ROWS = 144, 76  # of the sides: 21 888 triangles
_RINGS = 6  # of each disk: 1 584 triangles
# How close columns and rows lie, by the angle from the front and by the elevation in degrees: lips
# have folds of 2 mm, and an ear is 3 mm thick where columns cross it, at 72 to 86 degrees.
_CLOSE_COLUMNS = (
    (0.0, 26.0, 36.0, 66.0, 72.0, 86.0, 95.0, 180.0),
    (3, 3, 1.2, 0.8, 3, 3, 0.6, 0.5),
)
_CLOSE_ROWS = (
    (-75.0, -52.0, -44.0, -16.0, -10.0, 12.0, 20.0, 60.0),
    (0.7, 0.9, 3, 3, 1.8, 1.8, 0.7, 0.5),
)
_EVEN = 0.5  # part of the texture's width and height that is shared out evenly
_CROWN_DEGREES = 58.0
_REACH_MM = 260.0
_SPACING_MM = 1.0  # of the height fields; triangles are 2 to 5 mm wide
_STEPS, _HALVINGS = 200, 24
_FINE = 240  # elevations by which the rows' arc lengths are measured
_GUTTER = 1.0 / 128.0  # of the texture: at 128 texels a chart still keeps one to itself
_DISK = 0.115  # radius of the two disks in the texture


@functools.lru_cache(maxsize=2)
def head_mesh(height_mm: float = HEIGHT_MM) -> Mesh:
    """Return the head, its middle at the origin, looking along z.

    Parameters
    ----------
    height_mm : float [mm]
        From the end of the neck to the crown.
    """
    surface = _Surface()
    angles = _angles()
    lines = [surface.points(angles, each) for each in surface.elevations()]
    shares = np.linspace(1.0, 0.0, _RINGS + 1)
    crown = [surface.points(angles, 90.0 - each * (90.0 - _CROWN_DEGREES)) for each in shares]
    middle = lines[-1][:-1].mean(axis=0)
    neck = [middle + each * (lines[-1] - middle) for each in shares]
    parts = [_sides(np.array(lines)), _disk(np.array(crown), 1.0), _disk(np.array(neck), -1.0)]
    points, uv, faces = _joined(parts)
    points -= 0.5 * (points.min(axis=0) + points.max(axis=0))
    return Mesh("head", points * (height_mm / np.ptp(points[:, 1])), uv, faces)


class _Surface:
    """Where rays from the middle of the head leave it."""

    def __init__(self) -> None:
        field = bust(_SPACING_MM, thread_count(None))
        rows, columns = field.heights.shape
        x = field.x0_mm + _SPACING_MM * np.arange(columns, dtype=np.float64)
        y = field.y0_mm + _SPACING_MM * np.arange(rows, dtype=np.float64)
        self.front, self.back = field.heights, back(x[None, :], y[:, None])
        self.corner = np.array([field.x0_mm, field.y0_mm])

    def elevations(self) -> FloatArray:
        """Return the elevations of the rows of the sides."""
        low = -np.degrees(np.arctan2(_MIDDLE_MM[1] - _LOWEST_MM, 45.0))
        fine = np.linspace(_CROWN_DEGREES, low, _FINE)
        angles = np.array([0.0, 0.5 * np.pi, np.pi])
        paths = np.array([self.points(angles, each) for each in fine])
        steps = np.linalg.norm(np.diff(paths, axis=0), axis=-1).sum(axis=1)
        close = np.interp(0.5 * (fine[1:] + fine[:-1]), *_CLOSE_ROWS)
        length = np.concatenate(([0.0], np.cumsum(close * steps)))
        return np.interp(np.linspace(0.0, length[-1], _ROWS + 1), length, fine)

    def points(self, angles: FloatArray, elevation_degrees: float) -> FloatArray:
        """Return the points (N, 3) of one elevation; no lower than the neck's end."""
        up = np.radians(elevation_degrees)
        rays = np.stack(
            (
                np.cos(up) * np.sin(angles),
                np.full(angles.shape, np.sin(up)),
                np.cos(up) * np.cos(angles),
            ),
            axis=1,
        )
        middle = np.array(_MIDDLE_MM)
        most = np.full(len(rays), _REACH_MM)
        if up < 0.0:
            most = np.minimum(most, (_LOWEST_MM - middle[1]) / rays[:, 1])
        shares = np.linspace(0.0, 1.0, _STEPS)
        along = most[:, None] * shares
        inside = self._is_inside(middle + along[..., None] * rays[:, None])
        last = _STEPS - 1 - np.argmax(inside[:, ::-1], axis=1)
        low = along[np.arange(len(rays)), last]
        high = along[np.arange(len(rays)), np.minimum(last + 1, _STEPS - 1)]
        for _ in range(_HALVINGS):
            half = 0.5 * (low + high)
            is_in = self._is_inside(middle + half[:, None] * rays)
            low, high = np.where(is_in, half, low), np.where(is_in, high, half)
        found: FloatArray = middle + low[:, None] * rays
        return found

    def _is_inside(self, points: FloatArray) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
        from scipy.ndimage import map_coordinates

        places = (points[..., :2] - self.corner) / _SPACING_MM
        at = np.stack((places[..., 1], places[..., 0]))
        front, back = (
            map_coordinates(each, at, order=1, mode="nearest") for each in (self.front, self.back)
        )
        return (points[..., 2] <= front) & (points[..., 2] >= back)


def _angles() -> FloatArray:
    """Return the angles of the columns from the z axis, -pi to pi."""
    fine = np.linspace(-180.0, 180.0, 3601)
    close = np.interp(np.abs(0.5 * (fine[1:] + fine[:-1])), *_CLOSE_COLUMNS)
    passed = np.concatenate(([0.0], np.cumsum(close)))
    angles = np.interp(np.linspace(0.0, passed[-1], _COLUMNS + 1), passed, fine)
    return np.radians(np.asarray(angles, dtype=np.float64))


_Part = tuple[FloatArray, FloatArray, "np.ndarray[tuple[int, ...], np.dtype[np.int64]]"]


def _sides(lines: FloatArray) -> _Part:
    """Return points, texture coordinates and triangles of a grid of rows (R, N, 3)."""
    rows, columns = lines.shape[:2]
    around = np.linalg.norm(np.diff(lines, axis=1), axis=-1).mean(axis=0)
    down = np.linalg.norm(np.diff(lines, axis=0), axis=-1).mean(axis=1)
    u = _GUTTER + (1.0 - 2.0 * _GUTTER) * _shares(around)
    v = 1.0 - _GUTTER - (0.75 - 2.0 * _GUTTER) * _shares(down)
    uv = np.stack(np.meshgrid(u, v), axis=-1)
    return lines.reshape(-1, 3), uv.reshape(-1, 2), _grid_faces(rows, columns)


def _shares(steps: FloatArray) -> FloatArray:
    """Return where rows or columns lie in a chart, 0 to 1: halfway from even to by their width."""
    by_width = np.concatenate(([0.0], np.cumsum(steps))) / steps.sum()
    found: FloatArray = _EVEN * np.linspace(0.0, 1.0, len(by_width)) + (1.0 - _EVEN) * by_width
    return found


def _grid_faces(rows: int, columns: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.int64]]":
    """Return triangles of a grid whose rows run down and columns to the right, from outside."""
    first = np.arange((rows - 1) * columns).reshape(rows - 1, columns)[:, :-1].ravel()
    below = first + columns
    upper = np.stack((first, below, first + 1), axis=1)
    lower = np.stack((first + 1, below, below + 1), axis=1)
    return np.concatenate((upper, lower)).astype(np.int64)


def _disk(rings: FloatArray, side: float) -> _Part:
    """Return rings (R, N, 3) around a point, the last one, as a disk in the texture.

    ``side`` is 1 for the crown, whose rings come from below, and -1 for the neck.
    """
    columns = rings.shape[1]
    turn = 2.0 * np.pi * np.arange(columns) / (columns - 1)
    centre = np.array([0.125 if side > 0.0 else 0.375, 0.125])
    circle = np.stack((np.sin(turn), -side * np.cos(turn)), axis=1)
    shares = np.linspace(1.0, 0.0, len(rings))
    uv = centre + _DISK * shares[:, None, None] * circle
    faces = _grid_faces(len(rings), columns)
    last = (len(rings) - 1) * columns
    faces = faces[(faces >= last).sum(axis=1) < 2]  # at the point itself one of two has no area
    if side > 0.0:
        faces = faces[:, ::-1]
    return rings.reshape(-1, 3), uv.reshape(-1, 2), faces


def _joined(parts: list[_Part]) -> _Part:
    """Return the charts as one mesh."""
    starts = np.cumsum([0, *(len(each[0]) for each in parts)])
    faces = [each[2] + start for each, start in zip(parts, starts, strict=False)]
    points, uv = (np.concatenate([each[k] for each in parts]) for k in range(2))
    return points, uv, np.concatenate(faces)
