"""What ``sssfit scene`` does: the kernel, the heads and the savings that were asked for."""

from collections.abc import Callable, Collection
from typing import Any

from sssfit.crowd.frame import MAP_SIZE, measure_frame
from sssfit.crowd.record import CrowdFrame
from sssfit.crowd.row import DISTANCE_UNITS, HEAD_UNITS, RESOLUTION, SPACING_UNITS, Row
from sssfit.crowd.table import MAP_SIZE as TABLE_MAP_SIZE
from sssfit.crowd.table import RESOLUTION as TABLE_RESOLUTION
from sssfit.crowd.table import SpeedUpTable, measure_table
from sssfit.errors import ArgumentError
from sssfit.fit import fit_result
from sssfit.kernel import Kernel
from sssfit.material import load_material
from sssfit.messages import did_you_mean, shown
from sssfit.methods import SAVINGS
from sssfit.render.texture import Savings
from sssfit.scene.camera import FOV_DEGREES
from sssfit.scene.mesh import Mesh
from sssfit.scene.mesh_files import load_mesh
from sssfit.simulate import simulate_exact


def six_gaussians() -> Kernel:
    """Return skin1's six Gaussians, each blurred from the one before, as the paper has them."""
    profile = simulate_exact(load_material("skin1"))
    return fit_result(profile, "gaussian-chain", blur="published").kernel


def savings_of(
    names: Collection[str] | None, culled_by: str = "vertex", margin: float = 1.0
) -> Savings:
    """Return savings by name; None is all of them, and "none" stands for no saving.

    Raises
    ------
    ArgumentError, RenderError
        A name is unknown, or a setting is invalid.
    """
    wanted = SAVINGS if names is None else tuple(each for each in names if each != "none")
    for each in wanted:
        if each not in SAVINGS:
            raise ArgumentError(
                f"savings: {shown(each)} is not among {', '.join(SAVINGS)}. "
                f"{did_you_mean(each, SAVINGS)}".strip()
            )
    return Savings(
        culled=culled_by if "culled" in wanted else None,
        by_depth="depth" in wanted,
        clipped="clipped" in wanted,
        margin=margin,
    )


def frame_of(
    kernel: Kernel,
    *,
    heads: int | None = None,
    distance_units: float | None = None,
    head_units: float = HEAD_UNITS,
    spacing_units: float = SPACING_UNITS,
    fov_degrees: float = FOV_DEGREES,
    resolution: tuple[int, int] | None = None,
    map_size: int | None = None,
    savings: Collection[str] | None = None,
    culled_by: str = "vertex",
    margin: float = 1.0,
    mesh: str | None = None,
    threads: int | None = None,
) -> CrowdFrame:
    """Render one frame; arguments are those of `Row`, `savings_of` and `measure_frame`."""
    row = Row(
        heads or 1,
        distance_units or DISTANCE_UNITS,
        head_units,
        spacing_units,
        fov_degrees,
        resolution or RESOLUTION,
        _mesh_of(mesh),
    )
    return measure_frame(
        row,
        kernel,
        savings=savings_of(savings, culled_by, margin),
        map_size=map_size or MAP_SIZE,
        threads=threads,
    )


def table_of(
    kernel: Kernel,
    *,
    resolution: tuple[int, int] | None = None,
    map_size: int | None = None,
    savings: Collection[str] | None = None,
    culled_by: str = "vertex",
    margin: float = 1.0,
    mesh: str | None = None,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
    **geometry: float,
) -> SpeedUpTable:
    """Measure the paper's table, by default on smaller maps and pictures than the paper's."""
    given: dict[str, Any] = {**geometry, "mesh": _mesh_of(mesh)}
    return measure_table(
        kernel,
        savings=savings_of(savings, culled_by, margin),
        map_size=map_size or TABLE_MAP_SIZE,
        resolution=resolution or TABLE_RESOLUTION,
        threads=threads,
        progress=progress,
        **given,
    )


def _mesh_of(path: str | None) -> Mesh | None:
    return None if path is None else load_mesh(path)
