"""The command lines that make a page's figures again."""

import shlex
from collections.abc import Mapping
from typing import Any

from sssfit.compare.candidates import Candidate

_COMMANDS = ("sssfit simulate {} --method exact", "sssfit compare {}", "sssfit report {}")


def commands_of(material: str) -> tuple[str, ...]:
    """Return the command lines that make profile, comparison and page."""
    word = shlex.quote(material)
    return tuple(each.format(word) for each in _COMMANDS)


def command_of(candidate: Candidate, profile_name: str, mm_per_pixel: float) -> str:
    """Return the command line that fits a candidate."""
    settings: Mapping[str, Any] = candidate.settings
    words = [f"--{key.replace('_', '-')} {value}" for key, value in settings.items()]
    words += [f"--taps {candidate.taps}"] if candidate.taps is not None else []
    pixels = f"--mm-per-pixel {mm_per_pixel:g}"
    return " ".join([f"sssfit fit {profile_name} --method {candidate.method}", *words, pixels])
