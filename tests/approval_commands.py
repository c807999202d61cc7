"""The invocations whose output is approved: every option of every verb off its default.

A new option or message takes a line here; ``python tests/approve.py`` then records what it does.
"""

import dataclasses
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import approval_world as world
from approval_run import Command

from sssfit.formats.profiles import import_profile
from sssfit.kernel import Taps
from sssfit.sweep import load_plan, sweep_to_store

C = Command
# What a search for a cascade ends with, and how long it took.
ERRORS = (
    r"[\d.]+ %",
    r", [\d.]+ s$",
    r'("spectral_error": )\[.*\]',
    r'("seconds": )[\d.e-]+',
    r'("energy_error": )\[.*\]',
)
GRID = "--dr .2 --radius 6"
SMALL = "--size 40x24"
_DENSE = "\nsigma_a_per_mm = [0.5]\nsigma_s_per_mm = "


def _write(name: str, text: str) -> Callable[[], object]:
    return lambda: Path(name).write_text(text, encoding="utf-8")  # a new file


def _as(source: str, name: str, old: str, new: str) -> Callable[[], object]:
    """Copy a file under another name, with a change."""
    return lambda: Path(name).write_text(
        Path(source).read_text(encoding="utf-8").replace(old, new), encoding="utf-8"
    )


def _coarse() -> None:
    """A profile of three annuli, to which no two Gaussians can be fitted."""
    profile = import_profile(["density.csv"], quantity="density")
    profile.save("coarse.profile.npz")


# Two layers that few directions do for: solved in a fifth of the time that plate.toml takes.
_SKINS = _write(
    "skins.toml",
    """\
name = "skins"
channels = ["B", "G", "R"]
eta_above = 1.1

[[layers]]
eta = 1.4
g = 0
sigma_a_per_mm = [0.1, 0.2, 0.3]
sigma_s_per_mm = [1.0, 1.5, 2.0]
thickness_mm = 1.2

[[layers]]
eta = 1.35
g = 0.1
sigma_a_per_mm = [0.2, 0.4, 0.5]
sigma_s_per_mm = [1.0, 1.5, 1.25]
""",
)
# Clear above what scatters little: with twice the scattering it takes three times as long.
_FILM = _as(
    "varnish.toml", "film.toml", f"g = 0.8{_DENSE}[20]", f"g = 0{_DENSE}[0.5]\nthickness_mm = 2"
)


def _into(folder: str) -> Callable[[], object]:
    return lambda: os.chdir(folder)


def _copied(source: str, name: str) -> Callable[[], object]:
    def copy() -> None:
        Path(name).unlink(missing_ok=True)  # links are not written to
        shutil.copy(source, name)

    return copy


def _moved(*names: str) -> Callable[[], object]:
    """Put files into the folder "out", their times with them."""
    return lambda: [shutil.move(name, f"out/{name}") for name in names]


def _as_own(path: Path) -> None:
    """Put a copy in the place of a link."""
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(data)


def _newest(*names: str) -> Callable[[], object]:
    """Make files the newest, each newer than the one before."""

    def touch() -> None:
        for k, name in enumerate(names):
            _as_own(Path(name))
            os.utime(name, (2e9 + k, 2e9 + k))

    return touch


def _gone(*names: str) -> Callable[[], object]:
    return lambda: [Path(name).unlink() for name in names]


HELP = [
    C("", note="no verb"),
    *(C(f"{verb} -h".strip()) for verb in ("", "materials", "simulate", "fit", "render")),
    *(
        C(f"{verb} --help")
        for verb in (
            "sweep",
            "compare",
            "choose",
            "stability",
            "motion",
            "scene",
            "report",
            "import",
            "export",
            "chart",
            "show",
        )
    ),
    C("--version"),
    C("--version -v", hidden=(r" \d[\w.]*$",)),
    C("simulat wax.toml"),
    C("fit --rang 3"),
    C("show wax.toml --threads 0"),
    C("show wax.toml --seed -1"),
    C("show wax.toml --threads two"),
    C("show wax.toml wax.toml"),
    C("show wax.toml", environment=(("NUMBA_NUM_THREADS", "0"),), note="NUMBA_NUM_THREADS=0"),
]

MATERIALS = [
    C("materials"),
    C("materials --json"),
    C("materials -q"),
    C("materials wax.toml --threads 1 --seed 2"),
    C("materials plate.toml -v"),
    C("materials leaf.toml --json"),
    C("materials plate.toml --json"),
    C("materials varnish.toml"),
    C("materials skin1 --toml"),
    C("materials plate.toml --toml"),
    C("materials leaf.toml --toml"),
    C("materials -", stdin="leaf.toml"),
    C("materials in_air.toml", set_up=_as("plate.toml", "in_air.toml", "eta_above = 1.1\n", "")),
    C("materials on_air.toml", set_up=_as("plate.toml", "on_air.toml", "eta_below = 1.2\n", "")),
    C(
        "materials even.toml",
        set_up=_as("plate.toml", "even.toml", "g = [0.1, 0.2, 0.3]", "g = 0"),
        note="g in the upper layer only",
    ),
    C("materials deon-skin"),
    C("materials deon-skin --json"),
    C("materials deon-skin --toml"),
    C("materials wax.toml --toml --json"),
    C("materials --toml"),
    C("materials wax.toml --eta 1.2"),
    C("materials skn1"),
    C("materials missing.toml"),
    C("materials broken.toml"),
    C("materials nottoml.toml"),
    C("materials foreign.toml"),
    C(
        "materials --from-reflectance .44,.23 --mean-free-path 1.3,.95 --eta 1.3 -o lard.toml"
        " --channels R,G"
    ),
    C("materials --from-reflectance '#C58c6b' --mean-free-path 0.037,0.014,0.007cm --name skin"),
    C("materials --from-reflectance '#fa6' --mean-free-path 400um --light normal -o - "),
    C("materials --from-reflectance 107,140,197 --srgb --mean-free-path .4 --name Haut --json"),
    C("materials --from-reflectance 40 --srgb --mean-free-path .4 --channels λ -o out/g.toml"),
    C(
        "materials --from-reflectance 44%,.2 --mean-free-path 1,2 --channels B,A --light diffuse"
        " --eta 1.5 -o out/pair.toml -q"
    ),
    C("materials --from-reflectance .44,0 --channels a,b --mean-free-path 1 -o foreign.toml"),
    C(
        "materials --from-reflectance .44,0 --channels a,b --mean-free-path 1 -o foreign.toml --force"
    ),
    C("materials --from-reflectance .44 --mean-free-path 1"),
    C("materials --from-reflectance .44,.2 --mean-free-path 1 --channels a,b,c"),
    C("materials --from-reflectance .4,.3,.2"),
    C("materials wax.toml --from-reflectance .4,.3,.2 --mean-free-path 1"),
    C("materials --from-reflectance .4,.3,2 --mean-free-path 1"),
    C("materials --from-reflectance .99,.3,.2 --mean-free-path 1 --eta 1.4"),
    C("materials --from-reflectance '#12345' --mean-free-path 1"),
    C("materials --from-reflectance .4,x,.2 --mean-free-path 1"),
    C("materials --from-reflectance 1.5,2,3 --srgb --mean-free-path 1"),
    C("materials --from-reflectance .4,.3,.2 --mean-free-path 1,2"),
    C("materials --from-reflectance .4,.3,.2 --mean-free-path 1mm,2,3"),
    C("materials --from-reflectance .4,.3,.2 --mean-free-path 1 --eta nan"),
]

SIMULATE = [
    C("simulate wax.toml --method burley --scheduler local:2"),
    C("simulate wax.toml --photons 3000 --scheduler 10.0.0.5"),
    C(f"simulate wax.toml {GRID} --photons 3000"),
    C(f"simulate wax.toml {GRID} --photons 3000 --seed 5 --threads 1 --json"),
    C(f"simulate plate.toml {GRID} --photons 2e3 -o 'out/Platte λ.npz' -v"),
    C("simulate leaf.toml --dr 200um --radius .5cm --photons 2000 -o - ", note="to stdout"),
    C(f"simulate wax.toml {GRID} --photons 2000 -q"),
    C(f"simulate wax.toml {GRID} --photons 2000 --beam gaussian:.5 -o beam.npz"),
    C("simulate wax.toml --method burley --beam flat:1 --json -o beam.npz"),
    C("simulate wax.toml --beam gausian:1"),
    C(f"simulate wax.toml {GRID} --photons 2000 --angles 6 -o angles.npz"),
    C(f"simulate wax.toml {GRID} --photons 2000 --numerical-aperture .4 --json -o seen.npz"),
    C(f"simulate wax.toml {GRID} --photons 2000 --numerical-aperture .4 -o seen.npz"),
    C(f"simulate wax.toml {GRID} --method exact --angles 6 -o exact.npz"),
    C("simulate wax.toml --angles 0"),
    C("simulate wax.toml --numerical-aperture 0"),
    C("simulate wax.toml --numerical-aperture .3 --angles 4"),
    C("simulate wax.toml --angles 180 --dr .001 --radius 99"),
    C("simulate wax.toml --method exact --numerical-aperture .3"),
    C("simulate wax.toml --beam flat:-1"),
    C(f"simulate wax.toml {GRID} --photons 1.5e5", terminal=True),
    C(f"simulate wax.toml {GRID} --photons 1000", compiled=False, note="not compiled"),
    C("simulate wax.toml --dr .2 --radius auto --photons 2000 -o auto.profile.npz"),
    C(f"simulate wax.toml {GRID} --target-error 30% --photons 40000 -o aim.npz"),
    C(f"simulate wax.toml {GRID} --target-error .1 --photons 1000 -o aim.npz --json"),
    C(f"simulate wax.toml {GRID} --photons 2000 --checkpoint-every 0 -o often.npz"),
    C(f"simulate wax.toml {GRID} --photons 2000 --resume -o new.npz"),
    C("simulate two.mci -o out --photons 1000"),
    C("simulate two.mci -o out --json"),
    C("simulate two.mci --run 2"),
    C("simulate two.mci --run 2 --dr .5 --radius 3 --photons 500 -v"),
    C("simulate sample.mci --run 1 --photons 300"),
    C("simulate two.mci --run 3"),
    C(
        "simulate few.mci --run 1 --target-error 20%",
        set_up=_as("two.mci", "few.mci", "\n2000\n", "\n20\n"),
        note="its photons are fewer than needed",
    ),
    C("simulate two.mci --run 1 --method multipole"),
    C(f"simulate wax.toml {GRID} --method exact"),
    C(f"simulate wax.toml {GRID} --method exact --tolerance 2% --json"),
    C(f"simulate wax.toml {GRID} --method exact --similarity"),
    C(f"simulate wax.toml {GRID} --method exact", compiled=False, note="not compiled"),
    C("simulate leaf.toml --dr .3 --radius 4 --method exact"),
    C(f"simulate wax.toml {GRID} --method dipole -o d.npz --json"),
    C(f"simulate leaf.toml {GRID} --method dipole-grosjean"),
    C(f"simulate plate.toml {GRID} --method multipole"),
    C(f"simulate wax.toml {GRID} --method burley --mapping diffuse-mfp"),
    C(f"simulate leaf.toml {GRID} --method burley --mapping diffuse --json"),
    C("simulate deon-skin --dr .5 --radius 10"),
    C("simulate deon-skin --dr .5 --radius 10 -o out/skin.npz --json"),
    C("simulate --paper --method burley --dr .5 --radius 5 -o out"),
    C("simulate - --method burley --dr .5 --radius 5", stdin="leaf.toml"),
    C("simulate"),
    C("simulate wax.toml --all"),
    C("simulate --all -o -"),
    C("simulate wax.toml --run 1"),
    C("simulate wax.toml --method burley --photons 20"),
    C("simulate wax.toml --tolerance 1%"),
    C("simulate wax.toml --method dipole --radius auto"),
    C("simulate wax.toml --method dipole --dr 1 --radius .5"),
    C("simulate wax.toml --photons 1"),
    C("simulate wax.toml --photons 1.5e1x"),
    C("simulate wax.toml --target-error 150%"),
    C("simulate wax.toml --dr 0"),
    C("simulate wax.toml --dr 1inch"),
    C("simulate wax.toml --radius far"),
    C("simulate wax.toml --checkpoint-every -1"),
    C("simulate wax.toml --resume -o -"),
    C(
        "simulate film.toml --dr .3 --radius 3 --method exact --tolerance 3%",
        set_up=_FILM,
    ),
    C("simulate varnish.toml --method dipole"),
    C("simulate plate.toml --method gaussians"),
    C("simulate --all --method gaussians"),
    C("simulate deon-skin --method exact"),
    C("simulate wax.toml --method dipole -o foreign.npz"),
    C("simulate wax.toml --method dipole --dr .5 --radius 5 -o foreign.npz --force"),
    C("simulate wax.toml --photons 10 -o foreign.npz.txt"),
    C("simulate wax.toml --method dipole -o missing/x.npz"),
    C(
        "simulate wax.toml --photons 2000 -o x.npz --resume",
        set_up=_write("x.npz.checkpoint", "mine"),
    ),
    C("simulate wax.toml --photons 2000 -o x.npz", set_up=_write("x.npz.checkpoint", "mine")),
    C("simulate missing.toml"),
    *(C(f"simulate {name}.mci") for name in ("short", "twice", "extra", "bad_g", "bad_photons")),
    *(C(f"simulate {name}.mci") for name in ("words", "thick", "missing")),
    C("simulate leaf.toml --method burley --dr .5 --radius 5 -o - --json"),
    C("simulate leaf.toml --method burley --dr .5 --radius 5 -o out/leaf.npz --json -q"),
    C("simulate out/leaf.toml --method dipole --dr .5 --radius 5", set_up=_moved("leaf.toml")),
    C("simulate wax.toml --method burley --dr .5 --radius 5 -o wax.toml"),
    C("simulate wax.toml --photons 1e13"),
    C("simulate wax.toml --dr .2 --radius 1e9"),
    C("simulate wax.toml --method exact --tolerance 100%"),
    C("simulate plate.toml --method multipole --dr .5 --radius 4 --json"),
]

FIT = [
    C("fit wax.profile.npz --method svd --rank 1 --mm-per-pixel .5 --strict"),
    C("fit wax.profile.npz --method preintegrated --mm-per-pixel .5 --strict"),
    C("fit --list"),
    C("fit --method svd"),
    C("fit wax.profile.npz --method svd --rank 2 --mm-per-pixel .5 --support 2.1 --energy keep"),
    C("fit 'Größe λ.profile.npz' --method svd --rank 1 --mm-per-pixel profile --normalize --json"),
    C("fit wax.profile.npz --method gaussians --mm-per-pixel .4 --support 1.5mm"),
    C("fit wax.profile.npz --method gaussians --terms 2 --mm-per-pixel .5 --energy keep"),
    C("fit four.profile.npz --method gaussians --terms 3 --signed --mm-per-pixel 500um"),
    C("fit leaf.profile.npz --method gaussians --terms 2 --free-energy --mm-per-pixel .25 --json"),
    C("fit leaf.profile.npz --method preintegrated --energy keep --mm-per-pixel .25 -o vor.json"),
    C("fit mono.profile.npz --method preintegrated --mm-per-pixel .05cm"),
    C("fit wax.profile.npz --method guided --k 3 --b 5 --mm-per-pixel .5"),
    C("fit wax.profile.npz --method guided --k 0 --mm-per-pixel .5 --normalize"),
    C("fit wax.profile.npz --method svd --mm-per-pixel .5 --smooth"),
    C("fit mono.profile.npz --method svd --mm-per-pixel .5 --smooth"),
    C("fit wax.profile.npz --method guided --centre-bound .2 --mm-per-pixel .5 --json"),
    C("fit wax.profile.npz --method artist --mm-per-pixel .5"),
    C("fit wax.profile.npz --method artist --target kernel --mm-per-pixel .5 -v"),
    C("fit wax.profile.npz --method artist --near .2,.1,.05 --far 2 --weight .4,.5,.6"),
    C("fit wax.profile.npz --method artist --target picture --mm-per-pixel .5"),
    C("fit wax.profile.npz --method falloff --mm-per-pixel .5"),
    C("fit wax.profile.npz --method falloff --width .3 --strength .8,.7,.75 --falloff .6,.2,.1"),
    C("fit four.profile.npz --method burley --mm-per-pixel .4 --energy keep"),
    C("fit wax.profile.npz --method burley --mm-per-pixel .4 --seed 3 --threads 1"),
    C("fit wax.profile.npz --method weighted --mm-per-pixel .5 --spectrum white"),
    C("fit wax.profile.npz --method weighted --rank 1 --mm-per-pixel .5", brief=True),
    *(
        C(
            f"fit wax.profile.npz --method cascade --mm-per-pixel .6 {own}",
            brief=True,
            hidden=ERRORS,
        )
        for own in (
            "--stages 1-1 --seed 4",
            "--stages 1-1 --json --spectrum white",
            "--fetches 7.5 -o x.taps.json",
            "--passes 2 -q",
            "--stages '*|1'",
            "--full-resolution --passes 4 --support 3mm",
            "--stages '1|1' --still",
        )
    ),
    *(
        C(f"fit wax.profile.npz {own}", brief=True, hidden=ERRORS)
        for own in (
            "--stages 1-1 --mm-per-pixel .6 --irradiance edge",
            "--method weighted --rank 1 --mm-per-pixel .25 --support .5 --irradiance mine.exr",
        )
    ),
    C("fit wax.profile.npz --method svd --rank 1 --pitches .5mm,.2cm", brief=True),
    C("fit wax.profile.npz --method svd --rank 1 --pitches .5,1 --json", brief=True),
    C("fit wax.profile.npz --pitches .5,1 -o x.taps.json"),
    C("fit wax.profile.npz --stages 1-1 --irradiance rgb8.png"),
    C("fit wax.profile.npz --stages 1-1 --irradiance mine.exr"),
    C("fit wax.profile.npz --stages 1-1 --irradiance hed"),
    C("fit wax.profile.npz --stages 1-1 --irradiance head --spectrum natural"),
    C("fit wax.profile.npz --method svd --irradiance head"),
    C("fit wax.profile.npz --method disk --mm-per-pixel .6"),
    C("fit wax.profile.npz --method disk --taps 5 --mm-per-pixel .6 --json"),
    C("fit wax.profile.npz --method disk --taps 3"),
    C("fit wax.profile.npz --method disk --taps 257"),
    C("fit wax.profile.npz --method disk --taps 90 --mm-per-pixel .6 --support 1.8mm"),
    C("fit wax.profile.npz --method disk --place quadratic"),
    *(
        C(f"fit wax.profile.npz --method {own} --mm-per-pixel .6", brief=True, hidden=ERRORS)
        for own in (
            "gaussian-chain --stages 1-1 --seed 4",
            "gaussian-chain --blur published --json",
            "pyramid --stages '1|1' --spectrum white",
            "rotated --taps 3 --seed 2",
            "rotated --taps 3 --directions 3 --json",
            "cascade --stages '1-1x'",
        )
    ),
    C("fit wax.profile.npz --method gaussian-chain --stages 1-2"),
    C("fit wax.profile.npz --method gaussian-chain --stages '1|1' --blur published"),
    C("fit wax.profile.npz --method gaussian-chain --blur box"),
    C("fit wax.profile.npz --method pyramid --stages '1|*'"),
    C("fit wax.profile.npz --method rotated --directions 5"),
    C("fit wax.profile.npz --method rotated --taps 4"),
    C("fit wax.profile.npz --method cascade --fetches 5"),
    C("fit wax.profile.npz --method cascade --stages '1-1|1' --fetches 12"),
    C("fit wax.profile.npz --method cascade --stages '1-x'"),
    C("fit wax.profile.npz --method svd --taps 4"),
    C("fit wax.profile.npz --method svd --taps 131"),
    C("fit wax.profile.npz --method svd --taps 99 --mm-per-pixel .5"),
    C("fit wax.profile.npz --support 40"),
    C("fit wax.profile.npz --stages 1-1 --irradiance flat.exr --mm-per-pixel .5"),
    C("fit wax.profile.npz --method cascade --stages '1|*' --still"),
    C("fit wax.profile.npz --method cascade --stages '1||1'"),
    C("fit wax.profile.npz --method cascade --passes 0"),
    C("fit wax.profile.npz --method cascade --passes 1 --fetches 8"),
    C("fit wax.profile.npz --method cascade --normalize"),
    C("fit wax.profile.npz --method cascade --rank 2"),
    C("fit wax.profile.npz --method cascade -o foreign.json"),
    C(
        "fit wax.profile.npz --method svd --taps 5 --place fitted --mm-per-pixel .6",
        brief=True,
        hidden=ERRORS,
    ),
    C("fit wax.profile.npz --method weighted --rank 9"),
    C("fit - --method svd --mm-per-pixel 1 -o -", stdin="leaf.profile.npz"),
    C("fit - --method svd --mm-per-pixel 1 --rank 1", stdin="Größe λ.profile.npz"),
    C("fit wax.profile.npz --method svd --mm-per-pixel .5 -q"),
    C("fit wax.profile.npz --method svd --mm-per-pixel .5 -o foreign.json"),
    C("fit wax.profile.npz --method svd --mm-per-pixel .5 -o foreign.json --force"),
    C("fit wax.profile.npz --method svd --mm-per-pixel .5 -o five.kernel.json"),
    C("fit wax.profile.npz"),
    C("fit wax.profile.npz --method svd --terms 2"),
    C("fit wax.profile.npz --method gaussians --rank 2"),
    C("fit wax.profile.npz --method svd --rank 0"),
    C("fit wax.profile.npz --method svd --rank 200 --mm-per-pixel .5"),
    C("fit wax.profile.npz --method guided --k 5"),
    C("fit wax.profile.npz --method guided --b nan"),
    C("fit wax.profile.npz --method guided --centre-bound 2"),
    C("fit wax.profile.npz --method artist --near .2"),
    C("fit wax.profile.npz --method artist --near .2,.3 --far 2 --weight .5"),
    C("fit wax.profile.npz --method artist --target kernel --near .2 --far 2 --weight .5"),
    C("fit wax.profile.npz --method falloff --width .3"),
    C("fit wax.profile.npz --method svd --mm-per-pixel wide"),
    C("fit wax.profile.npz --method svd --support 1e5m"),
    C("fit four.profile.npz --method svd --mm-per-pixel profile"),
    C("fit wax.profile.npz --method svd --mm-per-pixel 30"),
    C("fit missing.profile.npz --method svd"),
    C("fit damaged.profile.npz --method svd"),
    C("fit foreign.npz --method svd"),
    C("fit wax.svd2.kernel.json --method svd"),
    C("fit wax.profile.npz --method svd -o x.txt"),
    C("fit wax.profile.npz --method svd -o x.npz"),
    C("simulate wax.toml --photons 2000 -o x.toml"),
    C("materials --from-reflectance .4,.3,.2 --mean-free-path 1 -o lard.json"),
    C("fit --method svd", set_up=_into("empty"), note="in an empty folder"),
    C(
        "fit --method svd --rank 2 --mm-per-pixel 1 --support 2",
        set_up=_newest("wax.profile.npz", "leaf.profile.npz"),
        note="another newest",
    ),
    C("fit out/leaf.profile.npz --method svd --mm-per-pixel 1", set_up=_moved("leaf.profile.npz")),
    C("fit - --method gaussians --terms 1 --mm-per-pixel 1", stdin="mono.profile.npz"),
    C("fit leaf.profile.npz --method svd --mm-per-pixel 1 --rank 2 -o - --json"),
    C("fit leaf.profile.npz --method svd --mm-per-pixel 1 --support 2 -o - -q"),
    C("fit leaf.profile.npz --method svd --mm-per-pixel 1 --support .2 --rank 1"),
    C("fit leaf.json --method svd -o leaf.json", set_up=_copied("leaf.profile.npz", "leaf.json")),
    C("fit leaf.profile.npz --method svd --support 0"),
    C("fit four.profile.npz --method guided --mm-per-pixel .5"),
    C("fit four.profile.npz --method artist --mm-per-pixel .5 --target picture"),
    C("fit four.profile.npz --method falloff --mm-per-pixel .5"),
]


def _darker() -> None:
    """A profile of the same channels as that of wax."""
    profile = world.wax()
    energy = profile.annulus_energy * [0.5, 0.75, 1.25]
    dataclasses.replace(profile, annulus_energy=energy).save("other.npz")


RENDER = [
    C(f"render wax.hand.taps.json --irradiance disk {SMALL}"),
    C(f"render - --irradiance points {SMALL} --border zero --json", stdin="wax.hand.taps.json"),
    C(f"render wax.hand.taps.json --irradiance disk {SMALL} --intermediate half"),
    C(f"render wax.hand.taps.json --irradiance edge {SMALL} --intermediate r11g11b10 --json"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} --intermediate half"),
    C(f"render wax.hand.taps.json --screen {SMALL} --mm-per-pixel 1.5"),
    C(f"render wax.hand.taps.json --screen --follow none {SMALL} --intermediate half --json"),
    C(f"render wax.hand.taps.json --screen --follow lerp {SMALL}"),
    C("render wax.hand.taps.json --screen --irradiance disk --size 40x24"),
    C(f"render wax.hand.taps.json --irradiance head {SMALL} --transmit"),
    C("render damaged.taps.json --irradiance disk"),
    C("render wax.svd2.kernel.json --irradiance disk --size 40X24"),
    C(f"render --irradiance disk {SMALL}"),
    C(f"render wax.svd2.kernel.json --irradiance edge --angle 30 {SMALL} --border zero --json"),
    C(f"render wax.svd2.kernel.json --irradiance disk --radius 1.1mm {SMALL} -o 'Scheibe ß.exr'"),
    C(f"render wax.svd2.kernel.json --irradiance stripes --period .3cm --angle 20 {SMALL}"),
    C(f"render wax.svd2.kernel.json --irradiance separable --period 2 {SMALL} --border clamp"),
    C(f"render wax.svd2.kernel.json --irradiance points --spacing 1.5 {SMALL}"),
    C(f"render wax.svd2.kernel.json --irradiance noise --seed 9 {SMALL} --threads 1"),
    C(f"render wax.svd2.kernel.json --irradiance highlights --radius .6 {SMALL} --exposure 2.5"),
    C(f"render wax.svd2.kernel.json {SMALL} --distance .9m --light 20 -o kopf.png --truth w.tif"),
    C(f"render wax.gaussians3.kernel.json --transmit {SMALL} -v"),
    C(f"render wax.gaussians3.kernel.json --transmit --light 150 {SMALL} --json"),
    C(f"render wax.svd2.kernel.json --screen {SMALL} --mm-per-pixel 1.5"),
    C(f"render wax.svd2.kernel.json --screen --follow lerp {SMALL} --mm-per-pixel 1.5 --json"),
    C(
        f"render wax.gaussians3.kernel.json --screen --follow none --transmit {SMALL} --mm-per-pixel 1.5"
    ),
    C(f"render plate.artist.kernel.json --irradiance disk {SMALL} --difference d.exr --gain 3"),
    C(
        f"render plate.artist.kernel.json --irradiance disk {SMALL} --difference d.png --difference-map signed"
    ),
    C(
        f"render plate.artist.kernel.json --irradiance disk {SMALL} --difference d.png"
        " --difference-map absolute --gain 2 --json"
    ),
    C(
        f"render plate.artist.kernel.json --irradiance edge {SMALL} -o a.png --truth t.exr --structure"
    ),
    C(
        f"render plate.artist.kernel.json --irradiance edge {SMALL} -o a.exr --profile wax.profile.npz"
    ),
    C(f"render vier.gaussians4.kernel.json --irradiance disk {SMALL} --json"),
    C(f"render vier.gaussians4.kernel.json --irradiance disk {SMALL}"),
    C(f"render leaf.burley.kernel.json --irradiance disk {SMALL}"),
    C(f"render grau.kernel.json --irradiance disk {SMALL} -o g.tif"),
    C(f"render grau.kernel.json --irradiance disk {SMALL} --profile mono.profile.npz"),
    C(f"render five.kernel.json --irradiance disk {SMALL} -q"),
    C(f"render - --irradiance disk {SMALL} -o -", stdin="wax.svd2.kernel.json"),
    C(f"render - --irradiance disk {SMALL}", stdin="wax.svd2.kernel.json"),
    C("render wax.svd2.kernel.json --irradiance points -q"),
    C("render wax.svd2.kernel.json --irradiance mine.exr"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --mm-per-pixel 250um -o x.tiff --json"),
    C("render wax.svd2.kernel.json --irradiance bare.exr --mm-per-pixel .25"),
    C("render wax.svd2.kernel.json --irradiance bare.exr"),
    C("render wax.svd2.kernel.json --irradiance bare.exr --mm-per-pixel .5"),
    C(
        "render wax.svd2.kernel.json --irradiance layers.exr --layer far --mm-per-pixel .25 -o x.png"
    ),
    C(
        "render wax.svd2.kernel.json --irradiance layers.exr --layer far --mask alpha --mm-per-pixel .25"
    ),
    C("render wax.svd2.kernel.json --irradiance layers.exr --mm-per-pixel .25"),
    C("render wax.svd2.kernel.json --irradiance layers.exr --layer Near --mm-per-pixel .25"),
    *(
        C(f"render wax.svd2.kernel.json --irradiance {name} --mm-per-pixel .25 -o x.exr")
        for name in (
            *("depth.exr", "wide.exr", "ebu.exr", "rgb8.png", "rgba16.png", "turned.tif"),
            *("rgba8.tif", "photo.tga", "photo.jpg", "old.hdr", "grey.png"),
            *("negative.exr", "xyz.hdr", "cut.exr", "cut.png", "foreign.exr", "vier.exr"),
        )
    ),
    C("render vier.gaussians4.kernel.json --irradiance vier.exr --mm-per-pixel .3"),
    C("render leaf.burley.kernel.json --irradiance two.exr --mm-per-pixel .15 --border clamp"),
    C("render grau.kernel.json --irradiance rgba16.png --mm-per-pixel .3333333333333333 -o x.exr"),
    C("render grau.kernel.json --irradiance grey.png --mm-per-pixel .3333333333333333 -o x.png"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o foreign.exr"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o foreign.exr --force"),
    C("render wax.svd2.kernel.json --irradiance mine.exr -o mine.exr"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o x.gif"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o x.exr --truth x.exr"),
    C("render wax.svd2.kernel.json --irradiance missing.exr"),
    C("render wax.svd2.kernel.json --irradiance disk --size 40"),
    C("render wax.svd2.kernel.json --irradiance disk --angle 3"),
    C("render wax.svd2.kernel.json --irradiance disk --mm-per-pixel 3"),
    C("render wax.svd2.kernel.json --irradiance disk --layer near"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --size 3x3"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --mask alpha"),
    C("render wax.svd2.kernel.json --irradiance disk --transmit"),
    C("render wax.svd2.kernel.json --transmit --size 20x20"),
    C("render wax.svd2.kernel.json --screen --irradiance disk"),
    C("render wax.svd2.kernel.json --screen --truth x.exr"),
    C("render wax.svd2.kernel.json --follow lerp"),
    C("render wax.svd2.kernel.json --gain 3"),
    C("render wax.svd2.kernel.json --exposure 0"),
    C(f"render wax.svd2.kernel.json --irradiance noise {SMALL} --exposure 1e308"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} --exposure 1e-308"),
    C("render wax.svd2.kernel.json --distance 1mm --size 20x20"),
    C("render grau.kernel.json --irradiance disk --truth t.exr"),
    C("render damaged.kernel.json"),
    C("render foreign.json"),
    C("render wax.profile.npz"),
    C("render missing.kernel.json"),
    C("render", set_up=_into("empty"), note="in an empty folder"),
    C(
        f"render --irradiance disk {SMALL}",
        set_up=_newest("wax.svd2.kernel.json", "plate.artist.kernel.json"),
        note="another newest",
    ),
    C(
        f"render out/wax.svd2.kernel.json --irradiance edge {SMALL}",
        set_up=_moved("wax.svd2.kernel.json"),
        note="the profile here",
    ),
    C(
        f"render out/wax.svd2.kernel.json --irradiance edge {SMALL}",
        set_up=_moved("wax.svd2.kernel.json", "wax.profile.npz"),
        note="the profile beside it",
    ),
    C(f"render grau.kernel.json --irradiance disk {SMALL} --exposure 1.75 -o x.png"),
    C(f"render grau.kernel.json --irradiance disk {SMALL} -o x.png", note="exposed by itself"),
    C(f"render wax.svd2.kernel.json --screen --border clamp {SMALL} --mm-per-pixel 1.5"),
    C(
        f"render wax.svd2.kernel.json --screen --border zero {SMALL} --mm-per-pixel 1.5 --exposure 3"
        " -o x.png"
    ),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o - --json"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o - --truth t.tif -q"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --truth mine.exr"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --difference mine.exr"),
    C("render wax.svd2.kernel.json --irradiance mine.exr --truth mine.exr --force"),
    C(
        f"render wax.svd2.kernel.json --irradiance disk {SMALL} --profile p.exr -o p.exr",
        set_up=_copied("wax.profile.npz", "p.exr"),
    ),
    C(
        f"render k.exr --irradiance disk {SMALL} -o k.exr",
        set_up=_copied("wax.svd2.kernel.json", "k.exr"),
    ),
    C("render wax.svd2.kernel.json --irradiance own.png --mm-per-pixel .25 --difference own.png"),
    C("render wax.svd2.kernel.json --irradiance layers.exr --layer near --mm-per-pixel .25 -q"),
    C(
        "render wax.svd2.kernel.json --irradiance layers.exr --layer far --mask alpha"
        " --mm-per-pixel .25 --border zero --structure -o x.exr --truth t.tif --difference d.png"
        " --difference-map signed --json"
    ),
    C(
        "render wax.svd2.kernel.json --irradiance rgba8.tif --mm-per-pixel .25 --mask alpha -o x.png"
    ),
    C("render vier.gaussians4.kernel.json --irradiance y.exr --mm-per-pixel .3"),
    C("render grau.kernel.json --irradiance y.exr --mm-per-pixel .3333333333333333 -o x.png"),
    C("render wax.svd2.kernel.json --irradiance disk --radius 1 --size 4x3"),
    C("render wax.svd2.kernel.json --irradiance disk --size 700x1 -o x.png"),
    C(f"render five.kernel.json --irradiance disk {SMALL} --difference d.exr"),
    C(f"render five.kernel.json --irradiance disk {SMALL} -o x.png"),
    C(
        f"render vier.gaussians4.kernel.json --irradiance disk {SMALL} --difference d.png"
        " --difference-map absolute"
    ),
    C(
        f"render wax.svd2.kernel.json --irradiance disk {SMALL} --profile other.npz",
        set_up=_darker,
        note="of the same channels",
    ),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} --profile mono.profile.npz"),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} --structure --exposure .5"),
    C("render wax.svd2.kernel.json --irradiance disk --size 9x9 --structure"),
    C("render wax.svd2.kernel.json --irradiance parts.exr --mm-per-pixel .25"),
    C("render wax.svd2.kernel.json --irradiance parts.exr --layer second --mm-per-pixel .25"),
    C(
        f"render wax.svd2.kernel.json --irradiance disk {SMALL}",
        set_up=_gone("wax.profile.npz", "angles.profile.npz"),
        note="the profile gone",
    ),
]

TINY = "--size 32x20 --mm-per-pixel .5"
COMPARE = [
    C(f"compare wax.profile.npz --picture disk,edge {TINY}"),
    C(f"compare wax.profile.npz --picture disk --picture points {TINY} --what kernels --json"),
    C(f"compare wax.profile.npz --picture disk,edge {TINY} --error l2 --what kernels --json"),
    C(
        f"compare coarse.profile.npz --picture edge {TINY} --error l2 --what kernels --table t.md",
        set_up=_coarse,
        note="three annuli",
    ),
    C(
        f"compare wax.profile.npz --picture disk {TINY} --error l2 --cost passes --table t.md --chart c.svg"
    ),
    C(
        f"compare wax.profile.npz --picture disk {TINY} --cost seconds --table t.csv --chart 'Größe.pdf' -v"
    ),
    C(
        f"compare 'Größe λ.profile.npz' --picture edge,disk {TINY} --error l2 --table t.json --threads 1"
    ),
    C(f"compare four.profile.npz --picture edge {TINY} --error l2 --table t.csv"),
    C(f"compare four.profile.npz --picture edge {TINY}"),
    C(
        f"compare wax.profile.npz --picture disk {TINY} --what kernels --only svd,burley --cost bytes"
    ),
    C(f"compare wax.profile.npz --picture disk,points {TINY} --what kernels --error p99"),
    C(f"compare wax.profile.npz --picture disk {TINY} --only svd,nurbs"),
    C("compare wax.toml --what budget --only svd"),
    C(f"compare mono.profile.npz --picture disk,noise --seed 4 {TINY} --what front"),
    C(f"compare wax.profile.npz --picture disk,edge {TINY} --what front --cost seconds --json"),
    C(f"compare wax.profile.npz --picture disk {TINY} --what front --chart f.png --table f.md"),
    C("compare wax.profile.npz --picture mine.exr --what front"),
    C(
        "compare wax.profile.npz --picture edge,mine.exr,bare.exr --size 9x30 --cost seconds --what kernels --mm-per-pixel .25"
    ),
    C(
        "compare wax.profile.npz --picture layers.exr --layer far --mask alpha --mm-per-pixel profile"
    ),
    C("compare wax.profile.npz --size 24x16 --mm-per-pixel .1cm --what front -q"),
    C(f"compare - --picture disk {TINY} --what front", stdin="leaf.profile.npz"),
    C(f"compare wax.profile.npz --picture disk {TINY} --what kernels", terminal=True),
    C("compare mono.profile.npz --what sheet --chart s.png --mm-per-pixel .5"),
    C("compare 'Größe λ.profile.npz' --what sheet --chart s.svg --mm-per-pixel profile --json"),
    C(f"compare wax.toml --what budget --picture disk,edge {TINY} --photons 2000 --seed 5"),
    C(f"compare wax.toml --what budget --picture disk {TINY} --photons 2e3 --rank 1 --json"),
    C(
        f"compare wax.toml --what budget --picture disk {TINY} --photons 2000 --method gaussians"
        " --terms 2 --budget-chart b.png"
    ),
    C(f"compare wax.toml --what budget --picture disk {TINY} --photons 2000 --model dipole"),
    C("compare wax.toml --what budget --method cascade --rank 2"),
    C(
        f"compare wax.toml --what budget --picture disk {TINY} --photons 2000 --method burley"
        " --model burley --json"
    ),
    C(
        f"compare wax.toml --what budget --picture disk {TINY} --photons 2000",
        compiled=False,
        terminal=True,
        note="not compiled",
    ),
    C(f"compare wax.toml --picture disk {TINY} --photons 2000 --chart - --table t.md"),
    C(f"compare leaf.toml --picture disk {TINY} --error l2"),
    C(f"compare deon-skin --picture disk {TINY} --what front"),
    C(f"compare deon-skin --what budget --picture disk {TINY}"),
    C(f"compare - --what budget --picture disk {TINY}", stdin="mono.profile.npz"),
    C(f"compare wax.profile.npz --what budget --picture disk {TINY}"),
    C(
        "compare skins.toml --what budget --picture disk --size 20x20 --photons 2e4",
        set_up=_SKINS,
    ),
    C("compare"),
    C("compare --all --only svd --picture disk --size 16x12 --mm-per-pixel .4 -o out", few=True),
    C("compare --paper --picture edge --size 16x12 --mm-per-pixel .9 --error l2 --json", few=True),
    C("simulate --paper --method burley --dr 2 --radius 20 -o out", few=True),
    C("compare wax.profile.npz --picture disk --size 16x12 --mm-per-pixel 20 --what kernels"),
    C("simulate --all --method burley --dr 2 --radius 20 -o out", few=True),
    C("compare wax.toml --all"),
    C("compare --all --what budget"),
    C("compare --all --chart x.png"),
    C("compare --paper --mm-per-pixel profile"),
    C("compare wax.toml -o out"),
    C("compare wax.toml --what front --photons 20"),
    C("compare wax.toml --what front --budget-chart x.png"),
    C("compare wax.toml --what sheet --chart x.png --table x.md"),
    C("compare --all --model dipole"),
    C("compare wax.toml --what budget --chart x.png"),
    C("compare wax.toml --what sheet --picture disk --chart x.png"),
    C("compare wax.profile.npz --what presets --size 24x16 --picture edge --chart p.png"),
    C("compare mono.profile.npz --what presets --size 24x16"),
    C("compare wax.toml --what presets --table p.md"),
    C("compare wax.toml --what presets --rank 2"),
    C("compare wax.toml --what sheet"),
    C("compare wax.toml --chart - --budget-chart -"),
    C("compare wax.toml --method gaussians --rank 2"),
    C("compare wax.toml --picture disc"),
    C("compare wax.toml --picture mine.exr --size 3x3"),
    C("compare wax.toml --picture disk --layer far"),
    C("compare wax.toml --table x.txt"),
    C("compare wax.toml --chart x.gif"),
    C("compare wax.toml --chart foreign.png"),
    C("compare wax.toml --table foreign.md"),
    C(f"compare mono.profile.npz --picture disk {TINY} --what kernels --table foreign.md --force"),
    C("compare wax.toml --chart x.png --budget-chart x.png"),
    C("compare wax.toml --photons 1"),
    C(f"compare missing.toml --picture disk {TINY}"),
    C("compare mono.profile.npz --what front --mm-per-pixel profile --picture disk --size 16x12"),
    C("compare --all --picture flat.exr --mm-per-pixel .5", few=True),
    C(f"compare mono.profile.npz --what kernels --picture disk {TINY} --chart - --json"),
    C(f"compare mono.profile.npz --what front --picture disk {TINY} --chart - -q"),
    C("compare mono.profile.npz --what front --picture own.png --mm-per-pixel .5 --chart own.png"),
    C("compare w.md --what front --table w.md", set_up=_copied("wax.toml", "w.md")),
    C("compare w.csv --what kernels --table w.csv", set_up=_copied("wax.toml", "w.csv")),
    C(
        f"compare mono.profile.npz --what front --picture edge {TINY} --error l2 --cost passes"
        " --table t.csv --json"
    ),
    C("compare mono.profile.npz --picture disk --size 7x5 --mm-per-pixel .5 --what kernels"),
    C("compare mono.profile.npz --picture flat.exr --mm-per-pixel .5 --what kernels"),
    C("compare wax.profile.npz --picture grey.png --mm-per-pixel .5 --what front"),
    C("compare wax.profile.npz --picture disk,disk --what front"),
    C("compare four.profile.npz --what sheet --chart s.png"),
]


def _dark() -> None:
    """A profile that returns no light."""
    profile = world.mono()
    none = {"annulus_energy": 0 * profile.annulus_energy, "beyond_grid": [0.0]}
    dataclasses.replace(profile, **none).save("dark.profile.npz")


def _coarse_grey() -> None:
    """A profile of three annuli and one channel."""
    Path("coarse.csv").write_text("r_mm,Y\n.5,.02\n1.5,.01\n2.5,.002\n", encoding="utf-8")
    import_profile(["coarse.csv"], quantity="density").save("coarse.profile.npz")


VIEW = "--distance .6m --fov 20 --resolution 64x48"
CHOOSE = [
    C("choose wax.toml --distance 3m --resolution 40x24 --irradiance edge"),
    C("choose wax.toml --distance 60m --resolution 40x24"),
    C("choose wax.profile.npz --distance 3m --resolution 40x24 --irradiance disk --fetches 12"),
    C(
        "choose wax.profile.npz --distance 3m --resolution 40x24 --irradiance disk --fetches 16 "
        "--passes 4 --tolerance 9 --json"
    ),
    C("choose wax.profile.npz --distance 40cm --fov 3 --resolution 40x48 --fetches 7 --passes 1"),
    C("choose wax.profile.npz --fetches 5"),
    C(
        "choose wax.profile.npz --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 2"
    ),
    C(
        "choose wax.profile.npz --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 5"
    ),
    C(
        "choose wax.profile.npz --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 2"
        " --tolerance-of mean --json"
    ),
    C(
        "choose wax.profile.npz --distance 40cm --fov 3 --resolution 40x48 --irradiance edge"
        " --tolerance 6 --tolerance-of p99 -v -o 'out/Wahl λ.json'"
    ),
    C(
        "choose 'Größe λ.profile.npz' --distance .3m --fov 2 --resolution 30x40 --irradiance points"
        " --tolerance 12 --threads 1"
    ),
    C(
        "choose mono.profile.npz --distance .3m --fov 2 --resolution 30x40 --irradiance noise --seed 4"
        " --tolerance 2 -q"
    ),
    C(
        "choose - --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 6 -o -",
        stdin="wax.profile.npz",
    ),
    C("choose wax.toml --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 5"),
    C("choose wax.toml --distance 70m --resolution 40x24", compiled=False, note="not compiled"),
    C("choose wax.profile.npz --irradiance mine.exr --tolerance 2"),
    C(
        "choose wax.profile.npz --irradiance layers.exr --layer far --mask alpha --fov 40 --tolerance 9"
    ),
    C("choose wax.profile.npz --distance 900 --resolution 64x48 --tolerance 20"),
    C(
        "choose wax.profile.npz --distance 3m --resolution 40x24 --irradiance edge",
        set_up=_write("wax.chosen.kernel.json", '{"format": "sssfit.kernel/1"}'),
        note="an earlier one",
    ),
    C("choose deon-skin --distance 60m --resolution 40x24"),
    C("choose"),
    C(
        "choose wax.profile.npz --distance 3m --resolution 40x24 --irradiance disk --fetches 12"
        " --strict"
    ),
    C("choose wax.toml --distance 1"),
    C("choose wax.toml --distance 1cm"),
    C("choose wax.toml --fov 180"),
    C("choose wax.toml --resolution 40by30"),
    C("choose wax.toml --tolerance 0"),
    C("choose wax.toml --tolerance-of p90"),
    C("choose wax.toml --irradiance disk --layer far"),
    C("choose wax.profile.npz --irradiance missing.png"),
    C("choose four.profile.npz --irradiance disk --resolution 40x24"),
    C("choose wax.toml -o foreign.json"),
    C(
        "choose mono.profile.npz --distance .3m --fov 2 --resolution 30x40 --irradiance disk --tolerance 8"
        " -o foreign.json --force"
    ),
    C("choose missing.toml"),
    C(
        "choose film.toml --distance 40cm --fov 3 --resolution 40x48 --irradiance disk --tolerance 9",
        set_up=_FILM,
    ),
    C("choose leaf.toml --distance 40cm --fov 3 --resolution 40x48 --irradiance disk"),
    C("choose wax.profile.npz --distance 30cm --fov 10 --resolution 64x48 --tolerance 6"),
    C(
        "choose wax.profile.npz --irradiance mine.exr --distance .6m --fov 25.6 --resolution 14x1090 --tolerance 9"
    ),
    C(
        "choose mono.profile.npz --irradiance noise --distance 40cm --fov 3 --resolution 900x600 --tolerance 9"
    ),
    C("choose wax.profile.npz -o x.npz"),
    C("choose m.json --irradiance disk -o m.json", set_up=_copied("wax.toml", "m.json")),
    C(
        "choose mono.profile.npz --irradiance m.json -o m.json",
        set_up=_copied("mine.exr", "m.json"),
    ),
    C(
        "choose wax.toml --irradiance disk -o mono.kernel.json",
        set_up=_copied("foreign.npz", "mono.profile.npz"),
        note="a profile that is not ours",
    ),
    C(
        "choose mono.profile.npz --distance .3m --fov 2 --resolution 30x40 --irradiance disk"
        " --tolerance 8 -o - --json"
    ),
    C(
        "choose out/mono.profile.npz --distance .3m --fov 2 --resolution 30x40 --irradiance disk"
        " --tolerance 8 -v",
        set_up=_moved("mono.profile.npz"),
    ),
    C("choose mono.profile.npz --distance 60m --resolution 40x24 --json"),
    C("choose mono.profile.npz --distance 60m --resolution 40x24 -o -"),
    C("choose mono.profile.npz --distance .3m --fov 10 --resolution 30x40 --tolerance 3"),
    C(
        "choose mono.profile.npz --distance .3m --fov 2 --resolution 30x40 --irradiance disk"
        " --tolerance .001"
    ),
    C("choose dark.profile.npz --irradiance disk", set_up=_dark, note="no light"),
    C(
        "choose coarse.profile.npz --irradiance edge --distance .3m --fov 20 --resolution 30x40"
        " --tolerance 3 --json",
        set_up=_coarse_grey,
        note="three annuli",
    ),
    C("choose mono.profile.npz --irradiance flat.exr --fov 40"),
    C("choose wax.toml --fov 1e-300"),
    C("choose wax.toml --distance 1e300"),
    C("choose wax.toml --distance 5000m --resolution 4x3 --irradiance disk"),
]

IMPORT = [
    C("import density.csv"),
    C("import --preset hdrp baseColor=.4,.2,.1 scatteringDistance=1,.5,.25"),
    C("import --preset unreal ScatterRadius=1.2 SubsurfaceColor=.48,.41,.28 FalloffColor=1,.37,.3"),
    C(
        "import --preset openpbr subsurface_color=.8,.5,.4 subsurface_radius=.1 "
        "subsurface_radius_scale=1,.5,.25 -o mine.toml --json"
    ),
    C("import --preset hdrp baseColor=.4,.2,.1"),
    C("import --preset hdrp baseColor=.4,.2,1.1 scatteringDistance=1,.5,.25"),
    C("import --preset hdrp baseColor=.4,.2,.1 scatteringDistance=0,0,0"),
    C("import --preset hdrp density.csv"),
    C("import --preset hdpr baseColor=.4,.2,.1"),
    C("import --preset hdrp baseColor=.4,.2,.1 scatteringDistance=1,.5,.25 -o foreign.npz"),
    C("import --preset hdrp baseColor=.4,.2,.1 scatteringDistance=1,.5,.25 --unit mm"),
    C("import cm.csv --quantity density --json"),
    C("import cm.csv --quantity density --density-unit mm"),
    C("import plain.csv --quantity density --unit mm --density-unit cm -o 'Größe.npz'"),
    C("import plain.csv --quantity density --unit cm"),
    C("import energy.csv -v"),
    C("import energy.csv --json -o e.npz"),
    C("import gap.csv --quantity density"),
    C("import - --quantity density", stdin="cm.csv"),
    C("import density.csv -o -"),
    C("import density.v2.csv", set_up=_as("density.csv", "density.v2.csv", "", "")),
    C("import density.csv -q --threads 1 --seed 2"),
    C("import latin1.csv --quantity density"),
    C("import latin1-comment.csv --quantity density"),
    C("import utf16.csv --quantity density"),
    C("import bom.csv --quantity density"),
    C("import r.mco"),
    C("import r.mco g.mco -o rg.npz --channels G,R --json"),
    C("import r.mco g.mco r.mco -o rgb.npz"),
    C(
        "import r.mco b.mco -o rb.npz --channels R,B --json",
        set_up=lambda: Path("b.mco").write_text(world.mco_text(photons="777"), encoding="utf-8"),
        note="of other photons",
    ),
    C("import g.mco --channels grün"),
    C("import - --channels ' λ '", stdin="g.mco"),
    C("import lossy.mco"),
    C("import cudamcml-inparam.mco"),
    C("import mcml2.mco"),
    C("import toomuch.csv --quantity density"),
    C("import toomuch_plain.csv --quantity density --unit um"),
    C("import energies_over.csv --quantity energy"),
    C("import density.csv --quantity energy"),
    C("import energy.csv --density-unit cm"),
    C("import cm.csv"),
    C("import plain.csv --quantity density"),
    C("import cm.csv --quantity density --unit mm"),
    C("import afterinf.csv --quantity density"),
    C("import zero.csv --quantity energy"),
    C("import zero.csv --quantity density"),
    *(
        C(f"import {name}.csv --quantity energy")
        for name in (
            *("empty", "numbers", "onecolumn", "noname", "twice", "noradius", "tworadii"),
            *("stray_stderr", "gaps", "afterinf", "oneline", "head", "unsorted", "negative"),
            *("word", "emptycell", "quoted", "said", "missing"),
        )
    ),
    *(
        C(f"import {name}.mco")
        for name in ("wrong_sum", "short", "negative", "extra", "binary", "missing")
    ),
    C("import r.mco other_n.mco -o x.npz --channels a,b"),
    C("import r.mco other_grid.mco -o x.npz --channels a,b"),
    C("import r.mco g.mco"),
    C("import r.mco g.mco -o x.npz"),
    C("import r.mco g.mco -o x.npz --channels a,b,c"),
    C("import r.mco g.mco -o x.npz --channels a,a"),
    C("import r.mco density.csv -o x.npz"),
    C("import r.mco --unit cm"),
    C("import density.csv --channels a,b"),
    C("import two.mci"),
    C("import wax.profile.npz"),
    C("import density.csv -o foreign.npz"),
    C("import density.csv -o foreign.npz --force"),
    C("import density.csv -o x.csv"),
    C("import"),
    C("import density.csv -o - --json"),
    C("import density.csv -o - -q"),
    C("import gap.csv --quantity density -q"),
    C("import gap.csv --quantity density --json"),
    C("import lossy.mco -q"),
    C("import out/density.csv", set_up=_moved("density.csv")),
    C("import out/r.mco", set_up=_moved("r.mco")),
    C("import d.npz -o d.npz", set_up=_copied("density.csv", "d.npz")),
    C("import r.npz g.mco -o r.npz --channels R,G", set_up=_copied("r.mco", "r.npz")),
    C("import r.mco r.npz -o r.npz --channels R,G", set_up=_copied("g.mco", "r.npz")),
    C("import d.npz -o d.npz --force --json", set_up=_copied("density.csv", "d.npz")),
    C("import plain.csv --quantity density --unit m --density-unit um"),
    C("import plain.csv --quantity energy --unit cm --json"),
    C("import plain.csv --quantity density --unit inch"),
    C("import notail.mco"),
    C("import deep.mco through.mco -o x.npz --channels a,b"),
    C("import through.mco"),
    C("import utf16le.csv --quantity density"),
    C("import utf16be.csv --quantity density"),
    C("import windows.csv --quantity energy"),
    C("import spaced.csv"),
    C("import shifted.csv --quantity density"),
    C("import narrow.csv --quantity energy"),
    C("import zero.csv --quantity density --json"),
    C("import tight.csv --quantity density"),
    C("import exact.csv --quantity energy"),
    C("import latin1-bad.csv --quantity density"),
    C("import foreign.exr"),
    C("import mine.exr"),
    C("import out"),
]

OWN = [
    *(
        C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o own.{ending}")
        for ending in ("exr", "tif", "png")
    ),
    C(f"render wax.svd2.kernel.json --irradiance disk {SMALL} -o own_chart.png"),
    *(C(f"chart plate.toml -o own_chart.{ending}") for ending in ("png", "svg", "pdf")),
    C("chart plate.toml -o own.png"),
    *(
        C(f"compare mono.profile.npz --what front --picture disk {TINY} --table {name}")
        for name in ("own.md", "own_table.csv", "own_table.json", "own.csv")
    ),
    C("export wax.svd2.kernel.json --format hlsl -o own.hlsl"),
    C("export wax.profile.npz --format csv -o own.csv"),
    C("export wax.profile.npz --format csv -o own_table.csv"),
    C("import density.csv -o mono.profile.npz"),
    C("fit wax.profile.npz --method svd --mm-per-pixel 1 -o grau.kernel.json"),
    C("materials --from-reflectance .3 --channels Y --mean-free-path 1 -o own.toml"),
    C("materials --from-reflectance .3 --channels Y --mean-free-path 1 -o wax.toml"),
    C("simulate wax.toml --method dipole --dr 1 --radius 5 -o mono.profile.npz"),
]


def _over() -> None:
    profile = world.wax()
    energy = profile.annulus_energy * [1.0, 6.0, 1.0]
    dataclasses.replace(profile, annulus_energy=energy).save("over.profile.npz")


def _below() -> None:
    profile = world.wax()
    energy = profile.annulus_energy.copy()
    energy[6, 1] = energy[9, 0] = -1.25e-4
    dataclasses.replace(profile, annulus_energy=energy).save("below.profile.npz")


def _leaf_taps() -> None:
    taps = Taps.load("wax.hand.taps.json")
    dataclasses.replace(taps, meta=taps.meta | {"material": "leaf"}).save("leaf.hand.taps.json")


EXPORT = [
    C("export --format hlsl"),
    C("export wax.svd2.kernel.json --format json"),
    C("export plate.artist.kernel.json --format hlsl -o 'Platte λ.hlsl' --json"),
    C("export plate.artist.kernel.json --format json -o out/p.json -v"),
    C("export grau.kernel.json --format hlsl -o -"),
    C("export grau.kernel.json --format json -o - -q"),
    C("export leaf.burley.kernel.json --format hlsl"),
    C("export leaf.burley.kernel.json --format json"),
    C("export vier.gaussians4.kernel.json --format hlsl"),
    C("export five.kernel.json --format hlsl"),
    C("export five.kernel.json --format json --json"),
    C("export - --format hlsl", stdin="five.kernel.json"),
    C("export wax.hand.taps.json --format hlsl"),
    C("export wax.hand.taps.json --format json -o - -q"),
    C("export - --format hlsl -o t.hlsl --json", stdin="wax.hand.taps.json"),
    C(
        "export --format hlsl",
        set_up=_newest("wax.svd2.kernel.json", "wax.hand.taps.json"),
        note="the newest has taps",
    ),
    C("export wax.hand.taps.json --format glsl --prefix WAX --coverage -o -"),
    C("export wax.hand.taps.json --format wgsl --half --keep-energy -o -"),
    C("export wax.hand.taps.json --format hlsl --depth -o -"),
    C("export wax.hand.taps.json --format wgsl --transmittance -o -"),
    C("export wax.hand.taps.json --format glsl --jitter -o -"),
    C("export wax.hand.taps.json --format wgsl --tilt -o -"),
    C("export wax.hand.taps.json --format wgsl --tilt --depth -o -"),
    C("export wax.hand.taps.json --format hlsl --compute -o -"),
    C("export wax.hand.taps.json --format glsl --compute --coverage -o -"),
    C("export wax.svd2.kernel.json --format glsl --compute --with-shader -o -"),
    C("export wax.hand.taps.json --format hlsl --depth --without-shader"),
    C("export wax.hand.taps.json --format c -o w.c"),
    C(
        "export wax.hand.taps.json leaf.hand.taps.json --format hlsl --without-shader -o two.hlsl",
        set_up=_leaf_taps,
    ),
    C("export wax.hand.taps.json wax.hand.taps.json --format hlsl"),
    C("export wax.svd2.kernel.json --format hlsl --with-shader"),
    C("export wax.svd2.kernel.json --format glsl --dense --half -o -"),
    C("export wax.hand.taps.json --format hlsl --prefix 'a b'"),
    C("export wax.hand.taps.json --format c --coverage"),
    C("export wax.hand.taps.json wax.svd2.kernel.json --format hlsl"),
    C("export wax.hand.taps.json wax.hand.taps.json --format json"),
    C("export wax.svd2.kernel.json grau.kernel.json --format wgsl"),
    C("export damaged.taps.json --format hlsl"),
    C("export wax.hand.taps.json --format json -o wax.hand.taps.json"),
    C("export --list"),
    C("export wax.toml --preset hdrp"),
    C("export wax.profile.npz --preset unreal match=profile WorldUnitScale=2 --json"),
    C("export --preset o3de -o -"),
    C("export wax.toml --preset openpbr mm_per_unit=1000 -o w.mtlx -v"),
    C("export plate.toml --preset mitsuba"),
    C("export wax.profile.npz --preset pbrt"),
    C("export wax.svd2.kernel.json --preset hdrp"),
    C("export four.profile.npz --preset hdrp"),
    C("export wax.toml plate.toml --preset hdrp"),
    C("export wax.toml --preset hdpr"),
    C("export wax.toml --preset hdrp worldscale=1"),
    C("export wax.toml --preset hdrp worldScale=0"),
    C("export wax.toml --preset hdrp worldScale=1 worldScale=2"),
    C("export wax.toml --preset hdrp --half"),
    C("export wax.toml --preset hdrp --format hlsl"),
    C("export wax.toml --preset babylon --strict"),
    C("export wax.toml --preset hdrp -o foreign.hlsl"),
    C("export wax.toml --preset hdrp -o foreign.hlsl --force"),
    C("export missing.toml --preset hdrp"),
    C("export wax.profile.npz"),
    C("export --format csv"),
    C("export wax.profile.npz --format frequency"),
    C("export wax.svd2.kernel.json --format frequency"),
    C("export angles.profile.npz --format angles"),
    C("export wax.profile.npz --format angles"),
    C("export wax.svd2.kernel.json --format angles"),
    C("export 'Größe λ.profile.npz' --format csv -o p.csv --json"),
    C("export leaf.profile.npz --format csv -o -"),
    C("export four.profile.npz --format csv -q"),
    C("export - --format csv -o out/x.csv", stdin="mono.profile.npz"),
    C("export --format csv --threads 2 --seed 3"),
    C("export wax.svd2.kernel.json"),
    C("export wax.svd2.kernel.json --format csv"),
    C("export wax.profile.npz --format hlsl"),
    C("export wax.svd2.kernel.json --format glsl"),
    C("export wax.svd2.kernel.json --format hlsl -o foreign.hlsl"),
    C("export wax.svd2.kernel.json --format hlsl -o foreign.hlsl --force"),
    C("export wax.svd2.kernel.json --format json -o wax.svd2.kernel.json"),
    C(
        "export --format json -o wax.svd2.kernel.json",
        set_up=_newest("wax.hand.taps.json", "wax.svd2.kernel.json"),
        note="the newest is the output, too",
    ),
    C(
        "export wax.hand.taps.json leaf.hand.taps.json --format wgsl -o two.wgsl --json",
        set_up=_leaf_taps,
    ),
    C("export five.kernel.json --format c -o -"),
    C("export wax.svd2.kernel.json --format json -o wax.svd2.kernel.json --force"),
    C("export wax.profile.npz --format csv -o foreign.csv"),
    *(
        C(f"export {name} --format {form} -o {output}")
        for name, form, output in (
            ("wax.svd2.kernel.json", "hlsl", "x.txt"),
            ("wax.svd2.kernel.json", "hlsl", "x.JSON"),
            ("wax.svd2.kernel.json", "json", "x.hlsl"),
            ("wax.profile.npz", "csv", "x.npz"),
        )
    ),
    C("export wax.profile.npz --format csv -o out"),
    C("export damaged.kernel.json --format json"),
    C("export --format hlsl", set_up=_into("empty"), note="in an empty folder"),
    C("export --format csv", set_up=_into("empty"), note="in an empty folder"),
    C("export grau.kernel.json --format json -o - --json"),
    C("export leaf.profile.npz --format csv -o - --json"),
    *(
        C(f"export out/wax.svd2.kernel.json --format {form}", set_up=_moved("wax.svd2.kernel.json"))
        for form in ("hlsl", "json")
    ),
    C("export out/mono.profile.npz --format csv -q", set_up=_moved("mono.profile.npz")),
    C(
        "export --format hlsl",
        set_up=_newest("wax.svd2.kernel.json", "grau.kernel.json"),
        note="another newest",
    ),
    C(
        "export --format csv",
        set_up=_newest("wax.profile.npz", "mono.profile.npz"),
        note="another newest",
    ),
    C("export p.csv --format csv -o p.csv", set_up=_copied("mono.profile.npz", "p.csv")),
    C("export k.hlsl --format hlsl -o k.hlsl", set_up=_copied("grau.kernel.json", "k.hlsl")),
    C("export k.json --format json -o x.json", set_up=_copied("grau.kernel.json", "k.json")),
    C("export wax.profile.npz --format json"),
    C("export wax.profile.npz --format lut"),
    C("export wax.profile.npz --format lut --table line --mm-per-pixel 0.25 -o line.dds --json"),
    C("export --format lut --table kernel --radius 2 -o square.png"),
    C("export mono.profile.npz --format lut --texels 16 -o -"),
    C("export wax.svd2.kernel.json --format lut --table kernel -q"),
    C("export wax.svd2.kernel.json --format lut"),
    C("export wax.hand.taps.json --format lut --table line"),
    C("export wax.profile.npz --format lut -o x.tif"),
    C("export wax.profile.npz --format lut -o foreign.exr"),
    C("export wax.profile.npz --format lut --radius 1m"),
    C("export wax.profile.npz --format lut --table lines"),
    C("export wax.profile.npz --format lut --texels 1e6"),
    C("export wax.profile.npz mono.profile.npz --format lut"),
    C("export wax.toml --format lut"),
    C("export wax.profile.npz --format csv --table line"),
    C("export wax.hand.taps.json --format csv"),
    C("export wax.profile.npz --format hlls"),
    C("export wax.svd2.kernel.json --format hlsl --strict"),
    C("export wax.profile.npz --format csv --strict -o strict.csv"),
    C("export missing.kernel.json --format hlsl"),
    C("export over.profile.npz --format csv", set_up=_over, note="more light than arrives"),
    C("export below.profile.npz --format csv", set_up=_below, note="negative energy"),
]

CHART = [
    C("chart"),
    C("chart wax.hand.taps.json"),
    C("chart wax.hand.taps.json --profile plate.toml"),
    C("chart wax.hand.taps.json --json -o x.svg"),
    C("chart 'Größe λ.profile.npz' -o 'Bild λ.svg' --json"),
    C("chart four.profile.npz -q --threads 1"),
    C("chart leaf.profile.npz -o -"),
    C("chart wax.svd2.kernel.json"),
    C("chart plate.artist.kernel.json --channel G -o p.pdf --json"),
    C("chart wax.svd2.kernel.json --profile wax.profile.npz --channel B"),
    C("chart vier.gaussians4.kernel.json --profile four.profile.npz"),
    C("chart grau.kernel.json"),
    C("chart -", stdin="grau.kernel.json"),
    C("chart plate.toml"),
    C("chart leaf.toml --json"),
    C("chart skin1 -v -o skin.png"),
    C("chart --spectrum"),
    C("chart --spectrum 'Größe λ.profile.npz' --mm-per-pixel .4 --json"),
    C("chart --frequency wax.profile.npz"),
    C("chart --frequency four.profile.npz --json -o f.svg"),
    C("chart wax.toml --frequency"),
    C("chart --angles angles.profile.npz"),
    C("chart --angles angles.profile.npz --json -o a.svg"),
    C("chart --angles wax.profile.npz"),
    C("chart --guide wax.profile.npz --mm-per-pixel profile"),
    C(
        "chart --guide 'Größe λ.profile.npz' --k 0,2 --channel R --mm-per-pixel .04cm --json -o g.svg"
    ),
    C("chart --models wax.toml --photons 1e3 --seed 3", terminal=True),
    C("chart --models wax.profile.npz -o m.pdf --json"),
    C("chart --models wax.toml --spectrum"),
    C("chart --models"),
    C("chart --models deon-skin"),
    C("chart --models leaf.profile.npz"),
    C("chart --models wax.profile.npz --photons 100"),
    C("chart --models skins.toml --photons 2e3", set_up=_SKINS),
    C("chart wax.profile.npz --photons 100"),
    C("chart wax.profile.npz --k 1"),
    C("chart wax.profile.npz --spectrum --channel R"),
    C("chart wax.profile.npz --channel R"),
    C("chart wax.profile.npz --guide --profile wax.profile.npz"),
    C("chart wax.profile.npz --guide --channel N"),
    C("chart four.profile.npz --guide --channel E"),
    C("chart wax.profile.npz --guide --k 1,2,3,4,0"),
    C("chart wax.svd2.kernel.json --guide"),
    C("chart wax.svd2.kernel.json --channel X"),
    C("chart wax.profile.npz -o x.gif"),
    C("chart wax.profile.npz -o foreign.png"),
    C("chart wax.profile.npz -o foreign.png --force"),
    C("chart foreign.csv"),
    C("chart", set_up=_newest("wax.profile.npz", "mono.profile.npz"), note="another newest"),
    C("chart out/wax.svd2.kernel.json --channel G", set_up=_moved("wax.svd2.kernel.json")),
    C("chart out/mono.profile.npz", set_up=_moved("mono.profile.npz")),
    C("chart --spectrum out/mono.profile.npz --mm-per-pixel .8", set_up=_moved("mono.profile.npz")),
    C("chart plate.toml -o - --json"),
    C("chart plate.toml -o - -q"),
    C("chart p.png -o p.png", set_up=_copied("mono.profile.npz", "p.png")),
    C(
        "chart wax.svd2.kernel.json --profile p.png -o p.png",
        set_up=_copied("wax.profile.npz", "p.png"),
    ),
    C("chart wax.svd2.kernel.json --profile mono.profile.npz"),
    C("chart --spectrum four.profile.npz --mm-per-pixel .9 -o s.svg"),
    C("chart --guide four.profile.npz --mm-per-pixel .9 --k 1.25 -o - "),
    C("chart --models m.png -o m.png", set_up=_copied("wax.toml", "m.png")),
    C("chart -", stdin="leaf.profile.npz"),
    C("chart plate.toml --channel R"),
    C("chart plate.toml --photons 20"),
    C("chart wax.svd2.kernel.json --k 2"),
    C("chart wax.svd2.kernel.json --mm-per-pixel 2"),
    C("chart --guide wax.profile.npz --photons 20"),
    C("chart --spectrum --guide"),
    C("chart --guide wax.profile.npz --k 5"),
    C("chart --guide wax.profile.npz --mm-per-pixel 9"),
    C(
        "chart --models thin.toml --photons 2e3",
        # Solved in a twentieth of the time that varnish.toml takes.
        set_up=_as("varnish.toml", "thin.toml", f"g = 0.8{_DENSE}[20]", f"g = 0{_DENSE}[1]"),
    ),
]


def _checkpoint() -> None:
    """A walk of two materials, saved and not finished."""
    from sssfit.material import load_material
    from sssfit.simulate import Checkpoint, simulate_montecarlo_many

    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) > 2

    simulate_montecarlo_many(
        [load_material("wax.toml")],
        photons=200_000,
        dr_mm=0.5,
        radius_mm=4.0,
        checkpoint=Checkpoint(Path("w.npz.checkpoint"), 0.0),
        stop=stop,
    )


def _checkpoint_of_two() -> None:
    """A walk of three materials that was never finished."""
    from sssfit.material import load_material
    from sssfit.simulate import Checkpoint, simulate_montecarlo_many

    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) > 2

    Path("lard.toml").write_text(world.WAX.replace("wax", "lard").replace("0.7", "0.6"))
    simulate_montecarlo_many(
        [load_material("wax.toml"), load_material("lard.toml")],
        photons=200_000,
        dr_mm=0.5,
        radius_mm=4.0,
        checkpoint=Checkpoint(Path("w.npz.checkpoint"), 0.0),
        stop=stop,
    )


SHOW = [
    C("show"),
    C("show wax.hand.taps.json"),
    C("show - --json", stdin="wax.hand.taps.json"),
    C("show damaged.taps.json"),
    C("show wax.profile.npz --json"),
    C("show 'Größe λ.profile.npz'"),
    C("show 'Größe λ.profile.npz' --json"),
    C("show leaf.profile.npz -v"),
    C("show four.profile.npz"),
    C("show four.profile.npz --json"),
    C("show mono.profile.npz"),
    C("show wax.svd2.kernel.json"),
    C("show plate.artist.kernel.json"),
    C("show plate.artist.kernel.json --json"),
    C("show grau.kernel.json"),
    C("show leaf.burley.kernel.json"),
    C("show vier.gaussians4.kernel.json"),
    C("show wax.gaussians3.kernel.json"),
    C("show five.kernel.json --json"),
    C("show five.kernel.json -q"),
    C("show plate.toml"),
    C("show leaf.toml --json"),
    C("show skin1"),
    C("show -", stdin="leaf.toml"),
    C("show - --json", stdin="grau.kernel.json"),
    C("show -", stdin="mono.profile.npz"),
    C("show -", stdin="foreign.csv"),
    C("show w.npz.checkpoint", set_up=_checkpoint),
    C("show w.npz.checkpoint --json", set_up=_checkpoint),
    C("chart w.npz.checkpoint", set_up=_checkpoint),
    C(
        "simulate wax.toml --photons 2e5 --dr .5 --radius 4 -o w.npz --resume -v",
        set_up=_checkpoint,
    ),
    C("simulate wax.toml --photons 2e5 --dr .5 --radius 3 -o w.npz --resume", set_up=_checkpoint),
    C("show w.npz.checkpoint", set_up=_checkpoint_of_two, note="of two"),
    C("show w.npz.checkpoint --json", set_up=_checkpoint_of_two, note="of two"),
    C("chart w.npz.checkpoint -o two.svg", set_up=_checkpoint_of_two, note="of two"),
    C("show skin2"),
    C("show missing.npz"),
    C("show out"),
    C("show foreign.npz"),
    C("show density.csv"),
    C("show broken.toml"),
    C("show damaged.profile.npz"),
    C("show damaged.kernel.json"),
    C("show", set_up=_into("empty"), note="in an empty folder"),
    C("show", set_up=_newest("wax.profile.npz", "mono.profile.npz"), note="another newest"),
    C("show varnish.toml"),
    C("show mono.profile.npz --json"),
    C("show leaf.burley.kernel.json --json"),
    C("show wax.svd2.kernel.json --json"),
    C("show vier.gaussians4.kernel.json --json"),
    C("show plate.toml --json"),
    C("show deon-skin"),
    C("show Skin1"),
    C(f"show {'abcdefghij' * 120}"),
]

STABILITY = [
    C("stability wax.profile.npz --only hard-light --mm-per-pixel .5 --table t.md"),
    C("stability wax.profile.npz --only hard-light --mm-per-pixel .5 --chart s.png -q"),
    C("stability mono.profile.npz --only hard-light --mm-per-pixel .5 --json --seed 2"),
    C("stability - --only hard-light --mm-per-pixel .5 --table -", stdin="mono.profile.npz"),
    C("stability mono.profile.npz --only hard-light --mm-per-pixel .5 --whole --threads 1"),
    C("stability mono.profile.npz --only hard-light --table foreign.md"),
    C("stability mono.profile.npz --only hard-light --mm-per-pixel .5 --table foreign.md --force"),
    C("stability mono.profile.npz --only hard-light --chart s.exr"),
    C("stability wax.profile.npz --only nois"),
    C("stability wax.profile.npz --only hard-light --mm-per-pixel 0"),
    C("stability wax.profile.npz --only hard-light --mm-per-pixel nan"),
    C("stability deon-skin --only noise"),
    C("stability deon-skin --only pixel-size -v"),
    C("stability missing.toml"),
    C("stability density.csv"),
    C("stability"),
    C("stability wax.profile.npz --paper"),
    C("stability --paper --chart s.png"),
    C("stability wax.profile.npz -o out"),
]

_MOVING = "--mm-per-pixel .5 --length 8"
_TINY = f"{_MOVING} --size 10x6 --irradiance edge"
_BRIEF = "--mm-per-pixel .5 --length 3 --size 10x6"

MOTION = [
    C(f"motion wax.profile.npz {_TINY} --only without,ahead --chart m.png"),
    C(f"motion wax.profile.npz {_MOVING} --size 10x6 --light sinusoidal --only fixed --json"),
    C(f"motion - {_TINY} --light gunshot --only variates --seed 3", stdin="mono.profile.npz"),
    C(f"motion wax.profile.npz {_TINY} --target-variance .05 --only separable"),
    C(f"motion mono.profile.npz {_TINY} --light still --target-variance .05 --only cascade"),
    C(f"motion mono.profile.npz {_TINY} --shift 1,-2 --only without --chart m.svg --threads 1"),
    C(f"motion wax.profile.npz {_MOVING} --irradiance plain.png --only variates"),
    C(
        "motion wax.profile.npz --length 4 --irradiance layers.exr --layer near --mm-per-pixel .25 --only fixed"
    ),
    C(f"motion mono.profile.npz {_TINY} --only without --chart -"),
    C(f"motion mono.profile.npz {_BRIEF} --only without --frames out"),
    C(f"motion leaf.profile.npz {_BRIEF} --frames shots --format exr --of fixed --only without -q"),
    C(f"motion leaf.profile.npz {_BRIEF} --frames shots"),
    C(f"motion mono.profile.npz {_TINY} --only fixed", terminal=True),
    C(
        f"motion mono.profile.npz {_BRIEF} --only variates --frames out",
        set_up=_copied("foreign.png", "out/frame-0002.png"),
        note="a foreign file in the way",
    ),
    C(
        f"motion mono.profile.npz {_BRIEF} --only variates --frames out --force",
        set_up=_copied("foreign.png", "out/frame-0002.png"),
        note="a foreign file in the way",
    ),
    C(f"motion mono.profile.npz {_BRIEF} --frames foreign.md"),
    C(f"motion mono.profile.npz {_BRIEF} --frames no/such/folder"),
    C(f"motion mono.profile.npz {_BRIEF} --chart foreign.png --frames shots"),
    C(f"motion mono.profile.npz {_TINY} --chart m.exr"),
    C("motion --table --seeds 3 --chart t.png"),
    C("motion --table --seeds 4 --seed 2 --json"),
    C("motion --table -v"),
    C("motion"),
    C("motion wax.profile.npz --table"),
    C("motion --table --length 5"),
    C("motion --table --seeds 0"),
    C("motion wax.profile.npz --seeds 5"),
    C("motion wax.profile.npz --of fixed"),
    C("motion wax.profile.npz --format exr"),
    C("motion wax.profile.npz --light strob"),
    C("motion wax.profile.npz --only adaptive"),
    C("motion wax.profile.npz --shift 1.5,0"),
    C("motion wax.profile.npz --shift 1"),
    C("motion wax.profile.npz --length 1"),
    C("motion wax.profile.npz --target-variance 0"),
    C("motion wax.profile.npz --size 0x5"),
    C("motion wax.profile.npz --layer far"),
    C("motion wax.profile.npz --irradiance plain.png --size 5x5"),
    C("motion wax.profile.npz --irradiance missing.exr"),
    C("motion four.profile.npz --irradiance plain.png --mm-per-pixel .5"),
    C("motion four.profile.npz --irradiance plain.png"),
    C("motion missing.toml"),
]

_BALLS = "--mesh ball.obj --resolution 40x30 --map-size 32"
_ROW = f"scene wax.svd2.kernel.json {_BALLS}"
_TABLED = "scene wax.svd2.kernel.json --mesh ball.obj --resolution 8x6 --map-size 16 --table"

SCENE = [
    C(_ROW),
    C(f"{_ROW} --heads 3 --distance 7 --savings culled --culled-by face -o s.exr"),
    C(f"{_ROW} --heads 2 --head 2 --spacing 1.5 --fov 40 --margin 1.2 --bloom .1 -o s.png -v"),
    C(
        f"scene wax.gaussians3.kernel.json {_BALLS} --savings depth,clipped --json --threads 1 --seed 2"
    ),
    C(f"scene - {_BALLS} -o -", stdin="wax.svd2.kernel.json"),
    C(f"scene wax.hand.taps.json {_BALLS} --distance 5 -q"),
    C("scene wax.svd2.kernel.json --resolution 8x6 --map-size 64", note="the made head"),
    C(f"scene {_BALLS} --distance 5", note="the default kernel"),
    C(f"{_ROW} -o foreign.png"),
    C(f"{_ROW} -o foreign.png --force"),
    C(f"{_ROW} -o no/such/folder.exr"),
    C(f"{_ROW} -o s.jpg"),
    C(f"{_TABLED} --chart t.png"),
    C(f"{_TABLED} --json"),
    C(f"{_ROW} --table --chart t.exr"),
    C(f"{_ROW} --table --chart foreign.png"),
    C(f"{_ROW} --table --heads 3"),
    C(f"{_ROW} --table -o s.exr"),
    C(f"{_ROW} --chart t.png"),
    C(f"{_ROW} --bloom .1"),
    C(f"{_ROW} --bloom 2 -o s.png"),
    C(f"{_ROW} --savings cull"),
    C(f"{_ROW} --heads 0"),
    C(f"{_ROW} --heads 65"),
    C(f"{_ROW} --distance 0"),
    C(f"{_ROW} --distance 1"),
    C(f"{_ROW} --fov 180"),
    C(f"{_ROW} --head nan"),
    C(f"{_ROW} --map-size 4"),
    C(f"{_ROW} --resolution 40"),
    C(f"{_ROW} --culled-by edge"),
    C("scene wax.svd2.kernel.json --mesh bare.obj"),
    C("scene wax.svd2.kernel.json --mesh missing.obj"),
    C("scene wax.svd2.kernel.json --mesh plain.png"),
    C("scene missing.kernel.json"),
    C("scene wax.profile.npz"),
]

# What is refused alone: a page has times in it, and is looked at in test_report_browser.
REPORT = [
    C("report"),
    C("report wax.toml --all"),
    C("report --all --only svd"),
    C("report --all --kernel wax.hand.taps.json"),
    C("report --all -o m.png"),
    C("report wax.toml --kernel wax.svd2.kernel.json --photons 5000 -q"),
    C("report wax.toml --kernel missing.taps.json --json"),
    C("report wax.toml --irradiance missing.exr --mm-per-pixel .4 -v"),
    C("report wax.toml -o a.png --force"),
    C("report wax.toml -o no/such/folder.html"),
    C("report wax.toml --only disc"),
    C("report wax.toml --photons 1"),
    C("report wax.toml --mm-per-pixel 0"),
    C("report wax.toml --threads 0 --seed 2"),
    C("report missing.toml"),
]

_POINTS = _write(
    "points.toml",
    'material = "wax.toml"\nmethod = "burley"\n[grid]\ndr_mm = 0.5\nradius_mm = 6\n'
    '[[axes]]\nkey = "eta"\nvalues = [1.3, 1.5]\n'
    '[[axes]]\nkey = "albedo"\nfrom = 0.5\nto = 0.9\ncount = 3\n',
)


_MONO = (
    'name = "mono"\nchannels = ["mono"]\neta = 1.4\ng = 0.0\nsigma_a_per_mm = [0.1]\n'
    "sigma_s_per_mm = [2.0]\n"
)


def _swept() -> None:
    _POINTS()
    sweep_to_store(load_plan("points.toml"), "points.zarr", threads=1)


def _coloured() -> None:
    """Store a sweep over wavelengths: a wax that is red, at two depths of its dye."""
    _write("mono.toml", _MONO)()
    _write("bands.csv", "wavelength_nm,dye\n400,0.9\n500,0.5\n600,0.1\n700,0.02\n")()
    _write(
        "red.toml",
        'material = "mono.toml"\nmethod = "burley"\n[grid]\ndr_mm = 0.5\nradius_mm = 6\n'
        '[[axes]]\nname = "depth"\nvalues = [0.5, 1]\n[[axes]]\ntable = "bands.csv"\n'
        '[set]\nsigma_a_per_mm = "depth * dye"\n',
    )()
    sweep_to_store(load_plan("red.toml"), "red.zarr", threads=1)


def _plan(*lines: str) -> Callable[[], object]:
    """Write a plan of the wax with other lines behind its head."""
    return _write("p.toml", "\n".join(('material = "wax.toml"', *lines)))


_ETA = '[[axes]]\nkey = "eta"\nvalues = [1.3, 1.5]'

SWEEP = [
    C("sweep points.toml --threads 1", set_up=_POINTS, brief=True),
    C("sweep points.toml --threads 1 -o s.zarr --seed 3 --json -v", set_up=_POINTS, brief=True),
    C("sweep points.toml --threads 1 -q", set_up=_POINTS, brief=True),
    C("sweep points.toml --threads 1", set_up=_swept, note="a store is there"),
    C("sweep points.toml --threads 1 --resume", set_up=_swept, brief=True),
    C("sweep points.toml --threads 1 --force", set_up=_swept, brief=True),
    C("sweep points.toml --threads 1 --resume --seed 5", set_up=_swept, brief=True),
    C("sweep points.toml --dry-run --threads 1", set_up=_POINTS),
    C("sweep points.toml --dry-run --threads 1 --json", set_up=_POINTS),
    C("sweep points.toml --dry-run -o s.zarr", set_up=_POINTS),
    C("sweep points.toml --resume --force", set_up=_POINTS),
    C("sweep points.toml -o foreign.md", set_up=_POINTS),
    C("sweep points.toml -o out --force", set_up=_POINTS),
    C("sweep points.toml -o no/such/s.zarr", set_up=_POINTS),
    C("sweep points.toml --scheduler 10.0.0.5:8786", set_up=_POINTS),
    C("sweep points.toml --scheduler local:0", set_up=_POINTS),
    C("chart red.zarr", set_up=_coloured),
    C("chart red.zarr --json -o red.svg", set_up=_coloured),
    C("chart red.zarr --spectrum", set_up=_coloured),
    C("chart points.zarr", set_up=_swept, note="no wavelengths"),
    C("sweep missing.toml"),
    C("sweep wax.toml"),
    C("sweep wax.profile.npz"),
    C("sweep p.toml", set_up=_plan("mehtod = 'exact'", _ETA), note="a typo"),
    C("sweep p.toml", set_up=_plan("method = 'exact'", _ETA, "[set]\ng = 'x'"), note="a name"),
    C("sweep p.toml", set_up=_plan(_ETA.replace("1.5", "nan")), note="NaN"),
    C("sweep p.toml", set_up=_plan(_ETA.replace("1.5", "15")), note="a point out of range"),
    C(
        "sweep p.toml",
        set_up=_plan(
            *(
                f'[[axes]]\nkey = "{key}"\nfrom = 0.1\nto = 0.5\ncount = 1000'
                for key in ("g", "albedo")
            )
        ),
        note="a million points",
    ),
]

COMMANDS = {
    "help": HELP,
    "sweep": SWEEP,
    "report": REPORT,
    "stability": STABILITY,
    "motion": MOTION,
    "scene": SCENE,
    "materials": MATERIALS,
    "simulate": SIMULATE,
    "fit": FIT,
    "render": RENDER,
    "compare": COMPARE,
    "choose": CHOOSE,
    "import": IMPORT,
    "export": EXPORT,
    "chart": CHART,
    "show": SHOW,
    "own": OWN,
}
