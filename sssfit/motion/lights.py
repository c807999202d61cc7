"""Lights that change over time: the intensity of each in a frame, as a factor of the irradiance.

A new light is a function and one entry in ``LIGHTS``. At 60 frames a second the strobe flashes 7.5
times, and the gun fires 10 shots a second in bursts of three.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Light:
    """A light.

    Parameters
    ----------
    intensity : callable
        Of the number of a frame, from 0: a factor from 0 up.
    summary : str
        Help text on one line.
    """

    intensity: Callable[[int], float]
    summary: str


def still(_frame: int) -> float:
    """Return 1: it does not change."""
    return 1.0


def sinusoidal(frame: int) -> float:
    """Return 1 + 0.9 sin(t / 10): as the supplement's h2, but never below 0."""
    return 1.0 + 0.9 * math.sin(frame / 10.0)


_STROBE_PERIOD, _STROBE_LIT, _STROBE_DARK = 8, 4, 0.05


def strobe(frame: int) -> float:
    """Return 1 for four frames and 0.05 for four."""
    return 1.0 if frame % _STROBE_PERIOD < _STROBE_LIT else _STROBE_DARK


_BURST, _SHOTS = 40, (5, 11, 17)  # frames from one burst to the next; of the shots in it
_FADES_IN = 1.5  # frames to 1/e
_ROOM = 0.15


def gunshot(frame: int) -> float:
    """Return 0.15, and 1 more at each shot of a burst, fading by 1/e in 1.5 frames."""
    since = [frame % _BURST - shot for shot in _SHOTS]
    return _ROOM + sum(math.exp(-t / _FADES_IN) for t in since if t >= 0)


LIGHTS: Mapping[str, Light] = {
    "still": Light(still, "does not change"),
    "sinusoidal": Light(sinusoidal, "swells and fades slowly, from 0.1 to 1.9"),
    "strobe": Light(strobe, "four frames lit, four nearly dark"),
    "gunshot": Light(gunshot, "bursts of three flashes that fade in a few frames"),
}
