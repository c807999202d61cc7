"""Which profile a kernel was fitted to: what its pictures are held against."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ._options import Common
from ._report import say

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel
    from sssfit.profile import Profile

_SAME = ("material_sha256", "method", "photons", "seed")


def true_profile(
    kernel: SeparableKernel, name: str, given: str | None, common: Common
) -> tuple[Profile | None, str | None]:
    """Return the kernel's profile and its file: the one given, else the newest that fits.

    A profile fits if it is of the same material by the same method, photons and seed. It is looked
    for beside the kernel and in the current folder; where there is none, that is said.
    """
    from sssfit.profile import Profile

    if given is not None:
        return Profile.load(given), given
    folders = {Path(), Path() if name == "-" else Path(name).parent}
    files = [path for folder in folders for path in folder.glob("*.profile.npz")]
    for path in sorted(files, key=lambda each: each.stat().st_mtime_ns, reverse=True):
        profile = _read(path)
        if profile is not None and _is_source(profile, kernel):
            return profile, str(path)
    say(
        common,
        f"No profile here that {name} was fitted to, so nothing is measured: name it with "
        "--profile.",
    )
    return None, None


def _read(path: Path) -> Profile | None:
    """Read a profile; one that cannot be read is not the one that is looked for."""
    from sssfit.errors import SssfitError
    from sssfit.profile import Profile

    try:
        return Profile.load(path)
    except SssfitError:
        return None


def _is_source(profile: Profile, kernel: SeparableKernel) -> bool:
    """Whether a kernel's provenance is this profile's."""
    names = {"method": "profile_method"}
    same = all(profile.meta.get(key) == kernel.meta.get(names.get(key, key)) for key in _SAME)
    return same and profile.material_name == kernel.meta.get("material")
