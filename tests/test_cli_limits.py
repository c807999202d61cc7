"""Too little memory, nonsense in the environment, numbers at the end of their range: one line."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import fork_server
import numpy as np
import pytest
from reference_pixels import make_profile

from sssfit import files
from sssfit.cli import main
from sssfit.errors import FitError, SimulationError
from sssfit.fit import fit_svd
from sssfit.process import is_out_of_memory
from sssfit.simulate._run import EndCondition

posix = pytest.mark.skipif(os.name != "posix", reason="limits are POSIX")

TOML = """
name = "wax"
channels = ["R"]
eta = 1.3
g = 0.0
sigma_a_per_mm = [0.1]
sigma_s_per_mm = [1.0]
"""

PLAN = """
material = "wax.toml"
method = "dipole"
[[axes]]
key = "eta"
values = [1.3, 1.4]
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    r = np.linspace(0.0, 4.0, 41)
    profile = make_profile(r, np.diff(0.5 - 0.5 * np.exp(-r / 0.4))[:, None] * [1.0, 0.5, 0.2])
    profile.save(folder / "wax.profile.npz")
    fit_svd(profile, rank=1, mm_per_pixel=0.2).kernel.save(folder / "wax.kernel.json")
    (folder / "wax.toml").write_text(TOML)
    (folder / "plan.toml").write_text(PLAN)
    (folder / "wax.csv").write_text("r_mm,R\n0.5,0.1\n2,0.05\n")
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def sssfit(folder, *arguments, megabytes=None, most_open=None, timeout=120, **environment):
    """Run it in a new process, under a limit of its address space or files if one is given."""

    def limit():
        import resource

        if megabytes:
            resource.setrlimit(resource.RLIMIT_AS, (megabytes * 10**6, megabytes * 10**6))
        if most_open:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most_open, most_open))

    return subprocess.run(
        [sys.executable, "-m", "sssfit.cli", *arguments],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=timeout,
        preexec_fn=limit if megabytes or most_open else None,
    )


@pytest.fixture
def run(folder, capfd):
    """Run it here; give exit status, stdout and stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        return ended.value.code, *capfd.readouterr()

    return call


# Memory

VERBS = {
    "simulate": ("wax.toml", "--photons", "2000", "-q"),
    "fit": ("wax.profile.npz", "--method", "svd", "-q"),
    "render": ("wax.kernel.json", "--irradiance", "disk", "--size", "16x16", "-q"),
    "compare": ("wax.profile.npz", "--picture", "disk", "--size", "16x16", "-q"),
    "choose": ("wax.toml", "--irradiance", "disk", "--resolution", "16x16", "-q"),
    "chart": ("wax.profile.npz", "-q"),
    "show": ("wax.profile.npz", "-q"),
    "import": ("wax.csv", "--quantity", "density", "-q"),
    "export": ("wax.kernel.json", "--format", "hlsl", "-q"),
    "materials": ("skin1", "-q"),
    "sweep": ("plan.toml", "-q"),
}


@posix
@pytest.mark.parametrize("verb", VERBS)
def test_a_limit_that_is_too_low_is_said_before_the_work(folder, verb):
    for megabytes in (200, 250):
        ended = sssfit(folder, verb, *VERBS[verb], megabytes=megabytes)
        assert ended.returncode == 1
        assert ended.stderr.startswith(f"Error: this process may use {megabytes} MB of memory")
        assert ended.stderr.count("\n") == 1


@posix
def test_the_limits_at_which_it_spun_or_crashed(folder):
    for megabytes in (400, 460, 520, 540):
        ended = sssfit(folder, "simulate", "skin1", "--threads", "2", megabytes=megabytes)
        assert (ended.returncode, ended.stdout) == (1, "")
        assert ended.stderr.endswith("MB; raise the limit, or give fewer --threads.\n")


@posix
@pytest.mark.parametrize("where", [("--threads", "2"), ("--scheduler", "local:2")])
def test_the_limit_at_which_sweeps_hung(folder, where):
    ended = sssfit(folder, "sweep", "plan.toml", *where, megabytes=819)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr.startswith("Error: this process may use 819 MB of memory")
    assert ended.stderr.count("\n") == 1
    assert not [each for each in folder.iterdir() if "zarr" in each.name]


@posix
@pytest.mark.parametrize("threads", ["1", "2"])
def test_a_sweep_that_may_open_few_files_leaves_nothing(folder, threads):
    ended = sssfit(folder, "sweep", "plan.toml", "--threads", threads, most_open=20)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr.startswith("Error: this process may have 20 files open")
    assert ended.stderr.count("\n") == 1
    assert not [each for each in folder.iterdir() if "zarr" in each.name]


@posix
@pytest.mark.parametrize("megabytes", [460, 500, 560])
def test_the_limits_at_which_charts_of_kernels_spun(folder, megabytes):
    ended = sssfit(folder, "chart", "wax.kernel.json", megabytes=megabytes)
    assert ended.returncode == 1
    assert ended.stderr.startswith(f"Error: this process may use {megabytes} MB of memory")
    assert ended.stderr.count("\n") == 1


PICTURE_FIT = ("wax.profile.npz", "--method", "artist", "--target", "picture", "-q")


@posix
@pytest.mark.parametrize("megabytes", [700, 800, 900])
def test_the_limits_at_which_fits_to_pictures_crashed(folder, megabytes):
    ended = sssfit(folder, "fit", *PICTURE_FIT, "--threads", "2", megabytes=megabytes)
    assert ended.returncode == 1
    assert ended.stderr.startswith(f"Error: this process may use {megabytes} MB of memory")
    assert ended.stderr.count("\n") == 1


ALL_LIMITS = [
    *VERBS.items(),
    ("chart", ("wax.kernel.json", "-q")),
    ("show", ("wax.kernel.json", "-q")),
    ("fit", PICTURE_FIT),
]


@posix
@pytest.mark.slow
@pytest.mark.parametrize(("verb", "arguments"), ALL_LIMITS)
def test_any_limit_gives_a_result_or_one_line(folder, verb, arguments):
    for megabytes in range(200, 2001, 50):
        ended = sssfit(folder, verb, *arguments, megabytes=megabytes)
        assert (ended.returncode, ended.stderr.count("\n")) in ((0, 0), (1, 1)), megabytes
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)


@posix
@pytest.mark.parametrize(
    ("side", "megabytes"), [(3500, 900), pytest.param(6000, 1600, marks=pytest.mark.slow)]
)
def test_a_picture_too_large_for_the_limit_is_one_line(folder, side, megabytes):
    large = ("--irradiance", "disk", "--size", f"{side}x{side}", "--threads", "1")
    ended = sssfit(folder, "render", "wax.kernel.json", *large, megabytes=megabytes)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith("Error: out of memory: use a smaller grid or")


def test_whatever_a_library_makes_of_it_is_a_lack_of_memory():
    failed = ImportError("numpy failed")
    failed.__cause__ = MemoryError()
    assert is_out_of_memory(failed)
    assert is_out_of_memory(OSError(12, "Cannot allocate memory"))
    assert is_out_of_memory(RuntimeError("can't start new thread"))
    assert is_out_of_memory(ImportError("a.so: failed to map segment from shared object"))
    assert not is_out_of_memory(ValueError("memory"))


def test_a_stream_is_read_without_making_room_for_the_most_it_may_hold(monkeypatch):
    class Stream:
        def __init__(self):
            self.left, self.asked = 3_000_000, []

        def read(self, count):
            self.asked.append(count)
            given = bytes(min(count, self.left))
            self.left -= len(given)
            return given

    stream = Stream()
    assert len(files.read_at_most(stream, 2_000_000_000)) == 3_000_000
    assert max(stream.asked) <= 2**20
    stream = Stream()
    assert len(files.read_at_most(stream, 1_500_000)) == 1_500_000


# The environment


@pytest.mark.parametrize("value", ["0", "-1", "abc", "1e9", "nan", ""])
def test_threads_of_numba_that_are_no_number(folder, value):
    ended = sssfit(folder, "simulate", "wax.toml", NUMBA_NUM_THREADS=value)
    assert ended.returncode == 1
    assert ended.stderr == (
        f"Error: NUMBA_NUM_THREADS = {value!r}; set it to a whole number from 1 up, or unset it.\n"
    )


def test_warnings_of_others_are_one_line(folder):
    arguments = "render", "wax.kernel.json", "--irradiance", "disk", "--size", "16x16", "-q"
    ended = sssfit(folder, *arguments, NUMBA_OPT="abc")
    assert ended.returncode == 0
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("Warning: Environment variable 'NUMBA_OPT' is defined but")


@pytest.mark.parametrize("columns", ["40", "0", "abc"])
def test_narrow_terminals(folder, columns):
    command = [sys.executable, "-m", "sssfit.cli", "simulate", "wax.toml", "--photons", "2e4"]
    ended = fork_server.run(command, cwd=folder, env=os.environ | {"COLUMNS": columns})
    assert ended.returncode == 0
    assert ended.stdout.splitlines()[0].startswith("wax: 20,000 photons, ")  # whole, when piped


@pytest.mark.parametrize("columns", ["40", "0", "abc"])
def test_help_and_messages_on_narrow_terminals(run, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", columns)
    for arguments in ((), ("simulate",)):
        status, out, err = run(*arguments, "--help")
        assert (status, err) == (0, "")
        assert "Show this message" in " ".join(out.split())
    status, _, err = run("simulate", "no.toml")
    assert (status, err.count("\n")) == (1, 1)


@posix
def test_paths_with_control_characters_are_escaped(run):
    name = "a\nb\x1b[31mc"
    shutil.copy("wax.profile.npz", f"{name}.profile.npz")
    shutil.copy("wax.toml", f"{name}.toml")
    for arguments in (
        ("simulate", f"{name}.toml", "--photons", "2000", "-o", f"{name}/x.npz"),
        ("simulate", f"no{name}"),
        ("fit", f"{name}.profile.npz", "--method", "svd", "-o", f"{name}.profile.npz"),
        ("show", f"no{name}.profile.npz"),
        ("render", f"no{name}", "--irradiance", "disk"),
        ("chart", f"{name}.profile.npz", "-o", f"{name}.gif"),
    ):
        status, _, err = run(*arguments)
        assert status == 1
        assert err.count("\n") == 1
        assert "\x1b" not in err
        assert r"a\nb" in err
    status, out, _ = run("fit", f"{name}.profile.npz", "--method", "svd", "-o", f"{name}.json")
    assert status == 0
    assert "\x1b" not in out
    assert out.splitlines()[-1] == r"Wrote a\nb\x1b[31mc.json"


def test_messages_are_shortened(run):
    long = "x" * 5000
    for arguments in (
        ("simulate", long),
        ("simulate", "wax.toml", "--photons", long),
        ("show", f"{long}.npz"),
        ("choose", "wax.toml", "--irradiance", long),
        ("fit", "wax.profile.npz", "--method", long),
        (long,),
        (f"--{long}",),
    ):
        status, _, err = run(*arguments)
        assert status in (1, 2)
        assert all(len(line) < 1100 for line in err.splitlines())
        assert err.splitlines()[-1].startswith("Error: ")


# Options at the end of their range

EXTREMES = ("0", "-1", "nan", "inf", "1e308", "1e-320", "1e-300")
CALLS = {
    "--radius ": "render wax.kernel.json --irradiance highlights --size 8x8 -o p.exr",
    "--radius": "simulate wax.toml --photons 2000 -o o.npz",
    "--dr": "simulate wax.toml --photons 2000 -o o.npz",
    "--target-error": "simulate wax.toml --photons 2000 -o o.npz",
    "--photons": "simulate wax.toml -o o.npz --radius 2 --dr 1",
    "--checkpoint-every": "simulate wax.toml --photons 2000 -o o.npz",
    "--threads": "simulate wax.toml --photons 2000 -o o.npz",
    "--seed": "simulate wax.toml --photons 2000 -o o.npz",
    "--centre-bound": "fit wax.profile.npz --method guided -o k.json",
    "--b": "fit wax.profile.npz --method guided -o k.json",
    "--k": "fit wax.profile.npz --method guided -o k.json",
    "--near": "fit wax.profile.npz --method artist --far 1 --weight .5 -o k.json",
    "--far": "fit wax.profile.npz --method artist --near 1 --weight .5 -o k.json",
    "--weight": "fit wax.profile.npz --method artist --near 1 --far 2 -o k.json",
    "--width": "fit wax.profile.npz --method falloff --strength .5 --falloff 1 -o k.json",
    "--strength": "fit wax.profile.npz --method falloff --width .02 --falloff 1 -o k.json",
    "--falloff": "fit wax.profile.npz --method falloff --width .02 --strength .5 -o k.json",
    "--mm-per-pixel": "fit wax.profile.npz --method svd -o k.json",
    "--support": "fit wax.profile.npz --method svd -o k.json",
    "--mean-free-path": "materials --from-reflectance .4 --channels a --eta 1.3 -o m.toml",
    "--eta": "materials --from-reflectance .4 --channels a --mean-free-path 1 -o m.toml",
    "--from-reflectance": "materials --channels a --mean-free-path 1 --eta 1.3 -o m.toml",
    "--exposure": "render wax.kernel.json --irradiance disk --size 8x8 -o p.png",
    "--spacing": "render wax.kernel.json --irradiance points --size 8x8 -o p.exr",
    "--period": "render wax.kernel.json --irradiance stripes --size 8x8 -o p.exr",
    "--angle": "render wax.kernel.json --irradiance edge --size 8x8 -o p.exr",
    "--distance": "render wax.kernel.json --irradiance head --size 8x8 -o p.exr",
    "--size": "render wax.kernel.json --irradiance disk -o p.exr",
}


@pytest.mark.parametrize("option", CALLS)
def test_numbers_at_the_end_of_their_range(folder, capfd, option):
    for value in EXTREMES:
        with pytest.raises(SystemExit) as ended:
            main([*CALLS[option].split(), f"{option.strip()}={value}"])
        err = capfd.readouterr().err.splitlines()
        assert ended.value.code in (0, 1, 2)
        if ended.value.code:
            assert len([line for line in err if line.startswith("Error: ")]) == 1, err
            assert "internal error" not in err[-1]
        assert not [line for line in err if "RuntimeWarning" in line], (value, err)
        if ended.value.code:
            assert not [line for line in err if "Warning" in line], (value, err)
        for path in ("o.npz", "k.json", "m.toml", "p.png", "p.exr"):
            Path(path).unlink(missing_ok=True)


def test_the_estimate_of_photons_does_not_overflow():
    assert EndCondition(10**6, 1e-300).expected_photons(1000, 0.1) == 10**6
    assert EndCondition(10**6, 0.01).expected_photons(1000, 0.1) == 100_000


@pytest.mark.parametrize("target", [1e-320, 1e-300, 1e-8])
def test_targets_out_of_reach_are_refused(target):
    from sssfit.simulate._finished import end_condition

    with pytest.raises(SimulationError, match=r"give a share from 1e-07, which takes 1e12 photons"):
        end_condition(None, target)


def test_a_pitch_out_of_range_is_not_warned_of_first(made, recwarn):
    from sssfit.profile import Profile

    with pytest.raises(FitError, match=r"mm_per_pixel = 1e\+308; expected a length in mm above 0"):
        fit_svd(Profile.load(made / "wax.profile.npz"), rank=1, mm_per_pixel=1e308)
    assert not recwarn.list
