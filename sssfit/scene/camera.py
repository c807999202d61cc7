"""A perspective camera, and the planes of what it sees."""

import dataclasses
import math

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.scene.patterns import check_range, check_size

FOV_DEGREES = 30.0  # vertical; the paper gives none
# Planes (A, B, C, D) of the frustum in clip space, A x + B y + C z + D w >= 0 inside (Jimenez and
# Gutierrez 2008, "Faster rendering of human skin", section 5).
CLIP_PLANES = np.array(
    [
        (1.0, 0.0, 0.0, 1.0),
        (-1.0, 0.0, 0.0, 1.0),
        (0.0, 1.0, 0.0, 1.0),
        (0.0, -1.0, 0.0, 1.0),
        (0.0, 0.0, 1.0, 1.0),
        (0.0, 0.0, -1.0, 1.0),
    ]
)


@dataclasses.dataclass(frozen=True, slots=True)
class Camera:
    """An eye on the z axis that looks at the origin, against z; y is up.

    Parameters
    ----------
    distance_mm : float [mm]
        Distance of the eye from the origin.
    height, width : int
        Size of the picture in pixels.
    fov_degrees : float [degrees]
        Vertical field of view, up to 170.
    near_mm, far_mm : float [mm]
        Depths between which there is a picture.
    """

    distance_mm: float
    height: int
    width: int
    fov_degrees: float = FOV_DEGREES
    near_mm: float = 10.0
    far_mm: float = 1e5

    def __post_init__(self) -> None:
        check_size("camera", self.height, self.width, 1.0)
        check_range("camera", "distance_mm", self.distance_mm, 1e-3, 1e9)
        check_range("camera", "fov_degrees", self.fov_degrees, 0.01, 170.0)
        if not 0.0 < self.near_mm < self.far_mm < math.inf:
            raise RenderError(
                f"camera: near_mm = {self.near_mm:g} and far_mm = {self.far_mm:g}; expected a "
                "depth above 0 and a larger one."
            )

    @property
    def mm_per_pixel(self) -> float:
        """Size of a pixel on the plane at the origin [mm]."""
        half = math.tan(math.radians(0.5 * self.fov_degrees))
        return 2.0 * self.distance_mm * half / self.height

    @property
    def eye_mm(self) -> FloatArray:
        """Place of the eye (3,) [mm]."""
        return np.array([0.0, 0.0, self.distance_mm])

    @property
    def projection(self) -> FloatArray:
        """Matrix P (4, 4) from eye to clip coordinates, as OpenGL has it."""
        f = 1.0 / math.tan(math.radians(0.5 * self.fov_degrees))
        near, far = self.near_mm, self.far_mm
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = f * self.height / self.width, f
        matrix[2, 2], matrix[2, 3] = (far + near) / (near - far), 2.0 * far * near / (near - far)
        matrix[3, 2] = -1.0
        return matrix

    def eye_planes(self, margin: float = 1.0) -> FloatArray:
        """Return the frustum's planes (6, 4) in eye coordinates, P^T Pi (equation 6).

        ``margin`` is D of the four sides: at 1.1 a tenth of the half picture beyond each side is
        inside, too.
        """
        planes = CLIP_PLANES.copy()
        planes[:4, 3] = margin
        seen: FloatArray = planes @ self.projection
        return seen

    def to_eye(self, points_mm: FloatArray) -> FloatArray:
        """Return points (..., 3) in eye coordinates."""
        return points_mm - self.eye_mm

    def to_screen(self, points_mm: FloatArray) -> FloatArray:
        """Return pixels to the right, pixels down and depth [mm] of points (..., 3).

        The middle of the upper left pixel is at (.5, .5). Places of points behind the eye are
        without meaning.
        """
        eye = self.to_eye(points_mm)
        depth = -eye[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 0.5 * self.height / (depth * math.tan(math.radians(0.5 * self.fov_degrees)))
            x = 0.5 * self.width + eye[..., 0] * scale
            y = 0.5 * self.height - eye[..., 1] * scale
        return np.stack((x, y, depth), axis=-1)
