"""Lights that change over time: the intensity of each in a frame, as a factor of the irradiance.

A new light is a function of the frame's number, from 0, and one entry in ``sssfit.methods.LIGHTS``.
At 60 frames a second the strobe flashes 7.5 times, and the gun fires 10 shots in bursts of three.
"""

import math

_STROBE_PERIOD, _STROBE_LIT, _STROBE_DARK = 8, 4, 0.05
_BURST, _SHOTS = 40, (5, 11, 17)  # frames from one burst to the next; of the shots in it
_FADES_IN = 1.5  # frames to 1/e
_ROOM = 0.15


def still(_frame: int) -> float:
    """Return 1: it does not change."""
    return 1.0


def sinusoidal(frame: int) -> float:
    """Return 1 + 0.9 sin(t / 10): as the supplement's h2, but never below 0."""
    return 1.0 + 0.9 * math.sin(frame / 10.0)


def strobe(frame: int) -> float:
    """Return 1 for four frames and 0.05 for four."""
    return 1.0 if frame % _STROBE_PERIOD < _STROBE_LIT else _STROBE_DARK


def gunshot(frame: int) -> float:
    """Return 0.15, and 1 more at each shot of a burst, fading by 1/e in 1.5 frames."""
    since = [frame % _BURST - shot for shot in _SHOTS]
    return _ROOM + sum(math.exp(-t / _FADES_IN) for t in since if t >= 0)
