"""Presets in words: the list of them, one preset's fields, and parameters with their units."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sssfit.errors import ArgumentError, KernelError, SssfitWarning
from sssfit.export.presets import (
    Parameters,
    engine_look,
    import_preset,
    parameters_from,
    preset,
    preset_of,
)
from sssfit.export.presets.fields import Value
from sssfit.kernel import SeparableKernel, Taps
from sssfit.kernel.taps_json import is_taps_file, pack
from sssfit.material import Material
from sssfit.messages import printable, table
from sssfit.methods import PRESETS
from sssfit.profile import Profile, is_profile_file

_DIGITS = 7  # parameters are stored in single precision at best
_MARK, _HEAD = b"sssfit", 512  # bytes; the text of every preset with comments begins with them
_TOML_HEAD = "# Made by sssfit from an engine's parameters; it may replace this file."

Imported = Material | Profile | Taps


def presets_list() -> list[dict[str, Any]]:
    """Return a row a preset: name, engine, model, ending, and what it leads back to."""
    found = [preset(name) for name in PRESETS]
    return [
        {
            "preset": each.name,
            "engine": each.engine,
            "model": each.model,
            "ending": each.ending,
            "inverse": "material" if each.material is not None else "profile",
            "chosen": [field.name for field in each.fields if field.is_chosen],
            "lost": each.lost,
        }
        for each in found
    ]


def list_text() -> str:
    """Return the list for a terminal."""
    cells = [
        [each["preset"], each["engine"], each["inverse"], ", ".join(each["chosen"]) or "-"]
        for each in presets_list()
    ]
    return table(["preset", "engine", "back to a", "what you choose"], cells, left=range(4))


def parameters_text(found: Parameters) -> str:
    """Return parameters with units and meanings for a terminal, and what is lost."""
    rows = [
        [each.name, _value(found.values[each.name]), each.unit or "-", each.meaning]
        for each in found.preset.fields
    ]
    head = f"{found.title} for {found.preset.engine}: {found.preset.model}"
    lost = f"Lost: {found.preset.lost}"
    return "\n".join(
        [head, table(["parameter", "value", "unit", "meaning"], rows, left=range(4)), lost]
    )


def _value(value: Value) -> str:
    if isinstance(value, tuple):
        return " ".join(_value(each) for each in value)
    return f"{value:.{_DIGITS}g}" if isinstance(value, float) else str(value)


def is_preset_file(path: Path) -> bool:
    """Tell whether `preset_text`, or an import, wrote a file: its first lines name sssfit."""
    try:
        with path.open("rb") as stream:
            return _MARK in stream.read(_HEAD)
    except OSError:
        return False


def words_of(texts: Sequence[str], most: int) -> tuple[list[str], dict[str, str]]:
    """Return file names, at most so many, and of texts as ``name=value`` parameters.

    Raises
    ------
    ArgumentError
        A parameter is there twice, or there are too many files.
    """
    files, given = list[str](), dict[str, str]()
    for each in texts:
        name, sign, value = each.partition("=")
        if not sign:
            files.append(each)
        elif name in given:
            raise ArgumentError(f"{printable(name)} is given twice; give it once.")
        else:
            given[name] = value
    if len(files) > most:
        expected = "parameters as NAME=VALUE" if most == 0 else "one material or profile"
        raise ArgumentError(f"{', '.join(map(printable, files))}: expected {expected}.")
    return files, given


def warn_of(found: Parameters, *, strict: bool = False) -> None:
    """Warn of what a user should know before using parameters; an error if ``strict``.

    Raises
    ------
    KernelError
        There is something, and ``strict``.
    """
    for words in found.warnings:
        if strict:
            raise KernelError(f"{found.preset.name}: {words}")
        warnings.warn(f"{found.preset.name}: {words}", SssfitWarning, stacklevel=2)


def imported_as(name: str, given: Mapping[str, str], title: str, output: str) -> Imported:
    """Return what an engine's parameters describe, for a file by its ending.

    The taps of the engine's shader for .taps.json, which hold more than the radial profile that
    is made of them; else a material or a profile.

    Raises
    ------
    ArgumentError
        As `import_preset`; the engine has no taps.
    """
    if not output.endswith(".taps.json"):
        return import_preset(name, given, title)
    look = engine_look(parameters_from(name, given, title))
    if not isinstance(look, Taps):
        raise ArgumentError(f"{name} blurs by a profile and has no taps; give .profile.npz.")
    return look


def text_name(found: Parameters) -> str:
    """Return the name of a preset's file: material, engine, ending."""
    tag = f".{found.preset.name}"
    return found.title + (tag if tag != found.preset.ending else "") + found.preset.ending


def stored(record: Imported) -> bytes:
    """Return an imported record's file: TOML of a material, npz of a profile, JSON of taps."""
    if isinstance(record, Material):
        return f"{_TOML_HEAD}\n{record.to_toml()}".encode()
    if isinstance(record, Taps):
        return pack(record)
    stream = io.BytesIO()
    record.write(stream)
    return stream.getvalue()


def kind_of(record: Imported) -> tuple[str, Callable[[Path], bool]]:
    """Return the ending of an imported record's file, and what tells whether a file is ours."""
    if isinstance(record, Profile):
        return ".profile.npz", is_profile_file
    if isinstance(record, Taps):
        return ".taps.json", is_taps_file
    return ".toml", is_preset_file


def preset_of_any(name: str, loaded: Any, chosen: Mapping[str, str]) -> Parameters:
    """Return an engine's parameters for what a file of ours holds.

    Raises
    ------
    KernelError, ArgumentError
        As `preset_of`; a walk's checkpoint is not finished.
    """
    if not isinstance(loaded, Material | Profile | SeparableKernel | Taps):
        raise KernelError("a checkpoint is an unfinished walk; finish it and give its profile.")
    return preset_of(name, loaded, **chosen)
