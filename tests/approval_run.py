"""Run the command line in this process as a user would, and keep all that it did.

What depends on the machine is stood in for: the clock goes on by fractions of a second each time it
is asked, there are two cores, everything counts as compiled, bars are drawn at every report, a
chart is described in place of being laid out and drawn, and a comparison tries one kernel of every
kind.
"""

import collections
import contextlib
import dataclasses
import functools
import importlib
import io
import os
import pkgutil
import shlex
import sys
import time
import types
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import matplotlib.figure
import rich.progress
import shared_work
from approval_figures import figure_lines
from approval_folder import contents, copied_files
from matplotlib.layout_engine import ConstrainedLayoutEngine

import sssfit
from sssfit.cli import main
from sssfit.compare.candidates import Candidate, candidates, every_candidate
from sssfit.fit import TapsFit
from sssfit.methods import PRESETS
from sssfit.process import available_cores
from sssfit.profile import Profile

_TRIED = (
    "pre-integrated",
    "burley",
    "guided k = 1.55",
    "svd 1",
    "svd 2",
    "svd 2, kept",
    "svd 2 on 3 taps",
    "pre-integrated on 5 taps",
    "gaussians 2",
)
# One of every kind of look: a medium is solved for 1 s each, and both with a note are among these.
_PRESETS = ("blender", "hdrp", "iryoku", "community-shaders", "babylon", "gltf")
STEPS_SECONDS = tuple(k / 32 for k in (3, 11, 5, 17, 7))


@dataclass(frozen=True)
class Command:
    """An invocation.

    ``line`` is what stands behind "sssfit" in a shell; ``stdin`` names the file that is piped in;
    ``terminal``: stderr is one; ``set_up`` is called in the folder before; ``hidden`` are patterns
    of what no two machines have alike; ``compiled``: nothing has to be compiled first;
    ``environment`` are variables; ``brief``: files are named alone; ``few``: two materials
    are all that ship with sssfit, and of the paper's two one is not there; ``note`` tells apart
    what has the same command line.
    """

    line: str
    stdin: str | None = None
    terminal: bool = False
    set_up: Callable[[], object] | None = None
    hidden: tuple[str, ...] = ()
    compiled: bool = True
    environment: tuple[tuple[str, str], ...] = ()
    brief: bool = False
    few: bool = False
    note: str = ""

    @property
    def title(self) -> str:
        """By which it is found in the approved files."""
        after = [f"< {self.stdin}"] if self.stdin else []
        after += ["(in a terminal)"] if self.terminal else []
        after += [f"({self.note})"] if self.note else []
        return " ".join(["sssfit", self.line, *after]).strip()


@dataclass(frozen=True)
class Ran:
    """What an invocation left behind; ``charts`` are described by the name that is in the file."""

    status: int
    stdout: bytes
    stderr: str
    written: dict[str, bytes]
    gone: tuple[str, ...]
    charts: dict[bytes, list[str]]
    folder: str


class Clock:
    """Seconds that depend on nothing but how often they were asked for."""

    def __init__(self) -> None:
        self._now, self.asked = 0.0, 0

    def __call__(self) -> float:
        self._now += STEPS_SECONDS[self.asked % len(STEPS_SECONDS)]
        self.asked += 1
        return self._now


class Bar(rich.progress.Progress):
    """Drawn at every report and at no other time."""

    clock = Clock()

    def __init__(self, *columns: Any, **settings: Any) -> None:
        super().__init__(*columns, **settings, auto_refresh=False, get_time=type(self).clock)

    def update(self, *arguments: Any, **fields: Any) -> None:
        super().update(*arguments, **fields)
        self.refresh()


class Terminal(io.StringIO):
    """A stderr that says it is one."""

    def isatty(self) -> bool:
        return True


@functools.cache
def modules() -> tuple[types.ModuleType, ...]:
    """All of ours, imported."""
    found = [importlib.import_module(each.name) for each in _walk("sssfit", sssfit.__path__)]
    cli = importlib.import_module("sssfit.cli")
    return (
        *found,
        *(importlib.import_module(each.name) for each in _walk(cli.__name__, cli.__path__)),
    )


def _walk(name: str, path: Any) -> Iterator[pkgutil.ModuleInfo]:
    return (
        each
        for each in pkgutil.walk_packages(path, f"{name}.")
        if not each.name.endswith("__main__")
    )


def _in_place_of(
    holders: Mapping[int, list[tuple[types.ModuleType, str]]], real: Any, stand_in: Any
) -> Iterator[contextlib.AbstractContextManager[Any]]:
    """Put a stand-in wherever one of our modules holds the real thing."""
    for module, name in holders.get(id(real), ()):
        yield mock.patch.object(module, name, stand_in)


def _holders() -> dict[int, list[tuple[types.ModuleType, str]]]:
    """Where our modules hold what, by its identity; looked for again when they have more names."""
    return _found_holders(tuple(len(vars(each)) for each in modules()))


@functools.lru_cache(maxsize=1)
def _found_holders(_names: tuple[int, ...]) -> dict[int, list[tuple[types.ModuleType, str]]]:
    found: dict[int, list[tuple[types.ModuleType, str]]] = collections.defaultdict(list)
    for module in modules():
        for name, value in vars(module).items():
            found[id(value)].append((module, name))
    return found


class _Time(types.ModuleType):
    """The module of that name with another clock."""

    def __init__(self, clock: Clock) -> None:
        super().__init__("time")
        self.perf_counter = clock

    def __getattr__(self, name: str) -> Any:
        return getattr(time, name)


@contextlib.contextmanager
def stand_ins(
    charts: dict[bytes, list[str]], *, compiled: bool = True, few: bool = False
) -> Iterator[None]:
    """All that stands in for what depends on the machine; ``charts`` receives descriptions."""
    from sssfit import material, simulate
    from sssfit.choose import options, truth
    from sssfit.compare import pictures, presets, sheet
    from sssfit.crowd import table
    from sssfit.measure import cost

    clock = Clock()
    Bar.clock = Clock()

    def describe(figure: matplotlib.figure.Figure, stream: Any, **settings: Any) -> None:
        name = f"chart {len(charts)}".encode()
        charts[name] = figure_lines(figure, settings)
        stream.write(name)

    in_place_of = functools.partial(_in_place_of, _holders())
    with contextlib.ExitStack() as stack:
        patches = [
            *in_place_of(time.perf_counter, clock),
            *in_place_of(time, _Time(clock)),
            *in_place_of(simulate.is_compiled, lambda *_: compiled),
            *in_place_of(simulate.is_solver_compiled, lambda: compiled),
            *in_place_of(available_cores, lambda: 2),
            *(in_place_of(material.material_names, _few_names) if few else ()),
            *in_place_of(candidates, functools.partial(_some_of, candidates)),
            *in_place_of(every_candidate, functools.partial(_some_of, every_candidate)),
            *in_place_of(
                sheet.compute_sheet, functools.partial(sheet.compute_sheet, pixels=24, most_terms=2)
            ),
            *in_place_of(
                table.measure_table,
                functools.partial(table.measure_table, heads=(1, 4), distances=(2.5, 20.0)),
            ),
            mock.patch.object(presets, "PRESETS", {name: PRESETS[name] for name in _PRESETS}),
            mock.patch.object(pictures, "PIXELS", 13),
            *(mock.patch.object(*each) for each in shared_work.SHORT),  # searches of cascades
            mock.patch.object(options, "fit_result", _fitted_once(options.fit_result, clock)),
            mock.patch.object(truth, "WALK_PHOTONS", 3000),
            mock.patch.object(truth, "COUNTS", (1000, 2000, 4000)),
            mock.patch.object(cost.seconds_per_megapixel, "__defaults__", (5, clock)),
            mock.patch.object(rich.progress, "Progress", Bar),
            mock.patch.object(matplotlib.figure.Figure, "savefig", describe),
            mock.patch.object(ConstrainedLayoutEngine, "execute", return_value=None),
        ]
        for each in patches:
            stack.enter_context(each)
        yield


def _fitted_once(real: Callable[..., TapsFit], clock: Clock) -> Callable[..., TapsFit]:
    """Fit an option of a choice to the same profile once; the clock goes on by every fit."""

    def fit(profile: Profile, method: str, **settings: Any) -> TapsFit:
        key = shared_work.contents(profile), method, tuple(sorted(settings.items()))
        begun = clock.asked
        if key in _FITS:
            found, asked = _FITS[key]
            times = [clock() for _ in range(asked)]
            return dataclasses.replace(found, seconds=sum(times[1::2]) - sum(times[::2]))
        found = real(profile, method, **settings)
        _FITS[key] = found, clock.asked - begun
        return found

    return fit


_FITS: dict[Any, tuple[TapsFit, int]] = {}


def _few_names(*, paper: bool = False, layered: bool = False) -> tuple[str, ...]:
    if layered:
        return ()
    return ("apple", "gone") if paper else ("apple", "chicken1")  # g is 0: solved in 1 s, not 20


def _some_of(
    real: Callable[..., tuple[Candidate, ...]], pixels: int, *given: Any, **settings: Any
) -> tuple[Candidate, ...]:
    """One kernel of every kind: all of them take 30 s."""
    return tuple(each for each in real(pixels, *given, **settings) if each.label in _TRIED)


def run(command: Command) -> Ran:
    """Run in a fresh copy of the folder of files."""
    charts: dict[bytes, list[str]] = {}
    with copied_files() as folder:
        with stand_ins(charts, compiled=command.compiled, few=command.few):
            if command.set_up is not None:
                command.set_up()
            before = contents(folder)
            with _environment(command), warnings.catch_warnings():
                status, stdout, stderr = _captured(command)
        after = contents(folder)
        written = {path: data for path, data in after.items() if before.get(path) != data}
        gone = tuple(sorted(before.keys() - after.keys()))
    return Ran(status, stdout, stderr, written, gone, charts, str(folder))


def _environment(command: Command) -> contextlib.AbstractContextManager[Any]:
    kept = {key: value for key, value in os.environ.items() if not key.startswith("SSSFIT_")}
    kept.pop("NO_COLOR", None)
    ours = {"COLUMNS": "100", "TERM": "xterm", **dict(command.environment)}
    return mock.patch.dict(os.environ, kept | ours, clear=True)


def _captured(command: Command) -> tuple[int, bytes, str]:
    """Exit status, stdout and stderr."""
    given = Path(command.stdin).read_bytes() if command.stdin else b""
    stdin = io.TextIOWrapper(io.BytesIO(given), encoding="utf-8")
    stdout = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    stderr = Terminal() if command.terminal else io.StringIO()
    with (
        mock.patch.object(sys, "stdin", stdin),
        mock.patch.object(sys, "stdout", stdout),
        mock.patch.object(sys, "stderr", stderr),
    ):
        try:
            main(shlex.split(command.line))
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else 1
        stdout.flush()
    return status, stdout.buffer.getvalue(), stderr.getvalue()
