"""Finds the profile that a kernel was fitted to, among files."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from sssfit.errors import SssfitError
from sssfit.kernel import Kernel
from sssfit.messages import note, printable
from sssfit.profile import Profile


def find_profile(
    kernel: Kernel, kernel_file: str, folders: Iterable[Path]
) -> tuple[Profile | None, str | None]:
    """Find the profile with the fingerprint that a kernel recorded, or note why there is none.

    Parameters
    ----------
    kernel : SeparableKernel or Taps
    kernel_file : str
        The kernel's name in the note.
    folders : iterable of Path
        Folders to search; the newest of several such profiles is taken.

    Returns
    -------
    profile : Profile or None
    file : str or None
        Its path.
    """
    files = [path for folder in folders for path in folder.glob("*.npz") if path.is_file()]
    files.sort(key=lambda each: each.stat().st_mtime_ns, reverse=True)
    profiles = []
    for path in files:
        if (profile := _read(path)) is None:
            continue
        if profile.sha256 == kernel.meta.get("profile_sha256"):
            return profile, str(path)
        profiles.append((path, profile))
    note(_missing(kernel, printable(kernel_file), profiles))
    return None, None


def _read(path: Path) -> Profile | None:
    """Read a profile; an unreadable one cannot be the right one."""
    try:
        return Profile.load(path)
    except SssfitError:
        return None


def _missing(kernel: Kernel, name: str, profiles: Sequence[tuple[Path, Profile]]) -> str:
    """Return why there is none, as text."""
    end = "so nothing is measured"
    if kernel.meta.get("profile_sha256") is None:
        return (
            f"{name} does not record which profile it was fitted to, {end}: fit it again, or name "
            "the profile with `profile`."
        )
    made_as = (kernel.meta.get("material"), kernel.meta.get("profile_method"))
    for path, profile in profiles:
        if (profile.label, profile.meta.get("method")) == made_as:
            return (
                f"{printable(str(path))} is a profile of {made_as[0]} by the same method, but not "
                f"the one that {name} was fitted to, or it has changed since, {end}: fit the "
                "kernel again, or name its profile with `profile`."
            )
    return f"No profile here is the one that {name} was fitted to, {end}: name it with `profile`."
