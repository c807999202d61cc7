"""What a preset is: an engine, its parameters with units, and the way to them and back.

A preset is one file with a `Preset` and one line in ``sssfit.methods.PRESETS``. The fields say what
an engine's parameters are called, their units and ranges; ``convert`` fills them from a material or
a profile, ``look`` returns the light's way as the engine draws it, ``material`` the medium.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from sssfit.errors import ArgumentError
from sssfit.export.presets.fields import Field, Value, Values
from sssfit.export.presets.source import Source
from sssfit.kernel import Taps
from sssfit.material import Material
from sssfit.messages import did_you_mean, printable, shown
from sssfit.profile import Profile


@dataclass(frozen=True, slots=True)
class Preset:
    """How a material comes into an engine.

    Parameters
    ----------
    name : str
        Its name in ``sssfit.methods.PRESETS``.
    engine : str
        The engine, and the part of it that takes the parameters.
    model : str
        The diffusion model that the engine's parameters stand for.
    ending : str
        Ending of the file that `write` makes, such as ".py".
    fields : tuple of Field
    convert : function
        From a source and the chosen parameters to the values of all fields.
    write : function
        The text to paste or to load, of parameters.
    look : function
        From parameters to the profile, or the taps, that the engine blurs light with.
    profile : function
        From parameters to the profile of the engine's model; `look` where that is a profile.
    lost : str
        What of a material does not get there, in a sentence.
    origin : tuple of str
        Public places of the formulas.
    material : function, optional
        From parameters to the medium that they describe, where they describe one.
    doubts : function, optional
        Warnings about parameters, each a sentence.
    losses : function, optional
        Warnings about what of a source the parameters cannot say, each a sentence.
    of_taps : function, optional
        From a table of taps that `look` returns, and the chosen parameters, to the values.
    """

    name: str
    engine: str
    model: str
    ending: str
    fields: tuple[Field, ...]
    convert: Callable[[Source, Values], Values]
    write: Callable[[Parameters], str]
    look: Callable[[Parameters], Profile | Taps]
    profile: Callable[[Parameters], Profile]
    lost: str
    origin: tuple[str, ...]
    material: Callable[[Parameters], Material] | None = None
    doubts: Callable[[Parameters], tuple[str, ...]] | None = None
    losses: Callable[[Source], tuple[str, ...]] | None = None
    of_taps: Callable[[Taps, Values], Values] | None = None

    def read(self, given: Mapping[str, object], *, title: str, chosen: bool = False) -> Values:
        """Return the values of the fields from values or words by their names.

        Parameters
        ----------
        given : mapping
        title : str
            What messages call the preset's input.
        chosen : bool
            Whether only the chosen fields are wanted, as for a conversion.

        Raises
        ------
        ArgumentError
            A name is unknown, a value is invalid, or a required one is missing.
        """
        fields = {each.name: each for each in self.fields if each.is_chosen or not chosen}
        for key in given:
            if key not in fields:
                raise ArgumentError(
                    f"{self.name} takes no {shown(key)}; {did_you_mean(key, list(fields))}"
                    f"expected {', '.join(fields) or 'nothing'}."
                )
        missing = [k for k, each in fields.items() if k not in given and each.default is None]
        if missing:
            raise ArgumentError(
                f"{printable(title)}: {', '.join(missing)} missing; {self.name} needs "
                f"{'them' if len(missing) > 1 else 'it'}: {fields[missing[0]].expected}."
            )
        return MappingProxyType(
            {key: each.read(given.get(key, each.default)) for key, each in fields.items()}
        )


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of an engine, for one material.

    Parameters
    ----------
    preset : Preset
    title : str
        Name of the material; suitable as a file name.
    values : mapping
        By the engine's names, in the units of `Preset.fields`.
    warnings : tuple of str
        What a user should know before using them, each a sentence.
    """

    preset: Preset
    title: str
    values: Values
    warnings: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def colour(self, name: str) -> tuple[float, float, float]:
        """Return a parameter with a number a channel."""
        red, green, blue = (float(each) for each in self[name])
        return red, green, blue

    def number(self, name: str) -> float:
        """Return a parameter that is one number."""
        return float(self.values[name])  # type: ignore[arg-type]

    def to_dict(self) -> dict[str, Any]:
        """Return the parameters with units and meanings as JSON values."""
        return {
            "preset": self.preset.name,
            "engine": self.preset.engine,
            "model": self.preset.model,
            "material": self.title,
            "parameters": {
                each.name: {
                    "value": _plain(self.values[each.name]),
                    "unit": each.unit,
                    "meaning": each.meaning,
                }
                for each in self.preset.fields
            },
            "lost": self.preset.lost,
            "origin": list(self.preset.origin),
            "warnings": list(self.warnings),
        }


def _plain(value: Value) -> Any:
    return list(value) if isinstance(value, tuple) else value
