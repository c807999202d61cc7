"""A row for every option of every verb: a value other than its default, and the library's result.

A new option takes one row in the dict of its verb; `test_cli_options` reads the options from
click's own objects and fails where one has no row. Options that all verbs share are in
``COMMANDS``, ``SEEDS``, ``THREADS`` and ``VERBOSE``.
"""

import contextlib
import functools
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cli_world as world
import numpy as np
from cli_world import DR_MM, GRID, PHOTONS, RADIUS_MM, Ran, called, kernel, picture, profile, wax

from sssfit import fit
from sssfit.compare import view_kernel
from sssfit.compare.evaluate import evaluate, evaluate_in_screen_space
from sssfit.compare.pictures import picture_error
from sssfit.export import json_document, kernel_text
from sssfit.export.lut import lut_bytes
from sssfit.export.presets import import_preset, preset_of, preset_text
from sssfit.formats.csv import csv_text, load_csv
from sssfit.formats.mci import load_mci
from sssfit.formats.mco import join_channels, load_mco
from sssfit.formats.pictures import load_image
from sssfit.material import load_material
from sssfit.measure.difference import difference_map, magnified_difference
from sssfit.measure.score import auto_exposure
from sssfit.methods import FITS as METHODS
from sssfit.methods import PRESETS, SEPARABLE
from sssfit.profile.beam import parse_beam, under_beam
from sssfit.render.bloom import bloomed
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.render.transmittance import with_transmitted
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import Checkpoint, simulate_burley, simulate_dipole
from sssfit.sweep import load_plan


@dataclass(frozen=True)
class Row:
    """One option.

    ``command`` lacks the option. ``given`` sets it to a value other than its default; where it
    begins with the verb, it is a whole command. ``seen`` of that run has to equal ``library``, and
    has to differ from ``seen`` without the option. ``default`` is the documented default as it
    would be typed, or a function that finds it: giving it changes nothing. ``words`` is how the
    help describes the default where it does not name a value.
    """

    command: str
    given: str
    seen: Callable[[Ran], Any]
    library: Callable[[], Any]
    default: str | Callable[[], str] = ""
    words: str = ""

    def typed_default(self) -> str:
        return self.default if isinstance(self.default, str) else self.default()


# What is looked at


def made_profile(ran: Ran) -> Any:
    return ran.profile


def made_kernel(ran: Ran) -> Any:
    return ran.kernel


def made_taps(ran: Ran) -> Any:
    """The table of taps, None where a dense kernel was made."""
    return ran.taps if any(each.endswith(".taps.json") for each in ran.written) else None


def made_picture(ran: Ran) -> Any:
    return ran.picture


def calls(ran: Ran) -> Any:
    """What the library was called with, but for charts."""
    return tuple(each for each in ran.calls if not each[0].endswith("_figure"))


def drawn(ran: Ran) -> Any:
    """What a chart was drawn of."""
    return [noted for name, noted in ran.calls if name.endswith("_figure")]


def names(ran: Ran) -> Any:
    return sorted(ran.written)


def status(ran: Ran) -> Any:
    return ran.status


def fields(*keys: str) -> Callable[[Ran], Any]:
    """Figures of the JSON object."""
    return lambda ran: [ran.figures[key] for key in keys]


def is_written(*endings: str) -> Callable[[Ran], Any]:
    """The files that begin as they should."""
    begins = {
        "png": b"\x89PNG",
        "svg": b"<?xml",
        "md": b"<!-- sssfit.stability/1 -->",
        "csv": b"# sssfit.table/1\nmaterial,",
        "npz": b"PK",
    }
    return lambda ran: [
        name
        for name, data in sorted(ran.written.items())
        if name.endswith(endings) and data.startswith(begins[name.rsplit(".", 1)[1]])
    ]


# simulate

_WALK = f"simulate wax.toml {GRID} --photons {PHOTONS} -o x.profile.npz"
_BURLEY = f"simulate wax.toml --method burley {GRID}"


def _walk(*materials: Any, every: float = 30.0, **settings: Any) -> Any:
    """The recorded call of the library, which is told of the grid and 4000 photons at least."""
    given = {"photons": PHOTONS, "dr_mm": DR_MM, "radius_mm": RADIUS_MM} | settings
    name = "sssfit.simulate.simulate_montecarlo_many"
    return called(
        name, list(materials or [wax()]), checkpoint=Checkpoint(Path("x"), every), **given
    )


def _content(made: Any) -> Any:
    return world.content_of(made)


_GRID = {"dr_mm": DR_MM, "radius_mm": RADIUS_MM}

SIMULATE = {
    "--scheduler": Row(
        _WALK,
        "--scheduler local:2",
        calls,
        lambda: _walk(elsewhere=world.Batches("local:2")),
        words="--threads of this process",
    ),
    "--all": Row(
        _BURLEY,
        f"simulate --all --method burley {GRID}",
        names,
        lambda: ["marble.burley.profile.npz", "skin1.burley.profile.npz"],
    ),
    "--paper": Row(
        _BURLEY,
        f"simulate --paper --method burley {GRID} -o out",
        names,
        lambda: ["out/marble.burley.profile.npz"],
    ),
    "--method": Row(
        f"simulate wax.toml {GRID} -o x.profile.npz",
        "--method dipole",
        made_profile,
        lambda: _content(simulate_dipole(wax(), **_GRID)),
        default="montecarlo",
    ),
    "--run": Row(
        "simulate two.mci -o out",
        "simulate two.mci --run 2",
        names,
        lambda: [f"{load_mci(world.files() / 'two.mci')[1].material.name}.profile.npz"],
    ),
    "--photons": Row(
        f"simulate wax.toml {GRID}", "--photons 3000", calls, lambda: _walk(photons=3000), "1e7"
    ),
    "--target-error": Row(_WALK, "--target-error 20%", calls, lambda: _walk(target_error=0.2)),
    "--angles": Row(_WALK, "--angles 6", calls, lambda: _walk(angles=6)),
    "--numerical-aperture": Row(
        _WALK, "--numerical-aperture .4", calls, lambda: _walk(numerical_aperture=0.4)
    ),
    "--tolerance": Row(
        f"simulate wax.toml --method exact {GRID}",
        "--tolerance 2%",
        calls,
        lambda: called("sssfit.simulate.simulate_exact_many", [wax()], tolerance=0.02, **_GRID),
        default="0.01%",
    ),
    "--similarity": Row(
        f"simulate wax.toml --method exact {GRID}",
        "--similarity",
        calls,
        lambda: called("sssfit.simulate.simulate_exact_many", [wax()], similarity=True, **_GRID),
    ),
    "--mapping": Row(
        _BURLEY,
        "--mapping diffuse",
        made_profile,
        lambda: _content(simulate_burley(wax(), mapping="diffuse", **_GRID)),
        default="perpendicular",
    ),
    "--dr": Row(
        "simulate wax.toml --method burley",
        "--dr .25",
        made_profile,
        lambda: _content(simulate_burley(wax(), dr_mm=0.25)),
        default=f"{float(wax().layers[0].mean_free_path_mm.min()) / 20!r}",
        words="MFP_min / 20; deon-skin: 0.008",
    ),
    "--beam": Row(
        _BURLEY,
        "--beam flat:0.8",
        made_profile,
        lambda: _content(under_beam(simulate_burley(wax(), **_GRID), parse_beam("flat:0.8"))),
    ),
    "--radius": Row(
        "simulate wax.toml --method burley",
        "--radius 7.5",
        made_profile,
        lambda: _content(simulate_burley(wax(), radius_mm=7.5)),
        default=f"{32 * float(wax().layers[0].mean_free_path_mm.max())!r}",
        words="32 MFP_max; deon-skin: 17.2",
    ),
    "--output": Row(
        _BURLEY,
        "-o x.profile.npz",
        names,
        lambda: ["x.profile.npz"],
        default="wax.burley.profile.npz",
        words="MATERIAL.profile.npz, MATERIAL.METHOD.profile.npz",
    ),
    "--checkpoint-every": Row(
        _WALK, "--checkpoint-every 7", calls, lambda: _walk(every=7.0), default="30.0"
    ),
    # The profile is there, and of this very walk.
    "--resume": Row(
        f"simulate wax.toml {GRID} --photons {PHOTONS} --json",
        "--resume",
        lambda ran: (ran.figures["finished_before"], names(ran)),
        lambda: (True, []),
    ),
    "--force": Row(
        f"{_BURLEY} -o foreign.npz", "--force", is_written("npz"), lambda: ["foreign.npz"]
    ),
}

# fit


def _fit(method: str, **settings: Any) -> Callable[[], Any]:
    return lambda: world.weights_of(
        world.quietly(fit.fit_result, profile(), method, **settings).kernel
    )


def _fitted(
    option: str, value: str, method: str, default: str = "", words: str = "", **own: Any
) -> Row:
    """An option of a method, by what the fit makes of it."""
    command = f"fit wax.profile.npz --method {method} --mm-per-pixel .4"
    library = _fit(method, mm_per_pixel=0.4, **own)
    return Row(command, f"{option} {value}".strip(), made_kernel, library, default, words)


def _tapped(option: str, value: str, default: str = "", **own: Any) -> Row:
    """An option of a cascade, by the table of taps; without others the first is a quick one."""

    def made() -> Any:
        found = fit.fit_taps(profile(), mm_per_pixel=0.6, **(usual | own)).kernel
        return [found.structure, found.mm_per_pixel, found.blend]

    free = {"passes", "fetches", "full_resolution"} & own.keys()
    usual: dict[str, Any] = {"passes": 4} if free else {"stages": "1-1"}
    if "still" in own:  # where a picture is halved
        usual = {"stages": "1|1"}
    command = "fit wax.profile.npz --method cascade --mm-per-pixel .6"
    typed = "".join(f" --{key} {each}" for key, each in usual.items())
    return Row(command + typed, f"{option} {value}".strip(), lambda ran: ran.taps, made, default)


def _thinned(option: str, value: str, method: str, **own: Any) -> Row:
    """An option of the taps of a dense kernel, by the table of taps."""

    def made() -> Any:
        settings = {"mm_per_pixel": 0.4, "normalize": False, **own}
        found = world.quietly(fit.fit_result, profile(), method, **settings).kernel
        return [found.structure, found.mm_per_pixel, found.blend]

    command = f"fit wax.profile.npz --method {method} --mm-per-pixel .4"
    *before, name = option.split(" --")
    given = f"--{name.removeprefix('--')} {value}"
    usual = f" {before[0]}" if before else ""
    words = "cumulative" if before else "24 for disk, 9 for rotated"
    return Row(command + usual, given, made_taps, made, words=words)


def _relative(option: str, value: str, method: str, words: str = "", **own: Any) -> Row:
    """An option of a relative of cascades, by the table of taps."""
    usual: dict[str, Any] = {} if own.keys() & {"stages"} else {"stages": "1-1"}
    if method == "rotated":
        usual = {"taps": 3}

    def made() -> Any:
        found = fit.fit_taps(profile(), method, mm_per_pixel=0.6, **(usual | own)).kernel
        return [found.structure, found.mm_per_pixel, found.blend]

    command = f"fit wax.profile.npz --method {method} --mm-per-pixel .6"
    typed = "".join(f" --{key} {each}" for key, each in usual.items())
    return Row(command + typed, f"{option} {value}", lambda ran: ran.taps, made, words=words)


def _sampled_disk() -> Any:
    found = fit.fit_taps(profile(), "disk", taps=5, mm_per_pixel=0.4).kernel
    return [found.structure, found.mm_per_pixel, found.blend]


_HAND = {"near_mm2": [0.2, 0.1, 0.05], "far_mm2": [2.0, 1.0, 0.7], "weight": [0.4, 0.5, 0.6]}
_SKIN = {"width": 0.3, "strength": [0.8, 0.7, 0.75], "falloff": [0.6, 0.2, 0.1]}


def _by_hand(option: str, other: str, method: str, usual: dict[str, Any], **own: Any) -> Row:
    """A value set by hand: all of them go together, so the others stand beside it."""
    typed = {
        key.removesuffix("_mm2"): str(value).strip("[]").replace(" ", "")
        for key, value in usual.items()
    }
    command = f"fit wax.profile.npz --method {method} --mm-per-pixel .4 " + " ".join(
        f"--{key} {value}" for key, value in typed.items()
    )
    given = f"{option} {other}"  # click takes the last
    return Row(command, given, made_kernel, _fit(method, mm_per_pixel=0.4, **(usual | own)))


FIT = {
    "--strict": Row(
        "fit wax.profile.npz --method svd --rank 1 --mm-per-pixel .4",
        "--strict",
        status,
        lambda: 1,
    ),
    "--list": Row(
        "fit wax.profile.npz --method svd",
        "fit --list",
        lambda ran: [line.split()[0] for line in ran.stdout.splitlines()],
        lambda: list(METHODS),
    ),
    "--method": Row(
        "fit wax.profile.npz --method svd",
        "--method burley",
        made_kernel,
        lambda: _fit("burley")(),
        words="cascade",
    ),
    "--mm-per-pixel": Row(
        "fit wax.profile.npz --method svd",
        "--mm-per-pixel .5",
        made_kernel,
        _fit("svd", mm_per_pixel=0.5),
        default="0.3",
    ),
    "--pitches": Row(
        "fit wax.profile.npz --method svd --json",
        "--pitches .4,.6",
        lambda ran: [names(ran), [each["pixels"] for each in ran.figures.get("kernels", ())]],
        lambda: [
            [f"wax.svd3.{pitch}mm.kernel.json" for pitch in (0.4, 0.6)],
            [
                world.quietly(fit.fit_svd, profile(), mm_per_pixel=pitch).kernel.pixels
                for pitch in (0.4, 0.6)
            ],
        ],
    ),
    "--support": _fitted("--support", "2.1", "svd", "auto", support_mm=2.1),
    "--smooth": _fitted("--smooth", "", "preintegrated", smooth=True),
    "--normalize": _fitted("--normalize", "", "preintegrated", normalize=True),
    "--rank": _fitted("--rank", "2", "svd", "3", "3 for svd, 2 for weighted", rank=2),
    "--energy": _fitted("--energy", "keep", "svd", "rescale", energy="keep"),
    "--terms": _fitted("--terms", "2", "gaussians", "4", terms=2),
    "--signed": _fitted("--signed", "", "gaussians", signed=True),
    "--free-energy": _fitted("--free-energy", "", "gaussians", free_energy=True),
    "--k": _fitted("--k", "3", "guided", "1.55", k=3.0),
    "--b": _fitted("--b", "5", "guided", "50", b=5.0),
    "--centre-bound": _fitted("--centre-bound", "10%", "guided", "1.0", "none", centre_bound=0.1),
    "--target": _fitted("--target", "kernel", "artist", "line", target="kernel"),
    "--near": _by_hand("--near", ".3", "artist", _HAND, near_mm2=0.3),
    "--far": _by_hand("--far", "3,4,5", "artist", _HAND, far_mm2=[3.0, 4.0, 5.0]),
    "--weight": _by_hand("--weight", "20%,.3,90%", "artist", _HAND, weight=[0.2, 0.3, 0.9]),
    "--width": _by_hand("--width", ".2", "falloff", _SKIN, width=0.2),
    "--strength": _by_hand("--strength", "50%,60%,.9", "falloff", _SKIN, strength=[0.5, 0.6, 0.9]),
    "--falloff": _by_hand("--falloff", ".3,.4,.5", "falloff", _SKIN, falloff=[0.3, 0.4, 0.5]),
    "--fetches": _tapped("--fetches", "7.5", "24", fetches=7.5),
    "--stages": replace(
        _tapped("--stages", "1|1-1", stages="1|1-1"),
        words="3-3-3-3-3-3 for gaussian-chain, 1|1|1|1|1 for pyramid",
    ),
    "--passes": _tapped("--passes", "2", passes=2),
    "--full-resolution": _tapped("--full-resolution", "", full_resolution=True),
    "--still": _tapped("--still", "", still=True),
    "--taps": _thinned("--taps", "7", "svd", taps=7),
    "--place": _thinned("--taps 7 --place", "quadratic", "svd", taps=7, place="quadratic"),
    "--directions": _relative("--directions", "3", "rotated", words="4", directions=3, taps=3),
    "--blur": _relative("--blur", "published", "gaussian-chain", "shape", blur="published"),
    "--spectrum": _tapped("--spectrum", "white", "natural", spectrum="white"),
    "--irradiance": _tapped("--irradiance", "edge", irradiance="edge"),
    "--output": Row(
        "fit wax.profile.npz --method svd",
        "-o x.kernel.json",
        names,
        lambda: ["x.kernel.json"],
        default="wax.svd3.kernel.json",
        words="PROFILE.METHOD.taps.json, .kernel.json without taps",
    ),
    "--force": Row(
        "fit wax.profile.npz --method svd -o foreign.json",
        "--force",
        names,
        lambda: ["foreign.json"],
    ),
}

# pictures from files

_LAYER = "R, G, B without a layer, or the only layer with them"
_ALPHA = "all of it"


def _from_file(mm_per_pixel: float, layer: str, *, alpha_is_mask: bool = False) -> Scene:
    """A layer of the EXR with two, as the library reads it in the folder of the files."""
    with contextlib.chdir(world.files()):
        image = load_image("layers.exr", layer=layer)
    return Scene.from_image(image, mm_per_pixel, alpha_is_mask=alpha_is_mask)


# render

_SIZE = "--size 24x16"


def _scene(name: str, **own: Any) -> Scene:
    return make_scene(name, height=16, width=24, mm_per_pixel=kernel().mm_per_pixel, **own)


def _rendered(scene: Scene, **settings: Any) -> Any:
    return np.float32(evaluate(scene, kernel(), **settings).picture)


def _lit(name: str, option: str, value: str, default: str = "", words: str = "", **own: Any) -> Row:
    """An option of a made picture."""
    command = f"render --irradiance {name} {_SIZE}"
    library = lambda: _rendered(_scene(name, **own))  # noqa: E731
    return Row(command, f"{option} {value}", made_picture, library, default, words)


def _measured(**settings: Any) -> Any:
    """Figures of a disk."""
    score = evaluate(_scene("disk"), kernel(), profile(), **settings).score
    assert score is not None
    return [score.delta_e_2000_mean, score.exposure, score.ssim, score.flip]


_FIGURES = fields("delta_e_2000_mean", "exposure", "ssim", "flip")
_DISK = f"render --irradiance disk {_SIZE}"

_LAYERS = f"render --irradiance layers.exr --mm-per-pixel {DR_MM} -o x.exr"


def _head_on_screen(height: int, width: int, **own: Any) -> Scene:
    """The made head, on the default pixels of a screen."""
    return make_scene("head", height=height, width=width, mm_per_pixel=0.3, **own)


def _lit_through() -> Scene:
    """The head lit from 170 degrees off the eye, and what comes through it."""
    return with_transmitted(_scene("head", light_degrees=170.0, transmit=True), world.gaussians())


def _pair() -> tuple[Any, Any]:
    """The disk as the kernel has it, and as the profile has it."""
    return render_separable(_scene("disk"), kernel()), render_reference(_scene("disk"), profile())


RENDER = {
    "--irradiance": Row(
        f"render {_SIZE}",
        "--irradiance stripes",
        made_picture,
        lambda: _rendered(_scene("stripes")),
        default="head",
    ),
    "--size": Row(
        "render --irradiance stripes",
        "--size 20x8",
        made_picture,
        lambda: _rendered(make_scene("stripes", height=8, width=20, mm_per_pixel=DR_MM)),
        default="512x512",
        words="512x512; head: the whole face, up to 1080x1080",
    ),
    "--mm-per-pixel": Row(
        "render --irradiance bare.exr",
        f"--mm-per-pixel {DR_MM}",
        lambda ran: ran.status or ran.picture,
        lambda: _rendered(Scene("bare", picture(), DR_MM)),
        words="0.3 with --screen, else the kernel's",
    ),
    "--layer": Row(
        f"{_LAYERS} --layer near",
        "--layer far",
        made_picture,
        lambda: _rendered(_from_file(DR_MM, "far")),
        words=_LAYER,
    ),
    "--mask": Row(
        f"{_LAYERS} --layer far",
        "--mask alpha",
        made_picture,
        lambda: _rendered(_from_file(DR_MM, "far", alpha_is_mask=True)),
        words=_ALPHA,
    ),
    "--angle": _lit("edge", "--angle", "30", "0", angle_degrees=30.0),
    "--radius": _lit("disk", "--radius", "1.1", radius_mm=1.1),
    "--period": _lit("stripes", "--period", "2.5", period_mm=2.5),
    "--spacing": _lit("points", "--spacing", "1.3", spacing_mm=1.3),
    "--distance": _lit("head", "--distance", "30cm", "600", distance_mm=300.0),
    "--border": Row(
        _DISK.replace("disk", "edge"),
        "--border zero",
        made_picture,
        lambda: _rendered(_scene("edge"), border="zero"),
        default="mirror",
    ),
    "--screen": Row(
        f"render --irradiance head {_SIZE}",
        "--screen",
        made_picture,
        lambda: np.float32(evaluate_in_screen_space(_head_on_screen(16, 24), kernel()).picture),
    ),
    "--intermediate": Row(
        f"render wax.taps.json --irradiance disk {_SIZE}",
        "--intermediate half",
        made_picture,
        lambda: np.float32(evaluate(_scene("disk"), world.taps(), intermediate="half").picture),
        words="they are not rounded",
    ),
    "--light": _lit("head", "--light", "100", "45", light_degrees=100.0),
    "--transmit": Row(
        f"render wax.gaussians2.kernel.json --irradiance head {_SIZE}",
        "--transmit",
        made_picture,
        lambda: np.float32(evaluate(_lit_through(), world.gaussians()).picture),
    ),
    "--follow": Row(
        "render --irradiance head --size 48x48 --distance 200 --screen",
        "--follow none",
        made_picture,
        lambda: np.float32(
            evaluate_in_screen_space(
                _head_on_screen(48, 48, distance_mm=200.0), kernel(), follow="none"
            ).picture
        ),
        default="gaussian",
    ),
    "--profile": Row(
        f"{_DISK} --json",
        "--profile plate.profile.npz",
        fields("rmse"),
        lambda: [evaluate(_scene("disk"), kernel(), world.plate_profile()).score.rmse],
        default="wax.profile.npz",
        words="the profile in this folder that the kernel was fitted to",
    ),
    "--exposure": Row(
        f"{_DISK} --json",
        "--exposure 3",
        _FIGURES,
        lambda: _measured(exposure=3.0),
        default=lambda: repr(auto_exposure(render_reference(_scene("disk"), profile()))),
        words="from the true picture",
    ),
    "--structure": Row(
        f"{_DISK} --json", "--structure", _FIGURES, lambda: _measured(structure=True)
    ),
    "--output": Row(
        _DISK,
        "-o x.exr",
        names,
        lambda: ["x.exr"],
        default="wax.svd2.disk.exr",
        words="KERNEL.PICTURE.exr",
    ),
    "--truth": Row(
        f"{_DISK} -o x.tif",
        "--truth true.exr",
        lambda ran: "true.exr" in ran.written and ran.picture,
        lambda: np.float32(render_reference(_scene("disk"), profile())),
    ),
    "--difference": Row(
        f"{_DISK} -o x.tif",
        "--difference lost.exr",
        lambda ran: "lost.exr" in ran.written and ran.picture,
        lambda: np.float32(
            abs(
                render_separable(_scene("disk"), kernel())
                - render_reference(_scene("disk"), profile())
            )
        ),
    ),
    "--gain": Row(
        f"{_DISK} -o x.tif --difference lost.exr",
        "--gain 4",
        made_picture,
        lambda: np.float32(magnified_difference(*_pair(), gain=4.0)),
        default="1.0",
    ),
    "--difference-map": Row(
        f"{_DISK} -o x.tif --difference lost.exr",
        "--difference-map absolute",
        made_picture,
        lambda: np.float32(difference_map(*_pair(), kind="absolute").pixels),
    ),
    "--force": Row(f"{_DISK} -o foreign.exr", "--force", names, lambda: ["foreign.exr"]),
}

# compare

_KERNELS = "compare wax.profile.npz --what kernels --size 24x16"
_BUDGET = "compare wax.toml --what budget --size 24x16 --picture disk"


def _pictures(
    *pictures: str, size: tuple[int, int] = (16, 24), mm_per_pixel: float = 0.3
) -> list[Scene]:
    height, width = size
    own = {"edge": {"angle_degrees": 30.0}}
    return [
        make_scene(name, height=height, width=width, mm_per_pixel=mm_per_pixel, **own.get(name, {}))
        for name in pictures
    ]


def _compared(scenes: list[Scene], **settings: Any) -> Any:
    return called("sssfit.compare.compare_kernels", profile(), scenes, **settings)


def _budgeted(**settings: Any) -> Any:
    given = {"photons": 1_000_000, "settings": None} | settings
    return called("sssfit.compare.budget.error_budgets", wax(), _pictures("disk"), **given)


_OF_LAYERS = "compare wax.profile.npz --what kernels --picture layers.exr --mm-per-pixel .4"
_BOTH = "compare wax.toml --size 24x16 --picture disk"


def front(error: str, cost: str) -> Any:
    """Picture and kernel of the rows that are on a front, and its names."""
    rows = world.comparison().rows
    found = {(row.picture, row.label) for row in rows if (error, cost) in row.fronts}
    return [found, error, cost, error, cost]


def _front(ran: Ran) -> Any:
    """The same as the table for people has it, the words under it, and those of the chart."""
    found, name = set(), ""
    for line in ran.stdout.splitlines():
        if ", exposure " in line:
            name = line.split(",")[0]
        if line.startswith("* ") and "  " in line[2:].strip():
            found.add((name, line[2:].split("  ")[0]))
    words = ran.stdout.rsplit("error (", 1)[1]
    (chart,) = drawn(ran)
    named = [words.split(")")[0], words.split("cost (")[1].split(")")[0]]
    return [found, *named, chart["error"], chart["cost"]]


COMPARE = {
    "--all": Row(
        _KERNELS,
        "compare --all --size 24x16 -o out",
        names,
        lambda: [
            f"out/{name}-pareto.{end}" for name in ("marble", "skin1") for end in ("md", "png")
        ],
    ),
    "--paper": Row(
        _KERNELS,
        "compare --paper --size 24x16 -o out",
        names,
        lambda: [f"out/marble-pareto.{end}" for end in ("md", "png")],
    ),
    "--what": Row(
        _BOTH,
        "--what kernels",
        lambda ran: [name for name, _ in calls(ran)],
        lambda: ["true_profile", "compare_kernels"],
        words="budget and kernels",
    ),
    "--picture": Row(
        _KERNELS,
        "--picture points --picture edge,disk",
        calls,
        lambda: _compared(_pictures("points", "edge", "disk")),
        default="disk,edge,points,head",
    ),
    "--mm-per-pixel": Row(
        _KERNELS,
        "--mm-per-pixel .45",
        calls,
        lambda: _compared(_pictures("disk", "edge", "points", "head", mm_per_pixel=0.45)),
        default="0.3",
        words="from your own file, else 0.3",
    ),
    "--size": Row(
        "compare wax.profile.npz --what kernels --picture disk,edge",
        "--size 20x10",
        calls,
        lambda: _compared(_pictures("disk", "edge", size=(10, 20))),
        default="512x512",
    ),
    "--layer": Row(
        f"{_OF_LAYERS} --layer near",
        "--layer far",
        calls,
        lambda: _compared([_from_file(0.4, "far")]),
        words=_LAYER,
    ),
    "--mask": Row(
        f"{_OF_LAYERS} --layer far",
        "--mask alpha",
        calls,
        lambda: _compared([_from_file(0.4, "far", alpha_is_mask=True)]),
        words=_ALPHA,
    ),
    "--chart": Row(_KERNELS, "--chart c.png", is_written("png"), lambda: ["c.png"]),
    "--table": Row(_KERNELS, "--table t.csv", is_written("csv"), lambda: ["t.csv"]),
    "--error": Row(
        f"{_KERNELS} --chart c.png",
        "--error l2",
        _front,
        lambda: front("l2", "fetches"),
        default="delta-e",
    ),
    "--cost": Row(
        f"{_KERNELS} --chart c.png",
        "--cost passes",
        _front,
        lambda: front("delta-e", "passes"),
        default="fetches",
    ),
    "--only": Row(
        f"{_KERNELS} --picture disk",
        "--only burley,svd",
        calls,
        lambda: _compared(_pictures("disk"), only=["burley", "svd"]),
    ),
    "--budget-chart": Row(_BUDGET, "--budget-chart b.png", is_written("png"), lambda: ["b.png"]),
    "--photons": Row(_BUDGET, "--photons 2e4", calls, lambda: _budgeted(photons=20_000), "1e6"),
    "--method": Row(
        _BUDGET, "--method artist", calls, lambda: _budgeted(method="artist"), default="svd"
    ),
    "--rank": Row(
        _BUDGET,
        "--rank 2",
        lambda ran: [ran.stdout.split(" terms")[0].rsplit(" ")[-1]],
        lambda: [str(world.budgets(2)[0].kernel.rank)],
        default="3",
    ),
    "--terms": Row(
        f"{_BUDGET} --method gaussians",
        "--terms 2",
        calls,
        lambda: _budgeted(method="gaussians", settings={"terms": 2}),
        words="4",
    ),
    "--model": Row(
        _BUDGET,
        "--model burley",
        calls,
        lambda: _budgeted(model="burley"),
        words="the photon walk",
    ),
    "--output": Row(
        "compare --all --size 24x16",
        "-o out",
        names,
        lambda: [
            f"out/{name}-pareto.{end}" for name in ("marble", "skin1") for end in ("md", "png")
        ],
        default=".",
        words="here",
    ),
    "--force": Row(
        f"{_KERNELS} --table foreign.csv", "--force", is_written("csv"), lambda: ["foreign.csv"]
    ),
}


# choose


_PITCH = 2.0 * 600.0 * np.tan(np.radians(15.0)) / 1080  # mm, of the default view


def _chosen(
    distance_mm: float = 600.0, fov: float = 30.0, frame=(1080, 1920), scene=None, **own: Any
) -> Any:
    pitch = 2.0 * distance_mm * np.tan(np.radians(fov) / 2.0) / frame[0]
    if isinstance(scene, Scene):
        own["scene"] = scene
    elif scene:
        angle = {"angle_degrees": 30.0} if scene == "edge" else {}
        own["scene"] = make_scene(scene, height=512, width=512, mm_per_pixel=pitch, **angle)
    return called(
        "sssfit.choose.choice.choose",
        wax(),
        mm_per_pixel=pitch,
        distance_mm=distance_mm,
        frame=frame,
        **own,
    )


def _rounded(ran_calls: Any) -> Any:
    """The pitches to 12 digits: the view's own formula rounds in another order."""
    found = []
    for name, noted in ran_calls:
        pitch = float(f"{noted['mm_per_pixel']:.12g}")
        scene = noted["scene"] and (
            *noted["scene"][:2],
            float(f"{noted['scene'][2]:.12g}"),
            noted["scene"][3],
        )
        found.append((name, noted | {"mm_per_pixel": pitch, "scene": scene}))
    return found


def _asked(ran: Ran) -> Any:
    return _rounded(calls(ran))


_CHOOSE = "choose wax.toml"

CHOOSE = {
    "--strict": Row(_CHOOSE, "--strict", status, lambda: 1),
    "--distance": Row(
        _CHOOSE, "--distance 25cm", _asked, lambda: _rounded(_chosen(250.0)), default="0.6m"
    ),
    "--fov": Row(_CHOOSE, "--fov 45", _asked, lambda: _rounded(_chosen(fov=45.0)), default="30.0"),
    "--resolution": Row(
        _CHOOSE,
        "--resolution 640x360",
        _asked,
        lambda: _rounded(_chosen(frame=(360, 640))),
        default="1920x1080",
    ),
    "--tolerance": Row(
        _CHOOSE,
        "--tolerance .7",
        _asked,
        lambda: _rounded(_chosen(tolerance=0.7)),
        words="1; none with --fetches",
    ),
    "--fetches": Row(_CHOOSE, "--fetches 17.5", _asked, lambda: _rounded(_chosen(fetches=17.5))),
    "--passes": Row(_CHOOSE, "--passes 6", _asked, lambda: _rounded(_chosen(passes=6))),
    "--tolerance-of": Row(
        _CHOOSE,
        "--tolerance-of p99",
        _asked,
        lambda: _rounded(_chosen(tolerance_of="p99")),
        default="p95",
    ),
    "--irradiance": Row(
        _CHOOSE,
        "--irradiance edge",
        _asked,
        lambda: _rounded(_chosen(scene="edge")),
        default="head",
    ),
    "--layer": Row(
        f"{_CHOOSE} --irradiance layers.exr --layer near",
        "--layer far",
        _asked,
        lambda: _rounded(_chosen(scene=_from_file(_PITCH, "far"))),
        words=_LAYER,
    ),
    "--mask": Row(
        f"{_CHOOSE} --irradiance layers.exr --layer far",
        "--mask alpha",
        _asked,
        lambda: _rounded(_chosen(scene=_from_file(_PITCH, "far", alpha_is_mask=True))),
        words=_ALPHA,
    ),
    "--output": Row(
        _CHOOSE,
        "-o x.taps.json",
        names,
        lambda: ["x.profile.npz", "x.taps.json"],
        default="wax.chosen.taps.json",
        words="MATERIAL.chosen.taps.json",
    ),
    "--force": Row(
        f"{_CHOOSE} -o foreign.json",
        "--force",
        names,
        lambda: ["foreign.json", "foreign.profile.npz"],
    ),
}

# materials

_MAKE = "materials --from-reflectance .4,.2,.1 --mean-free-path 1.3,.9,.7 --eta 1.3"


def _inverted(**settings: Any) -> Any:
    given = {
        "reflectance": [0.4, 0.2, 0.1],
        "mean_free_path_mm": [1.3, 0.9, 0.7],
        "eta": 1.3,
        "name": "from-reflectance",
        "channels": ["R", "G", "B"],
        "light": "normal",
    } | settings
    return called("sssfit.simulate.inversion.material_from_reflectance", **given)


MATERIALS = {
    "--toml": Row("materials wax.toml", "--toml", lambda ran: ran.stdout, lambda: wax().to_toml()),
    "--from-reflectance": Row(
        _MAKE,
        "--from-reflectance 50%,.2,.1",
        calls,
        lambda: _inverted(reflectance=[0.5, 0.2, 0.1]),
    ),
    "--mean-free-path": Row(
        _MAKE, "--mean-free-path 2", calls, lambda: _inverted(mean_free_path_mm=[2.0])
    ),
    "--light": Row(
        _MAKE,
        "--light diffuse",
        calls,
        lambda: _inverted(light="diffuse"),
        default="normal",
        words="diffuse for sRGB colours, else normal",
    ),
    "--srgb": Row(
        _MAKE.replace(".4,.2,.1", "1,0,1"),
        "--srgb",
        calls,
        lambda: _inverted(reflectance="#010001", light="diffuse"),
    ),
    "--eta": Row(
        _MAKE.replace(" --eta 1.3", ""),
        "--eta 1.5",
        calls,
        lambda: _inverted(eta=1.5),
        default="1.4",
    ),
    "--name": Row(
        f"{_MAKE} -o x.toml",
        "--name lard",
        calls,
        lambda: _inverted(name="lard"),
        default="x",
        words="that of FILE",
    ),
    "--channels": Row(
        _MAKE,
        "--channels a,b,c",
        calls,
        lambda: _inverted(channels=["a", "b", "c"]),
        default="R,G,B",
        words="R,G,B for three",
    ),
    "--output": Row(
        f"{_MAKE} --name lard",
        "-o x.toml",
        names,
        lambda: ["x.toml"],
        default="lard.toml",
        words="NAME.toml",
    ),
    "--force": Row(f"{_MAKE} -o foreign.toml", "--force", names, lambda: ["foreign.toml"]),
}

# import, export

_MCO = "import r.mco g.mco -o x.profile.npz --channels a,b"


def _joined(*channels: str) -> Any:
    found = [load_mco(world.files() / f"{name}.mco") for name in "rg"]
    return _content(join_channels(found, channels))


def _table(name: str, **settings: Any) -> Any:
    return _content(world.quietly(load_csv, world.files() / name, **settings))


_HDRP = {"baseColor": "0.4,0.2,0.1", "scatteringDistance": "1,0.5,0.25"}

IMPORT = {
    "--preset": Row(
        "import table.csv",
        "import --preset hdrp " + " ".join("=".join(each) for each in _HDRP.items()),
        made_profile,
        lambda: _content(import_preset("hdrp", _HDRP, "hdrp")),
    ),
    "--quantity": Row(
        "import bare.csv -o x.profile.npz",
        "--quantity density",
        lambda ran: ran.status or ran.profile,
        lambda: _table("bare.csv", quantity="density"),
        words="from its own comment",
    ),
    "--unit": Row(
        "import plain.csv --quantity density -o x.profile.npz",
        "--unit cm",
        lambda ran: ran.status or ran.profile,
        lambda: _table("plain.csv", quantity="density", unit="cm"),
    ),
    "--density-unit": Row(
        "import bare.csv --quantity density -o x.profile.npz",
        "--density-unit cm",
        made_profile,
        lambda: _table("bare.csv", quantity="density", density_unit="cm"),
        default="mm",
        words="the unit of its radii",
    ),
    "--channels": Row(
        _MCO,
        "--channels left,right",
        made_profile,
        lambda: _joined("left", "right"),
        default="a,b",
        words="R,G,B for three",
    ),
    "--output": Row(
        "import table.csv",
        "-o x.profile.npz",
        names,
        lambda: ["x.profile.npz"],
        default="table.profile.npz",
        words="NAME.profile.npz; of some presets .toml or .taps.json",
    ),
    "--force": Row(
        "import table.csv -o foreign.npz", "--force", is_written("npz"), lambda: ["foreign.npz"]
    ),
}


def _exported(ran: Ran) -> Any:
    (data,) = ran.written.values()
    return data.decode()


def _texture(ran: Ran) -> Any:
    (data,) = ran.written.values()
    return data


def _lut(**settings: Any) -> Callable[[], bytes]:
    return lambda: lut_bytes([profile()], **settings)[0]


_LUT = "export wax.profile.npz --format lut -o t.dds"
_LINES = f"{_LUT} --table line"
_SOURCE = "export wax.taps.json --format hlsl"
_DENSE = "export wax.svd2.kernel.json --format hlsl"


def _source(made: Callable[[], Any], **settings: Any) -> Callable[[], str]:
    return lambda: kernel_text(made(), "hlsl", **settings)[0]


def _taps_source(**settings: Any) -> Callable[[], str]:
    return _source(world.taps, **settings)


EXPORT = {
    "--preset": Row(
        _DENSE,
        "export wax.profile.npz --preset hdrp worldScale=2",
        _exported,
        lambda: preset_text(preset_of("hdrp", profile(), worldScale=2)),
    ),
    "--list": Row(
        _DENSE,
        "export --list",
        lambda ran: [line.split()[0] for line in ran.stdout.splitlines()[1:]],
        lambda: list(PRESETS),
    ),
    "--strict": Row(_DENSE, "--strict", status, lambda: 1),
    "--prefix": Row(_SOURCE, "--prefix WAX", _exported, _taps_source(prefix="WAX"), words="SSS"),
    "--coverage": Row(_SOURCE, "--coverage", _exported, _taps_source(coverage=True)),
    "--depth": Row(_SOURCE, "--depth", _exported, _taps_source(depth=True)),
    "--jitter": Row(_SOURCE, "--jitter", _exported, _taps_source(jitter=True)),
    "--tilt": Row(_SOURCE, "--tilt", _exported, _taps_source(tilt=True)),
    "--transmittance": Row(_SOURCE, "--transmittance", _exported, _taps_source(transmittance=True)),
    "--compute": Row(_SOURCE, "--compute", _exported, _taps_source(compute=True)),
    "--keep-energy": Row(_SOURCE, "--keep-energy", _exported, _taps_source(keep_energy=True)),
    "--half": Row(_SOURCE, "--half", _exported, _taps_source(half=True)),
    "--without-shader": Row(
        _SOURCE, "--without-shader", _exported, _taps_source(without_shader=True)
    ),
    "--with-shader": Row(_DENSE, "--with-shader", _exported, _source(kernel, with_shader=True)),
    "--dense": Row(_DENSE, "--dense", _exported, _source(kernel, dense=True)),
    "--table": Row(
        _LUT, "--table line", _texture, _lut(ending=".dds", table="line"), words="radial"
    ),
    "--texels": Row(_LUT, "--texels 32", _texture, _lut(ending=".dds", texels=32), words="256"),
    "--radius": Row(
        _LUT,
        "--radius 2",
        _texture,
        _lut(ending=".dds", radius_mm=2.0),
        words="99.9 % of the light",
    ),
    "--mm-per-pixel": Row(
        _LINES,
        "--mm-per-pixel 0.25",
        _texture,
        _lut(ending=".dds", table="line", mm_per_pixel=0.25),
        words="0.3",
    ),
    "--format": Row(
        "export wax.svd2.kernel.json --format hlsl",
        "--format json",
        _exported,
        lambda: json_document(kernel()),
    ),
    "--output": Row(
        "export --format csv",
        "-o x.csv",
        lambda ran: (names(ran), _exported(ran)),
        lambda: (["x.csv"], csv_text(profile())),
        default="wax.csv",
        words="NAME.FORMAT",
    ),
    "--force": Row(
        "export wax.profile.npz --format csv -o foreign.csv",
        "--force",
        names,
        lambda: ["foreign.csv"],
    ),
}

# chart

_GUIDE = "chart wax.profile.npz --guide --json"
_SPECTRUM = "chart wax.profile.npz --spectrum --json"


def _guided(**settings: Any) -> Any:
    from sssfit.compare import compute_guide

    found = world.quietly(compute_guide, profile(), **settings)
    channel = found.profile.channels[found.channel]
    return [channel, found.mm_per_pixel, list(found.ks), found.misplaced.tolist()]


_GUIDES = fields("channel", "mm_per_pixel", "k", "misplaced")


def _charted(kind: str) -> Callable[[Ran], Any]:
    return lambda ran: [kind in ran.figures, is_written("png")(ran)]


CHART = {
    "--models": Row(
        "chart wax.profile.npz --json",
        "--models",
        _charted("rows"),
        lambda: [True, ["wax.models.png"]],
    ),
    "--spectrum": Row(
        "chart wax.profile.npz --json",
        "--spectrum",
        _charted("eigenvalues"),
        lambda: [True, ["wax.spectrum.png"]],
    ),
    "--frequency": Row(
        "chart wax.profile.npz --json",
        "--frequency",
        _charted("rows"),
        lambda: [True, ["wax.frequency.png"]],
    ),
    "--angles": Row(
        "chart angles.profile.npz --json",
        "--angles",
        _charted("rows"),
        lambda: [True, ["angles.angles.png"]],
    ),
    "--guide": Row(
        "chart wax.profile.npz --json",
        "--guide",
        _charted("misplaced"),
        lambda: [True, ["wax.guide.png"]],
    ),
    "--mm-per-pixel": Row(
        _GUIDE,
        "--mm-per-pixel .5",
        _GUIDES,
        lambda: _guided(mm_per_pixel=0.5),
        default="0.3",
    ),
    "--k": Row(_GUIDE, "--k 1,2", _GUIDES, lambda: _guided(ks=[1.0, 2.0]), default="0,1.55,4"),
    "--channel": Row(
        _GUIDE,
        "--channel G",
        _GUIDES,
        lambda: _guided(channel="G"),
        default="R",
        words="the first that returns light; of a kernel up to three",
    ),
    "--profile": Row(
        "chart wax.svd2.kernel.json --json",
        "--profile plate.profile.npz",
        fields("profile", "misplaced"),
        lambda: [
            "plate.profile.npz",
            view_kernel(kernel(), world.plate_profile()).misplaced.tolist(),
        ],
        default="wax.profile.npz",
        words="found beside it or here, by its hash",
    ),
    "--photons": Row(
        "chart wax.toml --models",
        "--photons 2e4",
        calls,
        lambda: called("sssfit.compare.drawing.compare_models", wax(), photons=20_000),
        default="1e7",
    ),
    "--output": Row(
        "chart wax.profile.npz",
        "-o x.svg",
        is_written("svg", "png"),
        lambda: ["x.svg"],
        default="wax.profile.png",
        words="NAME.profile.png, NAME.kernel.png, NAME.taps.png, NAME.material.png, "
        "NAME.checkpoint.png, NAME.spectrum.png, NAME.guide.png, NAME.frequency.png, "
        "NAME.angles.png, NAME.swatches.png, MATERIAL.models.png",
    ),
    "--force": Row("chart -o foreign.png", "--force", is_written("png"), lambda: ["foreign.png"]),
}

# stability

_STABILITY = "stability wax.toml"


def _stressed(**settings: Any) -> Any:
    usual = {"only": None, "mm_per_pixel": 0.3, "is_whole": False, "seed": 1}
    return called("sssfit.stability.stability", wax(), **usual | settings)


def _page_names(folder: str = "") -> list[str]:
    return [f"{folder}marble-stability.png", f"{folder}stability.md"]


STABILITY = {
    "--only": Row(
        _STABILITY,
        "--only noise,taps",
        calls,
        lambda: _stressed(only=["noise", "taps"]),
        words="every one",
    ),
    "--mm-per-pixel": Row(
        _STABILITY,
        "--mm-per-pixel .2",
        calls,
        lambda: _stressed(mm_per_pixel=0.2),
        default="0.3",
    ),
    "--whole": Row(_STABILITY, "--whole", calls, lambda: _stressed(is_whole=True)),
    "--chart": Row(_STABILITY, "--chart s.png", is_written("png"), lambda: ["s.png"]),
    "--table": Row(_STABILITY, "--table s.md", is_written("md"), lambda: ["s.md"]),
    "--paper": Row(_STABILITY, "stability --paper", names, _page_names),
    "--output": Row(
        "stability --paper",
        "-o out",
        names,
        lambda: _page_names("out/"),
        default=".",
        words="here",
    ),
    "--force": Row(
        f"{_STABILITY} --table foreign.md", "--force", is_written("md"), lambda: ["foreign.md"]
    ),
}

# motion

_MOTION = "motion wax.toml"


def _moved(irradiance: str = "head", **settings: Any) -> Any:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return called("sssfit.motion.runner.run_sequence", wax(), irradiance, **settings)


def _tabled(**settings: Any) -> Any:
    return called("sssfit.motion.table.measure_table", **settings)


def _frame_names(ending: str) -> list[str]:
    return [f"shots/frame-000{k}.{ending}" for k in range(8)]


MOTION = {
    "--light": Row(
        _MOTION, "--light gunshot", calls, lambda: _moved(light="gunshot"), default="strobe"
    ),
    "--irradiance": Row(
        _MOTION, "--irradiance edge", calls, lambda: _moved("edge"), default="head"
    ),
    "--mm-per-pixel": Row(
        _MOTION,
        "--mm-per-pixel .2",
        calls,
        lambda: _moved(mm_per_pixel=0.2),
        words="from your file, else 0.3",
    ),
    "--size": Row(_MOTION, "--size 24x16", calls, lambda: _moved(size=(16, 24)), words="512x512"),
    "--layer": Row(
        f"{_MOTION} --irradiance layers.exr --layer near",
        "--layer far",
        calls,
        lambda: _moved("layers.exr", layer="far"),
        words=_LAYER,
    ),
    "--length": Row(_MOTION, "--length 7", calls, lambda: _moved(length=7), default="100"),
    "--target-variance": Row(
        _MOTION,
        "--target-variance .01",
        calls,
        lambda: _moved(target_variance=0.01),
        default="0.002",
    ),
    "--shift": Row(_MOTION, "--shift 2,-1", calls, lambda: _moved(shift=(-1, 2)), default="0,0"),
    "--only": Row(
        _MOTION,
        "--only fixed,cascade",
        calls,
        lambda: _moved(only=["fixed", "cascade"]),
        words="every one",
    ),
    "--frames": Row(_MOTION, "--frames shots", names, lambda: _frame_names("png")),
    "--format": Row(
        f"{_MOTION} --frames shots",
        "--format exr",
        names,
        lambda: _frame_names("exr"),
        default="png",
    ),
    "--of": Row(
        f"{_MOTION} --frames shots",
        "--of fixed",
        calls,
        lambda: _moved(frames="shots", of="fixed"),
        default="variates",
    ),
    "--chart": Row(_MOTION, "--chart m.png", is_written("png"), lambda: ["m.png"]),
    "--table": Row(_MOTION, "motion --table", calls, _tabled),
    "--seeds": Row("motion --table", "--seeds 3", calls, lambda: _tabled(seeds=3), default="200"),
    "--force": Row(
        f"{_MOTION} --chart foreign.png", "--force", is_written("png"), lambda: ["foreign.png"]
    ),
}

# scene

_SCENE = "scene wax.svd2.kernel.json"


def _framed(**settings: Any) -> Any:
    usual = {"head_units": 2.5, "spacing_units": 2.0, "fov_degrees": 30.0, "margin": 1.0}
    return called(
        "sssfit.crowd.runner.frame_of", kernel(), **usual | {"culled_by": "vertex"} | settings
    )


def _row_table(**settings: Any) -> Any:
    usual = {"head_units": 2.5, "spacing_units": 2.0, "fov_degrees": 30.0, "margin": 1.0}
    return called(
        "sssfit.crowd.runner.table_of", kernel(), **usual | {"culled_by": "vertex"} | settings
    )


def _shown(bloom: float) -> Any:
    found = world.small_frame(
        None,
        {
            "kernel": kernel(),
            "head_units": 2.5,
            "spacing_units": 2.0,
            "fov_degrees": 30.0,
            "savings": None,
            "culled_by": "vertex",
            "margin": 1.0,
        },
    )
    return np.asarray(bloomed(found.picture, bloom), dtype=np.float32)


def _scene_row(typed: str, default: str | None = None, words: str | None = None, **own: Any) -> Row:
    return Row(_SCENE, typed, calls, lambda: _framed(**own), default=default, words=words)


SCENE = {
    "--heads": _scene_row("--heads 3", words="1", heads=3),
    "--distance": _scene_row("--distance 7", words="10", distance_units=7.0),
    "--head": _scene_row("--head 2", "2.5", head_units=2.0),
    "--spacing": _scene_row("--spacing 3", "2.0", spacing_units=3.0),
    "--fov": _scene_row("--fov 40", "30.0", fov_degrees=40.0),
    "--resolution": _scene_row(
        "--resolution 40x30", words="1920x1200; 480x300 with --table", resolution=(30, 40)
    ),
    "--map-size": _scene_row("--map-size 64", words="1024; 512 with --table", map_size=64),
    "--savings": _scene_row(
        "--savings depth,clipped", words="every one", savings=["depth", "clipped"]
    ),
    "--culled-by": _scene_row("--culled-by face", "vertex", culled_by="face"),
    "--margin": _scene_row("--margin 1.5", "1.0", margin=1.5),
    "--mesh": _scene_row("--mesh square.obj", words="the made head", mesh="square.obj"),
    "--bloom": Row(
        f"{_SCENE} -o s.exr", "--bloom 20%", made_picture, lambda: _shown(0.2), default="0"
    ),
    "--table": Row(_SCENE, f"{_SCENE} --table", calls, _row_table),
    "--chart": Row(f"{_SCENE} --table", "--chart t.png", is_written("png"), lambda: ["t.png"]),
    "--output": Row(_SCENE, "-o s.exr", names, lambda: ["s.exr"], words="none"),
    "--force": Row(
        f"{_SCENE} -o foreign.png", "--force", is_written("png"), lambda: ["foreign.png"]
    ),
}

# report

_REPORT = "report wax.profile.npz"


def _reported(**settings: Any) -> Any:
    usual = {"name": "wax", "named": [], "seed": 1, "threads": None}
    usual |= {"origin": "wax.profile.npz", "kernels": []}
    return called("sssfit.report.finished_page", profile(), **usual | settings)


def _report_row(typed: str, words: str, **own: Any) -> Row:
    return Row(_REPORT, typed, calls, lambda: _reported(**own), words=words)


def _indexed() -> Any:
    every = [load_material(each) for each in ("skin1", "marble")]
    return called("sssfit.report.library_page", every, beside=Path(), threads=None)


REPORT = {
    "--all": Row(_REPORT, "report --all", calls, _indexed),
    "--kernel": Row(
        _REPORT,
        "--kernel wax.taps.json",
        calls,
        lambda: _reported(named=[("wax", world.taps())], kernels=["wax.taps.json"]),
    ),
    "--irradiance": Row(
        _REPORT, "--irradiance plain.png", calls, lambda: _reported(irradiance="plain.png")
    ),
    "--mm-per-pixel": _report_row(
        "--mm-per-pixel .4", "from your own file, else 0.3", mm_per_pixel=0.4
    ),
    "--only": _report_row(
        "--only disk,svd", "those that are fitted in seconds", only=["disk", "svd"]
    ),
    "--photons": _report_row("--photons 5000", "200000", photons=5000),
    "--output": Row(
        _REPORT,
        "-o a.html",
        names,
        lambda: ["a.html"],
        words="MATERIAL.html, materials.html with --all",
    ),
    "--force": Row(f"{_REPORT} -o foreign.html", "--force", names, lambda: ["foreign.html"]),
}

# sweep

_SWEEP = "sweep points.toml"


def _plan(seed: int | None = None) -> Any:
    return load_plan(world.files() / "points.toml", seed=seed)


def _swept(seed: int | None = None, **settings: Any) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x.zarr")
        return called("sssfit.sweep.sweep_to_store", _plan(seed), path, **settings)


SWEEP = {
    "--dry-run": Row(_SWEEP, "--dry-run", calls, lambda: called("sssfit.sweep.estimate", _plan())),
    "--scheduler": Row(
        _SWEEP,
        "--scheduler local:2",
        calls,
        lambda: _swept(scheduler="local:2"),
        words="--threads processes of this machine",
    ),
    "--resume": Row(_SWEEP, "--resume", calls, lambda: _swept(resume=True)),
    "--output": Row(_SWEEP, "-o x.zarr", names, lambda: ["x.zarr"], words="PLAN.zarr"),
    "--force": Row(_SWEEP, "--force", calls, lambda: _swept(force=True)),
}

ROWS: dict[str, dict[str, Row]] = {
    "materials": MATERIALS,
    "simulate": SIMULATE,
    "sweep": SWEEP,
    "fit": FIT,
    "render": RENDER,
    "compare": COMPARE,
    "choose": CHOOSE,
    "import": IMPORT,
    "export": EXPORT,
    "chart": CHART,
    "stability": STABILITY,
    "motion": MOTION,
    "scene": SCENE,
    "report": REPORT,
    "show": {},
}

# A quick command of each verb, for what all verbs have in common.
COMMANDS = {
    "materials": "materials wax.toml",
    "simulate": _WALK,
    "sweep": _SWEEP,
    "fit": "fit --method preintegrated",
    "render": _DISK,
    "compare": _BOTH,
    "choose": _CHOOSE,
    "import": "import table.csv",
    "export": "export --format csv",
    "chart": "chart",
    "stability": _STABILITY,
    "motion": _MOTION,
    "scene": _SCENE,
    "report": _REPORT,
    "show": "show",
}


def _seeded_taps(seed: int, method: str, **own: Any) -> Any:
    found = fit.fit_taps(profile(), method, mm_per_pixel=0.6, seed=seed, **own).kernel
    return [found.structure, found.mm_per_pixel, found.blend]


# Where --seed has something to do; elsewhere nothing is random and results do not depend on it.
SEEDS = {
    "simulate": Row(_WALK, "--seed 5", calls, lambda: _walk(seed=5)),
    "sweep": Row(_SWEEP, "--seed 5", calls, lambda: _swept(seed=5)),
    "fit --method cascade": Row(
        "fit wax.profile.npz --method cascade --stages 1-1 --mm-per-pixel .6",
        "--seed 5",
        lambda ran: ran.taps,
        lambda: _seeded_taps(5, "cascade", stages="1-1"),
    ),
    **{
        f"fit --method {method}": Row(
            f"fit wax.profile.npz --method {method} {typed} --mm-per-pixel .6",
            "--seed 5",
            lambda ran: ran.taps,
            functools.partial(_seeded_taps, 5, method, **own),
        )
        for method, typed, own in (
            ("gaussian-chain", "--stages 1-1", {"stages": "1-1"}),
            ("pyramid", "--stages 1-1", {"stages": "1-1"}),
            ("rotated", "--taps 3", {"taps": 3}),
        )
    },
    "render": Row(
        f"render --irradiance noise {_SIZE}",
        "--seed 5",
        made_picture,
        lambda: _rendered(_scene("noise", seed=5)),
    ),
    "compare": Row(_BUDGET, "--seed 5", calls, lambda: _budgeted(seed=5)),
    "compare --picture noise": Row(
        f"{_KERNELS} --picture noise",
        "--seed 5",
        calls,
        lambda: _compared([make_scene("noise", height=16, width=24, mm_per_pixel=0.3, seed=5)]),
    ),
    "stability": Row(_STABILITY, "--seed 5", calls, lambda: _stressed(seed=5)),
    "report": Row(_REPORT, "--seed 5", calls, lambda: _reported(seed=5)),
    "motion": Row(_MOTION, "--seed 5", calls, lambda: _moved(seed=5)),
    "motion --table": Row("motion --table", "--seed 5", calls, lambda: _tabled(seed=5)),
    "choose": Row(_CHOOSE, "--seed 5", _asked, lambda: _rounded(_chosen(seed=5))),
    "chart": Row(
        "chart wax.toml --models",
        "--seed 5",
        calls,
        lambda: called("sssfit.compare.drawing.compare_models", wax(), seed=5),
    ),
}

# What --threads reaches; elsewhere there is one thread.
THREADS = {
    "simulate": Row(_WALK, "--threads 1", calls, lambda: _walk(threads=1)),
    "sweep": Row(_SWEEP, "--threads 1", calls, lambda: _swept(threads=1)),
    "compare": Row(_BUDGET, "--threads 1", calls, lambda: _budgeted(threads=1)),
    "stability": Row(_STABILITY, "--threads 1", calls, lambda: _stressed(threads=1)),
    "scene": _scene_row("--threads 1", threads=1),
    "report": Row(_REPORT, "--threads 1", calls, lambda: _reported(threads=1)),
    "motion": Row(_MOTION, "--threads 1", calls, lambda: _moved(threads=1)),
    "choose": Row(_CHOOSE, "--threads 1", _asked, lambda: _rounded(_chosen(threads=1))),
    "chart": Row(
        "chart wax.toml --models",
        "--threads 1",
        calls,
        lambda: called("sssfit.compare.drawing.compare_models", wax(), threads=1),
    ),
}

# Options that several methods take; the tables above have the other ones.
FITS = {
    f"--energy of {method}": _fitted("--energy", "keep", method, energy="keep")
    for method in ("preintegrated", "burley", "gaussians")
} | {
    "--target picture": _fitted("--target", "picture", "artist", target=picture_error),
    **{
        f"--taps of {method}": _thinned("--taps", "5", method, taps=5)
        for method in SEPARABLE
        if method != "svd"
    },
    **{
        f"--place of {method}": _thinned(
            "--taps 5 --place", "quadratic", method, taps=5, place="quadratic"
        )
        for method in SEPARABLE
        if method != "svd"
    },
    "--taps of disk": Row(
        "fit wax.profile.npz --method disk --mm-per-pixel .4",
        "--taps 5",
        lambda ran: ran.taps,
        _sampled_disk,
    ),
    "--rank of weighted": _fitted("--rank", "1", "weighted", rank=1),
    "--stages of gaussian-chain": _relative("--stages", "1-1", "gaussian-chain", stages="1-1"),
    "--stages of pyramid": _relative("--stages", "1|1", "pyramid", stages="1|1"),
    "--spectrum of pyramid": _relative("--spectrum", "white", "pyramid", spectrum="white"),
    "--taps of rotated": _relative("--taps", "5", "rotated", taps=5),
    "--spectrum of weighted": _fitted("--spectrum", "white", "weighted", spectrum="white"),
    "--irradiance of weighted": _fitted("--irradiance", "edge", "weighted", irradiance="edge"),
}

VERBOSE = {"choose"}  # where --verbose has something to say

# Commands that write one file; with the last word replaced by - it goes to stdout.
STREAMS = (
    f"{_BURLEY} -o x.profile.npz",
    "fit wax.profile.npz --method svd -o x.kernel.json",
    f"{_DISK} -o x.exr",
    f"{_CHOOSE} -o x.taps.json",
    "import table.csv -o x.profile.npz",
    "export --format csv -o x.csv",
    "export wax.profile.npz --format lut -o x.exr",
    "export --format hlsl -o x.hlsl",
    "export --format json -o x.json",
    "chart wax.profile.npz -o x.png",
    "chart wax.profile.npz --spectrum -o x.png",
    "chart wax.profile.npz --guide -o x.png",
    "chart wax.profile.npz --frequency -o x.png",
    "chart angles.profile.npz --angles -o x.png",
    "chart wax.profile.npz --models -o x.png",
    f"{_MAKE} --name lard -o x.toml",
    f"{_KERNELS} --chart x.png",
    f"{_BUDGET} --budget-chart x.png",
    f"{_STABILITY} --chart x.png",
    f"{_STABILITY} --table x.md",
    f"{_MOTION} --chart x.png",
    "motion --table --chart x.png",
    "compare wax.profile.npz --what sheet --chart x.png",
    "compare wax.profile.npz --what front --size 24x16 --chart x.png",
)
