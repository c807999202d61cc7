"""A small folder of every kind of file, the command line run in copies of it, and calls recorded.

The long works of the library (walks of 1e7 photons, comparisons, choices) are recorded with all
their arguments, defaults filled in, and then done in small: see ``STAND_INS``.
"""

import contextlib
import functools
import importlib
import inspect
import json
import os
import shlex
import shutil
import tempfile
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import NoneType
from typing import Any

import edited_skin
import numpy as np
import OpenImageIO
from angled import angled
from click.testing import CliRunner
from matplotlib.figure import Figure
from meshes import sphere
from remembered import once
from test_mci import file_text, run_text
from test_mco import BELOW, DR_CM, IN_LAYERS, N_R, REFLECTED, SPECULAR, block, mco_text

from sssfit import compare, simulate
from sssfit import fit as fit_room
from sssfit import report as report_room
from sssfit.choose import choice as choose
from sssfit.cli import cli
from sssfit.compare import budget, convergence, pareto, pictures, runner, sheet
from sssfit.compare.candidates import Candidate, candidates
from sssfit.compare.presets import PresetComparison, compare_presets
from sssfit.crowd.frame import measure_frame
from sssfit.crowd.record import CrowdFrame
from sssfit.crowd.row import Row
from sssfit.crowd.runner import savings_of
from sssfit.crowd.table import ALL, SpeedUpTable
from sssfit.errors import SssfitWarning
from sssfit.fit import fit_gaussians, fit_svd
from sssfit.formats.csv import csv_text
from sssfit.formats.pictures import load_image, save_image
from sssfit.kernel import SeparableKernel, Stage, Taps
from sssfit.material import Material, parse_material
from sssfit.methods import PRESETS
from sssfit.profile import Profile
from sssfit.report import Report
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import Checkpoint, inversion, simulate_montecarlo
from sssfit.simulate._finished import DEFAULT_PHOTONS
from sssfit.stability import Curve, Panel, Stability
from sssfit.stability.curve import Axis
from sssfit.sweep import Estimate, Plan

WAX = (
    'name = "wax"\nsource = "a test"\neta = 1.3\ng = 0\n'
    "sigma_a_per_mm = [0.03, 0.2, 0.6]\nsigma_s_per_mm = [0.7, 0.8, 0.9]\n"
)
LAYERS = (
    'name = "plate"\nchannels = ["R", "G", "B"]\neta_above = 1.1\neta_below = 1.2\n'
    "[[layers]]\neta = 1.4\ng = 0.5\nsigma_a_per_mm = [0.1, 0.2, 0.3]\n"
    "sigma_s_per_mm = [4.0, 5.0, 6.0]\nthickness_mm = 0.5\n"
    "[[layers]]\neta = 1.3\ng = 0.1\nsigma_a_per_mm = [0.2, 0.4, 0.5]\n"
    "sigma_s_per_mm = [1.0, 1.5, 1.25]\nthickness_mm = 1.5\n"
)
POINTS = (
    'material = "wax.toml"\nmethod = "burley"\n[grid]\ndr_mm = 0.5\nradius_mm = 6.0\n'
    '[[axes]]\nkey = "eta"\nvalues = [1.3, 1.5]\n'
    '[[axes]]\nkey = "albedo"\nfrom = 0.5\nto = 0.9\ncount = 3\n'
)
PHOTONS, DR_MM, RADIUS_MM = 4000, 0.2, 6.0
GRID = f"--dr {DR_MM} --radius {RADIUS_MM}"
FOREIGN = "mine\n"  # what a file of somebody else's holds
LOOKS = ("blender", "hdrp", "iryoku", "community-shaders", "babylon", "gltf")  # of presets
ENDINGS = ("npz", "json", "exr", "png", "md", "csv", "toml", "hlsl", "html")


@functools.cache
def wax() -> Material:
    return parse_material(WAX, "wax.toml")


@functools.cache
def plate() -> Material:
    return parse_material(LAYERS, "plate.toml")


@functools.cache
def profile() -> Profile:
    """A walk: noise, energy beyond the grid, and three channels that differ in everything."""
    return simulate_montecarlo(wax(), photons=PHOTONS, dr_mm=DR_MM, radius_mm=RADIUS_MM)


@functools.cache
def plate_profile() -> Profile:
    return simulate_montecarlo(plate(), photons=PHOTONS, dr_mm=DR_MM, radius_mm=RADIUS_MM)


@functools.cache
def kernel() -> SeparableKernel:
    """Its energy is not the profile's, so that drifts of the channels differ."""
    return fit_svd(profile(), rank=2, energy="keep", mm_per_pixel="profile").kernel


@functools.cache
def gaussians() -> SeparableKernel:
    """A kernel that says what goes through a thin body."""
    return quietly(fit_gaussians, profile(), terms=2, mm_per_pixel="profile").kernel


@functools.cache
def taps() -> Taps:
    """A cascade by hand, on the pixels of the kernels."""
    stages = [
        Stage(level, "pair", np.array([offset]), np.array([[0.5] * 3, [0.25] * 3]))
        for level, offset in ((0, 0.25), (1, 0.7))
    ]
    return Taps(
        method="cascade",
        mm_per_pixel=DR_MM,
        channels=profile().channels,
        chained=True,
        stages=tuple(stages),
        blend=np.array([[0.1, 0.2, 0.1], [0.2, 0.1, 0.1], [0.3, 0.2, 0.1]]),
        errors={"spectral": np.zeros(3), "energy": np.zeros(3)},
        meta={},
    )


@functools.cache
def picture() -> np.ndarray:
    return np.random.default_rng(3).random((12, 9, 3)).astype(np.float32)


def write_layers(path: Path) -> None:
    """An EXR of two layers and alpha; nothing in it says how large its pixels are."""
    near, far = picture(), picture()[::-1]
    alpha = (np.arange(picture().shape[1]) < 6).astype(np.float32)
    pixels = np.dstack([near, far, np.broadcast_to(alpha, near.shape[:2])])
    height, width, count = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, count, "float")
    names = [f"{layer}.{each}" for layer in ("near", "far") for each in "RGB"]
    spec.channelnames = (*names, "far.A")
    writer = OpenImageIO.ImageOutput.create(str(path))
    assert writer.open(str(path), spec)
    assert writer.write_image(np.ascontiguousarray(pixels))
    writer.close()


@functools.cache
def files() -> Path:
    """The folder that every run begins with a copy of."""
    folder = Path(tempfile.mkdtemp(prefix="sssfit-world-"))
    (folder / "wax.toml").write_text(WAX)
    (folder / "plate.toml").write_text(LAYERS)
    (folder / "points.toml").write_text(POINTS)
    plate_profile().save(folder / "plate.profile.npz")
    angled(profile()).save(folder / "angles.profile.npz")
    profile().save(folder / "wax.profile.npz")
    taps().save(folder / "wax.taps.json")
    gaussians().save(folder / "wax.gaussians2.kernel.json")
    kernel().save(folder / "wax.svd2.kernel.json")  # the newest of both
    save_image(folder / "mine.exr", picture(), mm_per_pixel=DR_MM)
    save_image(folder / "bare.exr", picture())
    write_layers(folder / "layers.exr")
    second = run_text("b.mco", layer="1.4 1 5 0 1E8")
    (folder / "two.mci").write_text(file_text(run_text("a.mco"), second))
    (folder / "r.mco").write_text(mco_text(name="r.mco"))
    (folder / "g.mco").write_text(mco_text(name="g.mco", **green_blocks()))
    (folder / "table.csv").write_text(csv_text(profile()))
    for name, head in (("bare", "r_mm"), ("plain", "r")):
        (folder / f"{name}.csv").write_text(
            f"{head},R,G\n.5,.02,.015\n1.5,.01,.005\n2.5,.002,.001\n"
        )
    for ending in ENDINGS:
        (folder / f"foreign.{ending}").write_text(FOREIGN)
    (folder / "out").mkdir()
    return folder


def green_blocks() -> dict[str, str]:
    """Those of an .mco that reflects half of what the other does, and transmits the rest."""
    reflected, below = 0.5 * REFLECTED, BELOW + 0.5 * REFLECTED
    area_cm2 = 2 * np.pi * (np.arange(N_R) + 0.5) * DR_CM**2
    rat = [SPECULAR, reflected.sum(), IN_LAYERS.sum(), below.sum()]
    return {
        "RAT": block("RAT", rat, "{:<14.6G} \t#which one [-]"),
        "Rd_r": block("Rd_r", reflected / area_cm2),
        "Tt_r": block("Tt_r", below / area_cm2),
    }


@dataclass(frozen=True)
class Ran:
    """What a command left: its exit status, what it said, its files, and the calls it made."""

    status: int
    stdout: str
    stderr: str
    written: dict[str, bytes]
    calls: tuple[Any, ...] = ()
    raw: bytes = b""  # stdout, where a file goes there

    @property
    def figures(self) -> dict[str, Any]:
        """The JSON object."""
        return json.loads(next(line for line in self.stdout.splitlines() if line[:1] == "{"))

    @property
    def text(self) -> str:
        """What people read: all but the JSON object."""
        return "\n".join(line for line in self.stdout.splitlines() if line[:1] != "{")

    def loaded(self, kind: Any, ending: str) -> Any:
        """The one file written of an ending, read by ``kind``."""
        (name,) = [each for each in self.written if each.endswith(ending)]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(name).name
            path.write_bytes(self.written[name])
            return kind(path)

    @property
    def profile(self) -> dict[str, Any]:
        return content_of(self.loaded(Profile.load, ".npz"))

    @property
    def kernel(self) -> Any:
        return weights_of(self.loaded(SeparableKernel.load, ".kernel.json"))

    @property
    def taps(self) -> Any:
        found = self.loaded(Taps.load, ".taps.json")
        return [found.structure, found.mm_per_pixel, found.blend]

    @property
    def picture(self) -> np.ndarray:
        return self.loaded(load_image, ".exr").pixels


def content_of(made: Profile) -> dict[str, Any]:
    """The figures of a profile."""
    names = ("r_edges_mm", "annulus_energy", "beyond_grid", "annulus_transmittance", "channels")
    return {name: getattr(made, name) for name in names}


def weights_of(made: SeparableKernel) -> list[Any]:
    """The figures of a kernel."""
    return [made.mm_per_pixel, made.signs, made.weights, made.scale]


@functools.cache
def once_each(function: Any) -> Any:
    """The function, done once for the same arguments."""
    return once(function, aside=ASIDE)


CALLS: list[Any] = []
_within: list[str] = []  # the recorded call that is running
ASIDE = {"progress", "stop", "clock"}  # arguments that only report, stop or measure


@functools.cache
def run(command: str, *, both: bool = False) -> Ran:
    """Run a command in a copy of `files`; ``both`` prints the JSON object and then the text."""
    first = first_contents()  # read before a command could change what the copies are linked to
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(files(), folder, dirs_exist_ok=True, copy_function=os.link)
        CALLS.clear()
        with contextlib.chdir(folder), warnings.catch_warnings(), finishing(both):
            warnings.simplefilter("ignore", SssfitWarning)
            ended = CliRunner().invoke(cli, shlex.split(command))
        if ended.exception is not None and not isinstance(
            ended.exception, (SystemExit, ValueError)
        ):
            raise ended.exception
        after = contents(folder)
    changed = {name: data for name, data in after.items() if first.get(name) != data}
    stdout = ended.stdout_bytes.decode(errors="replace")
    calls = tuple(CALLS)
    return Ran(ended.exit_code, stdout, ended.stderr, changed, calls, ended.stdout_bytes)


@functools.cache
def first_contents() -> dict[str, bytes]:
    """What every run begins with."""
    return contents(files())


def contents(folder: Path) -> dict[str, bytes]:
    """Every file by its name; a store of a sweep counts as one."""
    found: dict[str, bytes] = {}
    paths = [f"{above}/{name}" for above, _, names in os.walk(folder) for name in names]
    for path in sorted(paths, key=lambda each: each.split("/")):
        before, store, _ = path.removeprefix(f"{folder}/").partition(".zarr/")
        name = before + store.removesuffix("/")
        found[name] = found.get(name, b"") + Path(path).read_bytes()
    return found


@contextlib.contextmanager
def finishing(both: bool):
    """Let every verb end with its JSON object and its text, of one and the same run."""
    if not both:
        yield
        return
    from sssfit.cli import _output

    real = _output.finish

    def twice(common, figures, text):
        for as_json in (True, False):
            real(replace(common, json=as_json, quiet=False), figures, text)

    modules = [each for name, each in cli_modules() if getattr(each, "finish", None) is real]
    for each in modules:
        each.finish = twice
    try:
        yield
    finally:
        for each in modules:
            each.finish = real


def cli_modules():
    import sys

    return [(k, v) for k, v in list(sys.modules.items()) if k.startswith("sssfit.cli")]


# What the library is called with


def told(value: Any) -> Any:
    """An argument as it can be compared."""
    if isinstance(value, Profile):
        return value.material_name, value.meta.get("method"), float(value.annulus_energy.sum())
    if isinstance(value, Material):
        return value.name
    if isinstance(value, Plan):
        return value.sha256
    if isinstance(value, Scene):
        light = value.irradiance
        mask = b"" if value.mask is None else value.mask.tobytes()
        return value.name, light.shape, value.mm_per_pixel, zlib.crc32(light.tobytes() + mask)
    if isinstance(value, Checkpoint):
        return value.every_seconds
    if isinstance(value, Candidate):
        return value.label
    if isinstance(value, (list, tuple)):
        return [told(each) for each in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    return value if isinstance(value, (str, int, float, NoneType)) else type(value).__name__


def recorded(real, stand_in):
    """A function that notes what it was called with, in full, and does its work in small."""
    signature = inspect.signature(real)

    @functools.wraps(real)
    def call(*arguments, **keywords):
        bound = signature.bind(*arguments, **keywords)
        bound.apply_defaults()
        noted = {key: told(each) for key, each in bound.arguments.items() if key not in ASIDE}
        if noted.get("photons", 0) is None and noted.get("target_error") is None:
            noted["photons"] = DEFAULT_PHOTONS  # what None stands for
        # A stand-in computes a result once and hands it on, so what it calls itself is not told.
        if _within:
            return stand_in(real, dict(bound.arguments))
        CALLS.append((real.__name__, noted))
        _within.append(real.__name__)
        try:
            return stand_in(real, dict(bound.arguments))
        finally:
            _within.pop()

    return call


def called(path: str, *arguments: Any, **keywords: Any) -> tuple[Any, ...]:
    """What is recorded of a call of the library by a user of Python."""
    CALLS.clear()
    module, function = path.rsplit(".", 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        getattr(importlib.import_module(module), function)(*arguments, **keywords)
    return tuple(CALLS)


def _unrecorded(function: Any) -> Any:
    """The real function, whether it is being recorded or not."""
    return getattr(function, "__wrapped__", function)


class Batches:
    """In place of a cluster; the walk itself is done here."""

    def __init__(self, scheduler):
        self.scheduler = scheduler

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


def few_photons(real, given):
    given["elsewhere"] = None
    if given["target_error"] is None:
        given["photons"] = min(given["photons"] or PHOTONS, PHOTONS)
    return real(given.pop("materials"), **given)


@functools.cache
def exact_profile(name: str = "wax") -> Profile:
    """An exact profile, that of wax whatever it is called."""
    made = _unrecorded(simulate.simulate_exact)(wax(), dr_mm=0.25, radius_mm=12.0)
    made.meta["material"]["name"] = name
    return made


@functools.cache
def inverted(light: str) -> Material:
    real = _unrecorded(inversion.material_from_reflectance)
    given = {"name": "lard", "channels": ["R", "G", "B"], "light": light}
    return real([0.4, 0.2, 0.1], [1.3, 0.9, 0.7], 1.3, **given)


@functools.cache
def choice() -> Any:
    """One small choice, whatever is asked for."""
    scene = make_scene("edge", height=48, width=48, mm_per_pixel=0.5)
    return _unrecorded(choose.choose)(wax(), mm_per_pixel=0.5, scene=scene, tolerance=0.8)


def small_choice(_real, given):
    for step in choice().steps if given["progress"] else ():
        given["progress"](step)
    return OTHER_CHOICES.get(given["tolerance"], choice)()


def under_a_pixel() -> Any:
    return choose.Choice(choice().profile, 30.0, 7.0, "p95")


def head_under_a_pixel() -> Any:
    return choose.Choice(choice().profile, 30.0, 7.0, "mean", scenes=choice().scenes)


def no_blur_is_within() -> Any:
    nothing = replace(choice().steps[0], within=True)
    given = {"scenes": choice().scenes, "steps": (nothing,), "chosen": nothing}
    return choose.Choice(choice().profile, 0.5, 9.0, "p99", **given)


def other_reasons() -> Any:
    """What the small choice does not come to: a wider view, a budget, too few photons."""
    found = choice()
    photons = replace(
        found.photons,
        photons=None,
        counts=(10_000, 100_000),
        errors=(1.75, 1.25),
        seconds=(0.5, 1.5),
        truth_method="montecarlo",
    )
    return replace(
        found,
        tolerance=found.tolerance + 0.0625,
        cheaper=replace(found.cheaper, error=0.5, within=False),
        dearer=replace(found.dearer, within=False),
        fetches=31.5,
        passes=18,
        photons=photons,
        unfitted=("cascade 1", "cascade *"),
    )


# By the tolerance that is asked for.
OTHER_CHOICES = {
    6.0: under_a_pixel,
    7.0: head_under_a_pixel,
    8.0: no_blur_is_within,
    9.0: other_reasons,
}


@functools.cache
def comparison() -> Any:
    """One small comparison, whatever is asked for."""
    labels = ("pre-integrated", "svd 1", "svd 2", "svd 2, kept", "gaussians 1")
    some = [each for each in candidates(61) if each.label in labels]
    scenes = [
        make_scene(name, height=24, width=32, mm_per_pixel=0.5, **own)
        for name, own in (("disk", {}), ("edge", {"angle_degrees": 20.0}))
    ]
    real = _unrecorded(pareto.compare_kernels)
    return real(profile(), scenes, support_mm=3.0, candidates=some)


def small_comparison(_real, given):
    """That of wax; another material has errors half as large again, so that they can be told."""
    if given["profile"].material_name == "wax":
        return comparison()
    rows = [
        replace(
            row, delta_e_2000_mean=1.5 * row.delta_e_2000_mean, relative_l2=1.5 * row.relative_l2
        )
        for row in comparison().rows
    ]
    return replace(comparison(), profile=given["profile"], rows=tuple(rows))


@functools.cache
def budgets(terms: int = 2) -> Any:
    """The budget of one small picture, by the number of terms."""
    scene = make_scene("disk", height=24, width=24, mm_per_pixel=0.5)
    real = _unrecorded(budget.error_budgets)
    return real(wax(), [scene], photons=PHOTONS, settings={"rank": terms})


def rank_of(given: Mapping[str, Any]) -> int:
    """The rank that was asked for; 3 where the library is to choose."""
    return (given["settings"] or {}).get("rank", 3)


@functools.cache
def models() -> Any:
    return _unrecorded(compare.compare_models)(wax(), walk=profile())


@functools.cache
def small_sheet() -> Any:
    import pytest

    real = _unrecorded(sheet.compute_sheet)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "PIXELS", 13)  # of the pictures that a close fit looks at
        patch.setattr("sssfit.fit.artist._MAX_EVALUATIONS", 60)
        return real(profile(), mm_per_pixel=0.5, pixels=24, most_terms=1)


@functools.cache
def small_editing() -> Any:
    return _unrecorded(edited_skin.compute_editing)(height=24, width=24, mm_per_pixel=5.0)


@functools.cache
def small_convergence() -> Any:
    """Made up: resolutions of the exact solver take seconds."""
    walks = tuple(
        convergence.WalkRun(photons, 1 + k, 0.125 * (k + 1), error)
        for k, (photons, error) in enumerate(((1000, 0.031), (2000, 0.027), (4000, 0.0142)))
    )
    line = convergence.fit_line([each.photons for each in walks], [each.error for each in walks])
    exact = (
        convergence.ExactRun(1e-2, 0.51, 3.1e-3, 2.2e-3),
        convergence.ExactRun(1e-4, 1.73, 4.3e-5, None),
    )
    return convergence.Convergence(exact_profile(), walks, exact, line)


def stresses(name: str) -> Stability:
    """Made up: real ones take seconds."""
    photons = np.array([1e3, 1e4, 1e5])
    falling = Curve("svd 3", photons, np.array([5.2, 1.9, 0.6]), advice="more photons")
    refused = Curve("gaussians 4", photons, np.array([np.inf, 2.0, 1.5]), advice="fewer Gaussians")
    axis = Axis("photons", mild=1e5, form=".2g")
    panel = Panel("noise", "noise", axis, "Delta E", 1.0, (falling, refused), "colours change")
    return Stability(name, 0.5, (panel,), ("Left out grid: no material.",), seed=3)


def small_sequence(real, given):
    """Eight frames of twelve by eight pixels, by what needs no fit, whatever is asked for."""
    small = {"size": (8, 12), "length": 8, "only": ["without", "ahead", "fixed"], "layer": None}
    call = real if given["frames"] else once_each(real)  # frames have to be written
    return call(**given | small | {"source": profile(), "irradiance": "edge"})


@functools.cache
def all_presets() -> PresetComparison:
    """What some engines show of a profile without coefficients, on one small picture.

    One of every kind of look: a medium is solved for a second each.
    """
    import pytest

    compute = _unrecorded(compare_presets)
    edge = make_scene("edge", height=16, width=24, mm_per_pixel=0.3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sssfit.compare.presets.PRESETS", {name: PRESETS[name] for name in LOOKS})
        return quietly(compute, profile(), [edge], threads=1)


def few_seeds(real, given):
    return once_each(real)(seeds=2, seed=given["seed"])


def small_row(given) -> Row:
    """Spheres in place of heads, on few pixels."""
    kept = {key: given[key] for key in ("head_units", "spacing_units", "fov_degrees")}
    heads, distance = given.get("heads") or 1, given.get("distance_units") or 10.0
    return Row(heads, distance, resolution=(20, 32), mesh=sphere(rows=8, columns=16), **kept)


def on_the_clock(frame: CrowdFrame) -> CrowdFrame:
    """The frame with other times at each stage, but always the same."""
    work = {
        name: replace(each, seconds={stage: 0.25 + 0.125 * (j + 3 * k) for k, stage in named})
        for j, (name, each) in enumerate(frame.work.items())
        for named in [list(enumerate(each.seconds))]
    }
    return replace(frame, work=work)


def small_frame(_, given) -> CrowdFrame:
    return once_each(made_frame)(**given)


def made_frame(**given: Any) -> CrowdFrame:
    savings = savings_of(*(given[key] for key in ("savings", "culled_by", "margin")))
    return on_the_clock(
        measure_frame(small_row(given), given["kernel"], savings=savings, map_size=32)
    )


def small_table(_, given) -> SpeedUpTable:
    return once_each(made_table)(**given)


def made_table(**given: Any) -> SpeedUpTable:
    """Two by two cells, one of them published."""
    frames = [
        tuple(
            on_the_clock(
                measure_frame(
                    small_row({**given["geometry"], "heads": heads, "distance_units": distance}),
                    given["kernel"],
                    savings=ALL,
                    map_size=32,
                )
            )
            for distance in (5.0, 7.0)
        )
        for heads in (1, 3)
    ]
    return SpeedUpTable(tuple(frames))


@functools.cache
def small_report() -> Report:
    """One kernel on pictures of few pixels, whatever is asked for."""
    make = _unrecorded(report_room.make_report)
    return make(profile(), named=[("hand", taps())], only=["disk"], side=16, threads=1)


@functools.cache
def small_finished() -> dict[str, Any]:
    """Its page, which no cache keeps."""
    made = small_report()
    return {"page": report_room.page(made), "words": made.text(), "figures": made.figures()}


def small_page(*_) -> str:
    """The index of one material."""
    return _unrecorded(report_room.library_page)([wax()], threads=1)


def on_this_thread(real, given):
    """A sweep without further processes or a cluster, whatever is asked for."""
    return real(**given | {"threads": 1, "scheduler": None})


def made_up_estimate(_, given) -> Estimate:
    return Estimate(given["plan"], 2, 1.5, 30.25, 0.75, 3, 12.5)


def blank(*_) -> Figure:
    """A chart with nothing on it: what charts look like is tested where they are made."""
    return Figure(figsize=(0.1, 0.1))


_CHARTS = (
    *("profile", "kernel", "material", "pareto", "budget", "sheet", "models", "guide", "spectrum"),
    *("stability", "moving_light", "variates", "speed_up", "presets", "frequency", "angles"),
)
STAND_INS = {
    "sssfit.simulate.simulate_montecarlo_many": few_photons,
    "sssfit.simulate.truth.true_profile": (lambda _, given: exact_profile(given["material"].name)),
    "sssfit.simulate.simulate_exact_many": (
        lambda _, given: [exact_profile(each.name) for each in given["materials"]]
    ),
    "sssfit.simulate.inversion.material_from_reflectance": (
        lambda _, given: inverted(given["light"])
    ),
    "sssfit.choose.choice.choose": small_choice,
    "sssfit.compare.compare_kernels": small_comparison,
    "sssfit.compare.budget.error_budgets": lambda _, given: budgets(rank_of(given)),
    "sssfit.compare.drawing.compare_models": lambda *_: models(),
    "sssfit.compare.presets.compare_presets": lambda *_: all_presets(),
    "sssfit.compare.sheet.compute_sheet": lambda *_: small_sheet(),
    "sssfit.stability.stability": lambda _, given: stresses(given["source"].name),
    "sssfit.motion.runner.run_sequence": small_sequence,
    "sssfit.motion.table.measure_table": few_seeds,
    "sssfit.crowd.runner.six_gaussians": lambda *_: gaussians(),
    "sssfit.crowd.runner.frame_of": small_frame,
    "sssfit.crowd.runner.table_of": small_table,
    "sssfit.sweep.sweep_to_store": on_this_thread,
    "sssfit.sweep.estimate": made_up_estimate,
    "sssfit.report.finished_page": lambda *_: small_finished(),
    "sssfit.report.library_page": small_page,
    **{f"sssfit.chart.{kind}.{kind}_figure": blank for kind in _CHARTS},
}


@contextlib.contextmanager
def recording():
    """Record the calls of the long works and do them in small."""
    import pytest

    with pytest.MonkeyPatch.context() as patch:
        for name, stand_in in STAND_INS.items():
            module, function = name.rsplit(".", 1)
            owner = importlib.import_module(module)
            call = recorded(getattr(owner, function), stand_in)
            patch.setattr(owner, function, call)
            if hasattr(runner, function):  # it has imported them by now
                patch.setattr(runner, function, call)
        for name in ("fit_separable", "fit_taps"):  # the library fits what a command has fitted
            patch.setattr(fit_room, name, once_each(getattr(fit_room, name)))
        # Its times are made up, so nothing has to be warm; it took half of each frame.
        patch.setattr("sssfit.crowd.frame._warm_up", lambda *_, **__: None)
        patch.setattr("sssfit.sweep.cluster.Batches", Batches)
        for module in ("sssfit.material", "sssfit.simulate.runner"):
            patch.setattr(
                f"{module}.material_names",
                lambda *, paper=False, layered=False: (
                    ("marble",) if paper else () if layered else ("skin1", "marble")
                ),
            )
        yield


def quietly(function, *arguments: Any, **settings: Any) -> Any:
    """Call what may warn of noisy profiles."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SssfitWarning)
        return function(*arguments, **settings)
