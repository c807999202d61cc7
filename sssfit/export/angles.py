"""R_d by exit angle, as a table (CSV)."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from sssfit.errors import KernelError
from sssfit.files import has_mark
from sssfit.kernel import Kernel
from sssfit.messages import of_material, printable
from sssfit.profile import Profile
from sssfit.profile.directions import angular_reflectance

_MARK = "# sssfit.angles.csv/1"
_HOW = (
    "R_d [1/sr] between two angles to the normal, outside; X_stderr has its standard error, "
    "X_lambert the same energy by the cosine times Fresnel's transmittance."
)


def angles_text(sources: Sequence[Profile | Kernel]) -> str:
    """Return a table of R_d(alpha): a row for each bin, three columns for each channel.

    Raises
    ------
    KernelError
        There are several, or it is not a profile.
    ProfileError
        The profile was computed without angles.
    """
    if len(sources) != 1 or not isinstance(sources[0], Profile):
        raise KernelError("a table of angles is of one profile; a kernel has no exit angles.")
    found = angular_reflectance(sources[0])
    stream = io.StringIO()
    stream.write(f"{_MARK}\n# {printable(of_material(sources[0].material_name))}\n# {_HOW}\n")
    table = csv.writer(stream, lineterminator="\n")
    names = [printable(each) for each in sources[0].channels]
    own = [f"{each}_{what}" for what in ("stderr", "lambert") for each in names]
    table.writerow(["from_deg", "to_deg", *names, *own])
    for row in found.to_dict()["rows"]:
        values = (*row["per_sr"], *row["stderr"], *row["lambertian"])
        table.writerow([row["from_deg"], row["to_deg"], *values])
    return stream.getvalue()


def is_our_angles(path: Path) -> bool:
    """Return whether a file is such a table."""
    return has_mark(path, {_MARK.encode(): b""})
