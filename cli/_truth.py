"""Which profile a kernel was fitted to: what its pictures are held against."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ._options import Common
from ._output import say

if TYPE_CHECKING:
    from sssfit.kernel import SeparableKernel
    from sssfit.profile import Profile


def true_profile(
    kernel: SeparableKernel, name: str, given: str | None, common: Common
) -> tuple[Profile | None, str | None]:
    """Return the kernel's profile and its file: the one given, else the one it was fitted to.

    That is the profile whose light has the fingerprint that the kernel recorded, from whatever
    program; of several the newest. It is looked for beside the kernel and in the current folder;
    where there is none, what is there in its place is said.
    """
    from sssfit.profile import Profile

    if given is not None:
        profile = Profile.load(given)
        if kernel.meta.get("profile_sha256") not in (None, profile.sha256):
            say(common, f"{given} is not the profile that {name} was fitted to.")
        return profile, given
    folders = {Path(), Path() if name == "-" else Path(name).parent}
    files = [path for folder in folders for path in folder.glob("*.npz") if path.is_file()]
    files.sort(key=lambda each: each.stat().st_mtime_ns, reverse=True)
    profiles = [(path, found) for path in files if (found := _read(path)) is not None]
    for path, profile in profiles:
        if profile.sha256 == kernel.meta.get("profile_sha256"):
            return profile, str(path)
    say(common, _missing(kernel, name, profiles))
    return None, None


def _read(path: Path) -> Profile | None:
    """Read a profile; one that cannot be read is not the one that is looked for."""
    from sssfit.errors import SssfitError
    from sssfit.profile import Profile

    try:
        return Profile.load(path)
    except SssfitError:
        return None


def _missing(kernel: SeparableKernel, name: str, profiles: Sequence[tuple[Path, Profile]]) -> str:
    """Say why nothing is measured: the kernel records no profile, or it changed, or is not here."""
    from sssfit.fit._target import name_of
    from sssfit.messages import printable

    kernel_file, end = printable(name), "so nothing is measured"
    if kernel.meta.get("profile_sha256") is None:
        return (
            f"{kernel_file} does not record which profile it was fitted to, {end}: fit it again, "
            "or name the profile with --profile."
        )
    made_as = (kernel.meta.get("material"), kernel.meta.get("profile_method"))
    for path, profile in profiles:
        if (name_of(profile), profile.meta.get("method")) == made_as:
            return (
                f"{printable(str(path))} is a profile of {made_as[0]} by the same method, but not "
                f"the one that {kernel_file} was fitted to, or it has changed since, {end}: fit "
                "the kernel again, or name its profile with --profile."
            )
    return (
        f"No profile here is the one that {kernel_file} was fitted to, {end}: name it with "
        "--profile."
    )
