"""The command lines that make a page's figures again."""

import shlex
from collections.abc import Mapping
from typing import Any

from sssfit.compare.candidates import Candidate


def commands_of(origin: str, *, is_material: bool, **given: Any) -> tuple[str, ...]:
    """Return the command lines that make a profile and a page again.

    Parameters
    ----------
    origin : str
        The material or profile, as it was named.
    is_material : bool
        Whether the profile was computed, and not read.
    **given
        Options of the page with their values; None for those that were not given. Lists of files
        are given one by one, and of names with commas.
    """
    word = shlex.quote(origin)
    words = ["sssfit report", word]
    for key, value in given.items():
        if value is None:
            continue
        flag = f"--{key.replace('_', '-')}"
        for each in value if key == "kernel" else [value]:
            text = ",".join(each) if isinstance(each, tuple | list) else f"{each}"
            words += [flag, shlex.quote(text)]
    page = " ".join(words)
    return (f"sssfit simulate {word} --method exact", page) if is_material else (page,)


def command_of(candidate: Candidate, profile_name: str, mm_per_pixel: float) -> str:
    """Return the command line that fits a candidate."""
    settings: Mapping[str, Any] = candidate.settings
    words = [f"--{key.replace('_', '-')} {value}" for key, value in settings.items()]
    words += [f"--taps {candidate.taps}"] if candidate.taps is not None else []
    pixels = f"--mm-per-pixel {mm_per_pixel:g}"
    return " ".join([f"sssfit fit {profile_name} --method {candidate.method}", *words, pixels])
