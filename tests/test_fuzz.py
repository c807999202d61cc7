"""Damaged files and senseless options: a clear line or a right result, and nothing in between.

Every case runs the command line in this process. Whatever arrives, the exit status is 0, 1 or 2; a
failure is one line on stderr that begins with "Error: " (after click's usage where the status is
2), a success none; warnings are lines of their own; no traceback, no line that does not print. A
failure leaves the folder as it was, and what a success wrote can be read back.

The damage is in ``mutations``. Hypothesis chooses it, always alike. A few hundred cases run by
default; ``pytest -m slow tests/test_fuzz.py`` runs 10 000.
"""

import io
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
import types
from pathlib import Path

import click
import fork_server
import jsonschema
import mutations
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference_pixels import make_profile
from test_mco import mco_text

import sssfit
from sssfit.cli import cli, main
from sssfit.errors import SssfitError
from sssfit.fit import fit_svd
from sssfit.formats.csv import csv_text, parse_csv
from sssfit.formats.pictures import load_image, save_image
from sssfit.kernel import SeparableKernel
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate import Checkpoint, simulate_montecarlo

SCHEMA = json.loads((Path(sssfit.__file__).parent / "kernel.schema.json").read_text("utf-8"))
DATA = Path(__file__).parent / "data"
SKIN = (Path(sssfit.__file__).parents[1] / "materials" / "skin1.toml").read_bytes()
STACK = b"""name = "stack"
channels = ["R", "G"]
eta_above = 1.0
[[layers]]
eta = 1.4
g = [0.8, 0.7]
sigma_a_per_mm = [0.1, 0.2]
sigma_s_per_mm = [4.0, 5.0]
thickness_mm = 0.5
[[layers]]
eta = 1.5
g = 0
sigma_a_per_mm = [0.5, 0.6]
sigma_s_per_mm = [1, 2]
"""
POINTS = b"""material = "skin1"
method = "burley"
[grid]
dr_mm = 0.4
radius_mm = 8.0
[[axes]]
key = "eta"
values = [1.3, 1.5]
[[axes]]
name = "n"
from = 0.5
to = 0.9
count = 3
[set]
"sigma_a_per_mm.R" = "n * 0.1 + 1 / (2 - n)"
"""
CUT_SECONDS = 2.0  # a run of odd options may be a long one; it is then interrupted
MOST_SECONDS = 60.0  # for a case; the slowest take a second on an idle machine
MOST_BYTES = 1_500_000_000  # what a case may add to the memory that was ever used
FEW = ("--photons", "3")
STRICT = """
import sys, warnings
from sssfit.cli import main
warnings.simplefilter("error")
main(sys.argv[1:])
"""

posix = pytest.mark.skipif(os.name != "posix", reason="forks are POSIX")
pytestmark = pytest.mark.filterwarnings("error")


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """A sound file of every kind."""
    r = np.linspace(0.0, 4.0, 21)
    energy = np.diff(0.5 - 0.5 * np.exp(-r / 0.4))[:, None] * [1.0, 0.5, 0.2]
    profile = simulate_montecarlo(load_material("skin1"), photons=2000, dr_mm=0.4, radius_mm=8.0)
    wax = make_profile(r, energy)
    folder = tmp_path_factory.mktemp("originals")
    checkpoint = Checkpoint(folder / "c", resume=False)
    stops = iter([False, False, False])
    walk = {"photons": 10**8, "dr_mm": 0.4, "radius_mm": 8.0, "threads": 1}
    simulate_montecarlo(
        load_material("skin1"), **walk, checkpoint=checkpoint, stop=lambda: next(stops, True)
    )
    kernel = io.BytesIO()
    fit_svd(wax, rank=2, mm_per_pixel=0.2, support_mm=1.5).kernel.write(kernel)
    packed = io.BytesIO()
    profile.write(packed)
    save_image(folder / "light.exr", np.full((6, 8, 3), 0.5))
    return {
        "x.toml": SKIN,
        "stack.toml": STACK,
        "points.toml": POINTS,
        "x.mci": (DATA / "sample.mci").read_bytes(),
        "x.mco": mco_text().encode(),
        "x.csv": csv_text(wax).encode(),
        "x.profile.npz": packed.getvalue(),
        "x.kernel.json": kernel.getvalue(),
        "skin1.profile.npz.checkpoint": (folder / "c").read_bytes(),
        "light.exr": (folder / "light.exr").read_bytes(),
    }


@pytest.fixture
def bench(tmp_path, monkeypatch, capfd):
    """An empty folder to work in, and what reads all that a run prints."""
    monkeypatch.chdir(tmp_path)
    return types.SimpleNamespace(folder=tmp_path, read=capfd.readouterr)


@pytest.fixture
def work(tmp_path):
    """An empty folder in one that holds what was read and printed."""
    (tmp_path / "work").mkdir()
    return tmp_path / "work"


# What a damaged file is tried with; {} stands for its name.
TRIALS = {
    "x.toml": (
        ("simulate", "{}", *FEW, "-o", "out.npz"),
        ("simulate", "{}", "--method", "dipole", "-o", "out.npz"),
        ("materials", "{}"),
        ("simulate", "-", *FEW, "-o", "out.npz"),
        ("show", "{}"),
    ),
    "stack.toml": (("simulate", "{}", *FEW, "-o", "out.npz"), ("materials", "{}", "--json")),
    "points.toml": (("sweep", "{}", "--dry-run", "--threads", "1"),),
    "x.mci": (("simulate", "{}", *FEW, "-o", "out.npz"),),
    "x.mco": (("import", "{}", "-o", "out.npz"), ("import", "-", "-o", "out.npz")),
    "x.csv": (
        ("import", "{}", "--quantity", "energy", "-o", "out.npz"),
        ("import", "{}", "-o", "out.npz"),
    ),
    "x.profile.npz": (
        ("show", "{}"),
        ("show", "-", "--json"),
        ("export", "{}", "--format", "csv", "-o", "out.csv"),
        ("fit", "{}", "--method", "svd", "--mm-per-pixel", "0.4", "-o", "out.json"),
        ("fit", "{}", "--method", "preintegrated", "-o", "out.json"),
        ("chart", "{}", "-o", "out.png"),
    ),
    "x.kernel.json": (
        ("export", "{}", "--format", "hlsl", "-o", "out.hlsl"),
        ("export", "{}", "--format", "json", "-o", "out.json"),
        ("export", "-", "--format", "hlsl", "-o", "out.hlsl"),
        ("show", "{}"),
        ("show", "{}", "--json"),
        ("chart", "{}", "-o", "out.png"),
        ("render", "{}", "--irradiance", "disk", "--size", "16x12", "-o", "out.exr"),
        ("render", "{}", "--screen", "--size", "12x12", "-o", "out.exr"),
    ),
    "skin1.profile.npz.checkpoint": (
        ("simulate", "skin1", "--dr", "0.4", "--radius", "8", "--photons", "70000", "--resume"),
        ("show", "{}"),
    ),
}
RARE = "chart"  # takes ten times as long as the others


def damaged(rng, name, content):
    """The file after damage of its kind."""
    if name.endswith((".npz", ".checkpoint")):
        return mutations.damaged_npz(rng, content)
    if name.endswith(".json"):
        return mutations.damaged_json(rng, content)
    return mutations.damaged_text(rng, content)


def snapshot(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def emptied(folder):
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def most_memory():
    """The most bytes this process ever held; 0 where the system does not say."""
    if sys.platform != "linux":
        return 0
    import resource

    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def run(bench, arguments, stdin=b""):
    """Run the command line, hold it to the rules at the head of this file, and give its status."""
    before, memory, begun = snapshot(bench.folder), most_memory(), time.perf_counter()
    terminate = signal.getsignal(signal.SIGTERM)
    status = ended(arguments, stdin)
    signal.signal(signal.SIGTERM, terminate)
    out, err = bench.read()
    assert "Traceback" not in out
    assert time.perf_counter() - begun < MOST_SECONDS
    assert most_memory() - memory < MOST_BYTES
    check_ending(status, err, before, snapshot(bench.folder), bench.folder)
    return status


def ended(arguments, stdin):
    """Run the command line here; give its exit status."""
    kept, sys.stdin = sys.stdin, io.TextIOWrapper(io.BytesIO(stdin))
    try:
        with pytest.raises(SystemExit) as ending:
            main(list(arguments))
    finally:
        sys.stdin = kept
    return ending.value.code or 0


def run_apart(folder, arguments, stdin):
    """As `run`, in a process of its own: odd options may ask for hours, and are interrupted."""
    before, given = snapshot(folder), folder.parent / "stdin"
    given.write_bytes(stdin)
    is_cut = False
    with given.open() as stream:
        process = fork_server.start(
            [sys.executable, "-c", STRICT, *arguments], cwd=folder, stdin=stream
        )
    try:
        out, err = process.communicate(timeout=CUT_SECONDS)
    except subprocess.TimeoutExpired:
        is_cut = True
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=MOST_SECONDS - CUT_SECONDS)
    status = process.returncode
    assert "Traceback" not in out
    if is_cut and status == 130:
        assert err.endswith("Interrupted.\n"), err
        status, err = 0, ""
    check_ending(status, err, before, snapshot(folder), folder)
    return status


def check_ending(status, err, before, after, folder):
    """One of three ends; a failure changes nothing, and what a success wrote is whole."""
    assert status in (0, 1, 2), (status, err)
    check_words(status, err)
    if status:
        assert after == before
    for name in after:
        if after[name] != before.get(name):
            check_written(folder / name)


def check_words(status, err):
    """One line says what is wrong; warnings are lines of their own, and all of them print."""
    lines = [line for line in err.split("\n")[:-1] if not line.startswith("Warning: ")]
    assert all(line.isprintable() for line in err.split("\n")), err
    assert "internal error" not in err, err
    if status == 2 and lines and lines[0].startswith("Usage: "):
        assert lines[1].startswith("Try ")
        assert lines[2] == ""
        del lines[:3]
    assert len(lines) == (status != 0), (status, err)
    assert all(line.startswith("Error: ") for line in lines), err
    assert all(len(line) < 1100 for line in err.split("\n")), err


def check_written(path):
    """Whatever was written is whole: it can be read back as what it is."""
    content = path.read_bytes()
    if content.startswith(b"PK"):
        Profile.load(path)
    elif content.startswith(b'{\n "format": "sssfit.kernel') or b'"comment": [' in content[:20]:
        SeparableKernel.load(path)
        jsonschema.validate(json.loads(content), SCHEMA)
    elif content.startswith(b"// "):
        check_hlsl(content.decode())
    elif content.startswith(b"# sssfit.profile.csv"):
        parse_csv(content.decode(), path.name)
    elif content.startswith((b"name = ", b"# ")):
        load_material(path)
    elif content.startswith((b"v/1\x01", b"II*\x00", b"\x89PNG")):
        assert np.isfinite(load_image(path).pixels).all()
    else:
        assert content.startswith((b"<?xml", b"%PDF", b"|", b"[", b"picture")), content[:50]


def check_hlsl(text):
    """Comments, constants and finite numbers, nothing else."""
    constants = re.sub(r"^// .*$| // [a-z ,]+$", "", text, flags=re.MULTILINE)
    numbers = re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", re.sub(r"float\d|SSS_\w+", "", constants))
    assert np.isfinite(np.array(numbers, dtype=np.float64).astype(np.float32)).all()
    skeleton = re.sub(r"-?\d+\.?\d*(?:e[-+]?\d+)?(?<=\d)u?", "0", constants)
    assert set(re.sub(r"static const (uint|float0?) SSS_\w+|float0", "", skeleton)) <= set(
        "0 \n[]{}()=;,"
    )


def fuzz(examples):
    """Settings of so many cases, the same ones in every run."""
    return settings(
        max_examples=examples,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )


def try_files(bench, originals, kind, examples):
    """Damage a file of one kind so many times, each time with another use of it."""

    @fuzz(examples)
    @given(st.integers(0, 2**63))
    def trial(seed):
        rng = random.Random(seed)
        emptied(bench.folder)
        content = damaged(rng, kind, originals[kind])
        name = kind if kind.endswith(".checkpoint") else f"in{Path(kind).suffix}"
        (bench.folder / name).write_bytes(content)
        trials = [each for each in TRIALS[kind] if RARE not in each or rng.random() < 0.1]
        arguments = [each.format(name) for each in rng.choice(trials)]
        run(bench, [*arguments, "-q"], content)

    trial()


@pytest.mark.parametrize("kind", TRIALS)
def test_damaged_files(bench, originals, kind):
    try_files(bench, originals, kind, 30)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", TRIALS)
def test_thousands_of_damaged_files(bench, originals, kind):
    try_files(bench, originals, kind, 1100)


@pytest.mark.parametrize("kind", TRIALS)
def test_sound_files_are_taken(bench, originals, kind):
    name = kind if kind.endswith(".checkpoint") else f"in{Path(kind).suffix}"
    for each in TRIALS[kind]:
        emptied(bench.folder)
        (bench.folder / name).write_bytes(originals[kind])
        arguments = [word.format(name) for word in each]
        assert run(bench, [*arguments, "-q"], originals[kind]) == 0, arguments


# Options


ODD = (
    *mutations.WORDS,
    *("1e-300", "1e308", "1e-320", "1.5", "2", "3", "0.1", "50%", "0.1%", "3cm", "-3mm", "1e400m"),
    *("a,b", "1,2,3", ",", "R,G,B", "R,R,R", "1x1", "8x6", "0x0", "90000x90000", "-1x5", "x"),
    *(
        "disk",
        "head",
        "edge",
        "light.exr",
        "x.toml",
        "x.profile.npz",
        "x.kernel.json",
        "x.csv",
        "-",
    ),
    *("no/such/folder/out.npz", ".", "..", "deep", "a\nb", "a\x1b[31mb", "a" * 300),
    *(
        "out.npz",
        "out.json",
        "out.exr",
        "out.png",
        "out.toml",
        "out.hlsl",
        "out.csv",
        "é",
        "\udcff",
    ),
    "x" * 5000,
)
FILES = (
    "x.toml",
    "x.profile.npz",
    "x.kernel.json",
    "x.csv",
    "x.mco",
    "x.mci",
    "skin1",
    "none",
    "-",
)
# Where there is nothing to stop them these would walk 1e7 photons or render large pictures.
SMALL = {
    "simulate": (*FEW, "--dr", "0.4", "--radius", "8"),
    "render": ("--size", "8x6"),
    "compare": ("--size", "8x6", *FEW),
    "choose": ("--resolution", "8x6"),
    "motion": ("--size", "8x6", "--length", "3", "--only", "variates"),
    "scene": ("--resolution", "8x6", "--map-size", "16"),
    "sweep": ("--dry-run", "--threads", "1"),
    "report": ("--only", "disk"),
}
SLOW = ("compare", "choose", "stability", "motion", "scene", "report")
# What each verb reads, and the options it cannot do without.
USUAL = {
    "simulate": ("x.toml",),
    "sweep": ("points.toml",),
    "fit": ("x.profile.npz", "--method", "svd", "--mm-per-pixel", "0.4"),
    "render": ("x.kernel.json", "--irradiance", "disk"),
    "compare": ("x.profile.npz",),
    "choose": ("skin1",),
    "stability": ("x.profile.npz", "--only", "hard-light"),
    "motion": ("x.profile.npz",),
    "scene": ("x.kernel.json",),
    "report": ("x.profile.npz",),
    "import": ("x.csv",),
    "export": ("x.profile.npz", "--format", "csv"),
    "chart": ("x.profile.npz",),
    "show": ("x.profile.npz",),
    "materials": ("x.toml",),
}
# What options of a type like; those of other names are written as they may be of any type.
LIKELY = {
    "length": ("0.2", "1mm", "0.05cm", "2"),
    "radius": ("auto", "3"),
    "support": ("auto", "2mm"),
    "size": ("8x6", "3x3"),
    "count": ("2", "1000", "1e3"),
    "share": ("10%", "0.5"),
    "shift": ("1,0", "-2,3"),
    "whole number": ("1", "2", "3"),
    "number": ("0.5", "1", "1.4", "30"),
    "text": (
        "disk",
        "edge",
        "R",
        "light.exr",
        "out.npz",
        "out.json",
        "out.exr",
        "out.csv",
        "out.png",
    ),
}


def option_list(rng):
    """A verb, a file and up to four of its options, with what they like or something odd."""
    verb = rng.choice(sorted(cli.commands))
    if verb in SLOW and rng.random() < 0.8:
        verb = "render"
    name, *needed = USUAL[verb]
    words = [verb, *SMALL.get(verb, ())]
    if rng.random() < 0.9:
        words.append(name if rng.random() < 0.7 else rng.choice(FILES))
    if rng.random() < 0.8:
        words += needed
    options = [each for each in cli.commands[verb].params if isinstance(each, click.Option)]
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        option = rng.choice(options)
        words.append(rng.choice(option.opts))
        if not option.is_flag:
            words.append(likely_or_odd(rng, option))
    if rng.random() < 0.05:
        words.insert(rng.randrange(len(words)), rng.choice(ODD))
    return words


def likely_or_odd(rng, option):
    likely = list(getattr(option.type, "choices", LIKELY.get(option.type.name, ("0.5,0.4,0.3",))))
    return rng.choice(likely if rng.random() < 0.5 else ODD)


def try_options(folder, originals, examples):
    """Give verbs so many lists of options."""

    @fuzz(examples)
    @given(st.integers(0, 2**63))
    def trial(seed):
        rng = random.Random(seed)
        emptied(folder)
        (folder / "deep").mkdir()
        for name, content in originals.items():
            (folder / name).write_bytes(content)
        run_apart(folder, [*option_list(rng), "-q"], originals[rng.choice(FILES[:6])])

    trial()


@posix
def test_odd_options(work, originals):
    try_options(work, originals, 25)


@posix
@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_twelve_hundred_option_lists(work, originals):
    try_options(work, originals, 1200)


def test_the_rules_are_held_to(bench, monkeypatch):
    """A fuzz that could not fail would show nothing: break each rule once."""

    def breaking(act):
        def broken(*_arguments, **_keywords):
            act()

        return broken

    def fail(line, status=1):
        sys.stderr.write(line)
        sys.exit(status)

    for act in (
        lambda: fail("Error: a\nb\n"),
        lambda: fail("Error: a\x1b[31m\n"),
        lambda: fail("oops\n"),
        lambda: fail("", 1),
        lambda: fail("Error: a\n", 0),
        lambda: fail("Error: a\n", 3),
        lambda: fail("Error: internal error, KeyError\n"),
        lambda: ((bench.folder / "out.npz").write_bytes(b"PK"), sys.exit(0)),
        lambda: ((bench.folder / "out.hlsl").write_text("static const int x = 1;"), sys.exit(0)),
        lambda: ((bench.folder / "out.png").write_bytes(b"x"), sys.exit(0)),
        lambda: ((bench.folder / "out.png").write_bytes(b"x"), fail("Error: a\n")),
    ):
        emptied(bench.folder)
        monkeypatch.setattr(sys.modules[__name__], "main", breaking(act))
        with pytest.raises((AssertionError, SssfitError)):
            run(bench, ["show"])
    emptied(bench.folder)
    monkeypatch.setattr(sys.modules[__name__], "main", breaking(lambda: fail("Error: a\n")))
    assert run(bench, ["show"]) == 1
