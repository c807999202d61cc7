"""A small report, made once: a material with a dangerous name, few kernels, small pictures."""

import dataclasses
import functools
import re

import cli_world

from sssfit.material import parse_material
from sssfit.report import Report, make_report, page
from sssfit.simulate import simulate_exact

NAME = "<script>alert(1)</script>"
LABEL = "<img src=x onerror=alert(2)>"
SIDE = 48


@functools.cache
def report() -> Report:
    """With a chain of stages, a disk, shared first passes, models and a budget."""
    named = [(LABEL, cli_world.taps())]
    small = {"side": SIDE, "photons": 100_000, "mm_per_pixel": 0.3, "threads": 1}
    made = make_report(cli_world.wax(), named=named, only=["disk", "svd"], **small)
    # Files of materials refuse such names; profiles of other programs may have any.
    return dataclasses.replace(made, name=NAME)


@functools.cache
def text() -> str:
    """Its page."""
    return page(report())


@functools.cache
def grey() -> Report:
    """Of one channel, with disks on smaller pictures."""
    text = cli_world.WAX.replace("eta", 'channels = ["grey"]\neta', 1)
    text = re.sub(r"\[([\d.]+), [\d.]+, [\d.]+\]", r"[\1]", text)
    profile = simulate_exact(parse_material(text, "grey.toml"), threads=1)
    return make_report(profile, only=["disk"], side=16, threads=1)
