"""R(k), a medium's response to sinusoids of light, as a table (CSV)."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from sssfit.errors import KernelError
from sssfit.files import has_mark
from sssfit.kernel import Kernel
from sssfit.messages import of_material, printable
from sssfit.profile import Profile
from sssfit.profile.frequency import frequency_response

_MARK = "# sssfit.frequency.csv/1"
_HOW = (
    "R(k) = 2 pi int R_d(r) J0(k r) r dr, by k_per_mm [rad/mm]; X_stderr has its standard error, "
    "nan if unknown."
)


def frequency_text(sources: Sequence[Profile | Kernel]) -> str:
    """Return a table of R(k): a row for each frequency, two columns for each channel.

    Raises
    ------
    KernelError
        There are several, or it is not a profile.
    """
    if len(sources) != 1 or not isinstance(sources[0], Profile):
        raise KernelError("a table of R(k) is of one profile; a kernel has no R(k) of its own.")
    found = frequency_response(sources[0])
    stream = io.StringIO()
    stream.write(f"{_MARK}\n# {printable(of_material(sources[0].material_name))}\n# {_HOW}\n")
    table = csv.writer(stream, lineterminator="\n")
    names = [printable(each) for each in sources[0].channels]
    table.writerow(["k_per_mm", *names, *(f"{each}_stderr" for each in names)])
    for k, mean, error in zip(found.k_per_mm, found.response, found.stderr, strict=True):
        table.writerow([float(k), *mean.tolist(), *error.tolist()])
    return stream.getvalue()


def is_our_frequencies(path: Path) -> bool:
    """Return whether a file is such a table."""
    return has_mark(path, {_MARK.encode(): b""})
