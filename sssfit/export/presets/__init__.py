"""Presets: a material as the parameters that engines ask for, converted, stated and checked.

    skin = preset_of("unreal", load_material("skin1"))
    skin.to_dict(), preset_text(skin), engine_look(skin)

and back: `import_preset` makes a material or a profile from an engine's own parameters. A preset is
one file here and one line in ``sssfit.methods.PRESETS``; ``record`` says what it consists of.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping

from sssfit.errors import ArgumentError
from sssfit.export.presets.fields import Field
from sssfit.export.presets.record import Parameters, Preset
from sssfit.export.presets.source import Source, check_medium, source_of
from sssfit.kernel import SeparableKernel, Taps
from sssfit.material import Material
from sssfit.material.checks import check_texts
from sssfit.messages import did_you_mean, shown
from sssfit.methods import PRESETS, imported
from sssfit.profile import Profile

__all__ = [
    "Field",
    "Parameters",
    "Preset",
    "engine_look",
    "import_preset",
    "parameters_from",
    "preset",
    "preset_json",
    "preset_of",
    "preset_text",
]


_INDICES = ("ior", "indexOfRefraction")  # what engines call it


def preset(name: str) -> Preset:
    """Return a preset by its name in ``sssfit.methods.PRESETS``.

    Raises
    ------
    ArgumentError
        There is none; the message names the nearest.
    """
    if not isinstance(name, str) or name not in PRESETS:
        raise ArgumentError(
            f"no preset {shown(name)}; {did_you_mean(str(name), list(PRESETS))}expected one of "
            f"{', '.join(PRESETS)}."
        )
    found: Preset = imported(PRESETS[name].function)  # type: ignore[assignment]
    return found


def preset_of(
    name: str, record: Material | Profile | SeparableKernel | Taps | Source, **chosen: object
) -> Parameters:
    """Return an engine's parameters for a material or a profile.

    Parameters
    ----------
    name : str
    record : Material, Profile or Taps
        Three channels. Of a material the exact profile is computed, which takes seconds; a `Source`
        serves several presets. Taps are those of an engine's own shader, whose parameters are found
        again.
    **chosen
        Parameters that a user chooses, by the engine's names: those with ``is_chosen`` in
        `Preset.fields`, such as the number of taps or the size of the scene's unit.

    Raises
    ------
    ArgumentError
        The preset or a chosen parameter is unknown, or its value is invalid.
    KernelError
        The record cannot become such parameters: a kernel, a missing medium, layers where the
        engine has none, a dark channel.
    """
    wanted = preset(name)
    values = wanted.read(chosen, title=name, chosen=True)
    if isinstance(record, Taps) and wanted.of_taps is not None:
        title = str(record.meta.get("material") or name)
        return _warned(wanted, title, {**wanted.of_taps(record, values)})
    if wanted.material is not None:
        check_medium(record, name)
    source = source_of(record)
    found = _warned(wanted, source.title, {**wanted.convert(source, values)})
    if wanted.losses is None:
        return found
    return dataclasses.replace(found, warnings=(*wanted.losses(source), *found.warnings))


def parameters_from(name: str, given: Mapping[str, object], title: str = "") -> Parameters:
    """Return an engine's parameters from values or words by the engine's names.

    Parameters
    ----------
    name : str
    given : mapping
        Such as ``{"SurfaceAlbedo": "0.44,0.22,0.13", "MeanFreePathDistance": 0.13}``.
    title : str
        Name of the material; by default that of the preset.

    Raises
    ------
    ArgumentError
        The preset or a name is unknown, a value is invalid or missing.
    MaterialError
        The title does not suit a file's name.
    """
    wanted = preset(name)
    check_texts(title or name, "")
    return _warned(wanted, title or name, wanted.read(given, title=title or name))


def import_preset(name: str, given: Mapping[str, object], title: str = "") -> Material | Profile:
    """Return the material that an engine's parameters describe, or else the profile that it draws.

    Parameters and errors are those of `parameters_from`. Engines that take a medium give a
    material; the others a profile by the closed form that they blur light with.
    """
    found = parameters_from(name, given, title)
    if found.preset.material is not None:
        return found.preset.material(found)
    return _with_index(found, found.preset.profile(found))


def engine_look(parameters: Parameters) -> Profile | Taps:
    """Return what the engine blurs light with: its profile, or the taps of its shader."""
    return parameters.preset.look(parameters)


def preset_text(parameters: Parameters) -> str:
    """Return the text for the engine: source, a document, or a scene's part."""
    return parameters.preset.write(parameters)


def preset_json(parameters: Parameters) -> str:
    """Return parameters, units and warnings as JSON."""
    return json.dumps(parameters.to_dict(), indent=2, ensure_ascii=False) + "\n"


def _with_index(found: Parameters, profile: Profile) -> Profile:
    """Keep the refractive index among a profile's settings, for the way back."""
    index = [found.values[name] for name in _INDICES if name in found.values]
    if not index:
        return profile
    settings = {**profile.meta.get("settings", {}), "eta": index[0]}
    return dataclasses.replace(profile, meta={**profile.meta, "settings": settings})


def _warned(wanted: Preset, title: str, values: Mapping[str, object]) -> Parameters:
    """Return parameters in the order of the fields, with their warnings."""
    ordered = {each.name: each.read(values[each.name]) for each in wanted.fields}
    bare = Parameters(wanted, title, ordered)
    doubts = () if wanted.doubts is None else wanted.doubts(bare)
    return Parameters(wanted, title, ordered, doubts)
