"""``sssfit fit`` where something goes wrong: killed, interrupted, two at once, foreign files."""

import json
import os
import signal
import subprocess
import sys

import fork_server
import numpy as np
import pytest
from reference_pixels import make_profile

from sssfit.cli import main
from sssfit.fit import METHODS
from sssfit.kernel import SeparableKernel

posix = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX")
KERNEL = "wax.guided.kernel.json"
FIT = ("fit", "wax.profile.npz", "--method", "guided", "--mm-per-pixel", "0.2")

# The command line, but for an objective that stops the fit in its midst: at the fifth evaluation it
# says so and waits, or sends its own process a signal from inside the optimiser.
PROGRAM = """
import os, sys, time
from sssfit.fit import guided
from sssfit.cli import main

inner, count = guided._misfit, 0

def misfit(*arguments):
    global count
    count += 1
    if count == 5:
        print("midst", flush=True)
        {midst}
    return inner(*arguments)

guided._misfit = misfit
main(sys.argv[1:])
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder with a small profile."""
    monkeypatch.chdir(tmp_path)
    r = np.linspace(0.0, 4.0, 41)
    energy = np.diff(0.5 - 0.5 * np.exp(-(r**2) / 0.5))[:, None] * [1.0, 0.5]
    make_profile(r, energy).save("wax.profile.npz")
    return tmp_path


@pytest.fixture
def run(folder, capfd):
    """Run the command line here; give exit status, stdout and stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as ending:
            main(arguments)
        return ending.value.code, *capfd.readouterr()

    return call


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def begin(folder, midst="time.sleep(60)"):
    """Start a fit of its own process and wait until it is in its midst."""
    process = fork_server.start(
        [sys.executable, "-c", PROGRAM.format(midst=midst), *FIT], cwd=folder
    )
    assert process.stdout.readline() == "midst\n"
    return process


# Killed, interrupted, two at once


@posix
def test_a_killed_fit_leaves_no_kernel_and_blocks_nobody(folder, run):
    process = begin(folder)
    process.kill()
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    assert names(folder) == [f".{KERNEL}.lock", "wax.profile.npz"]
    assert run(*FIT)[0] == 0
    assert names(folder) == [KERNEL, "wax.profile.npz"]
    assert SeparableKernel.load(KERNEL).method == "guided"


@posix
def test_a_killed_fit_leaves_an_older_kernel_alone(folder, run):
    run(*FIT)
    before = (folder / KERNEL).read_bytes()
    process = begin(folder)
    process.kill()
    process.communicate()
    assert (folder / KERNEL).read_bytes() == before


@posix
@pytest.mark.parametrize("inside", [True, False], ids=["inside nlopt", "asleep"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_fit_says_so_in_one_line(folder, number, inside):
    if inside:
        process = begin(folder, f"os.kill(os.getpid(), {int(number)})")
    else:
        process = begin(folder)
        process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (130, "")
    assert err == "\nInterrupted.\n"  # click ends the line that ^C stands in
    assert names(folder) == ["wax.profile.npz"]


@posix
def test_the_second_of_two_fits_on_one_output_is_refused(folder, run):
    process = begin(folder)
    status, out, err = run(*FIT)
    assert (status, out) == (1, "")
    assert err.startswith(f"Error: {KERNEL} is being written by another run; ")
    assert err.count("\n") == 1
    assert run(*FIT, "-o", "other.json")[0] == 0
    process.kill()
    process.communicate()


# Outputs


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_said(folder, run):
    folder.chmod(0o555)
    try:
        status, _, err = run(*FIT)
    finally:
        folder.chmod(0o755)
    assert status == 1
    assert f"{KERNEL} cannot be written: permission denied." in err


def test_a_missing_folder_and_a_folder_are_no_outputs(folder, run):
    for output, fragment in (("gone/a.json", "there is no folder gone"), (".", "is a folder")):
        status, _, err = run(*FIT, "-o", output)
        assert status == 1
        assert fragment in err
        assert err.count("\n") == 1


def test_a_foreign_file_is_replaced_by_force_only(folder, run):
    (folder / "notes.txt").write_text("mine")
    status, _, err = run(*FIT, "-o", "notes.txt")
    assert status == 1
    assert "notes.txt exists and was not written by sssfit as such a file; choose another" in err
    assert (folder / "notes.txt").read_text() == "mine"
    profile = (folder / "wax.profile.npz").read_bytes()
    assert run(*FIT, "-o", "wax.profile.npz")[0] == 1
    assert (folder / "wax.profile.npz").read_bytes() == profile
    assert run(*FIT, "-o", "notes.txt", "--force")[0] == 0
    assert SeparableKernel.load("notes.txt").method == "guided"


def test_a_pipe_gets_the_bytes_of_the_file(folder):
    command = [sys.executable, "-m", "sssfit.cli", *FIT]
    fork_server.run([*command, "-q"]).check_returncode()
    piped = fork_server.run([*command, "-o", "-"], text=False)
    assert piped.stdout == (folder / KERNEL).read_bytes()
    assert b"Wrote the kernel to stdout" in piped.stderr
    both = fork_server.run([*command, "-o", "-", "--json"], text=False)
    assert both.stdout == piped.stdout
    assert json.loads(both.stderr)["output"] == ["-"]


@posix
def test_a_reader_that_has_gone_is_no_error(folder):
    many = "--method preintegrated --mm-per-pixel .014 --support 50"  # more than a pipe holds
    line = f'"{sys.executable}" -m sssfit.cli fit wax.profile.npz {many} -o - -q | head -c 1'
    ended = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=True)
    assert (ended.stdout, ended.stderr) == ("{", "")


def test_a_closed_stdout_is_said_before_the_fit(folder):
    line = f'"{sys.executable}" -m sssfit.cli {" ".join(FIT)} -o - >&-'
    ended = subprocess.run(["sh", "-c", line], capture_output=True, text=True)
    assert ended.returncode == 1
    assert ended.stderr.startswith("Error: stdout is closed")


@pytest.mark.parametrize("method", METHODS)
def test_json_is_one_object_without_nan(run, method):
    status, out, _ = run("fit", "wax.profile.npz", "--method", method, "--json", "-q")
    assert status == 0
    figures = json.loads(out, parse_constant=pytest.fail)
    assert figures["method"] == method
    assert len(figures["stop_reason"]) == len(figures["evaluations"]) == 2
    assert all(figures["stop_reason"])
    assert all(isinstance(each, int) for each in figures["evaluations"])
    assert figures["seconds"] > 0.0
    assert all(isinstance(each, float) for each in figures["relative_frobenius_error"])
    assert set(figures["parameters"]) <= {"c0", "c1"}


def test_a_narrow_terminal_loses_nothing(run, monkeypatch):
    wide = run(*FIT)[1]
    monkeypatch.setenv("COLUMNS", "40")
    narrow = run(*FIT)[1]
    assert [line.split(", ")[:-1] for line in narrow.splitlines()[:1]] == [
        line.split(", ")[:-1] for line in wide.splitlines()[:1]
    ]
    assert narrow.splitlines()[1:] == wide.splitlines()[1:]


# Inputs


@pytest.mark.parametrize(
    "content", [b"", b"\x89PNG\r\n\x1a\n" + bytes(99), b"PK\x03\x04", b"{}", "half"], ids=str
)
def test_what_is_no_profile_is_one_line(folder, run, content):
    said = "is damaged; write it again" if content == "half" else "is not a profile; name a"
    if content == "half":
        whole = (folder / "wax.profile.npz").read_bytes()
        content = whole[: len(whole) // 2]
    (folder / "other.npz").write_bytes(content)
    status, out, err = run("fit", "other.npz", "--method", "svd")
    assert (status, out) == (1, "")
    assert err.startswith(f"Error: other.npz {said}")
    assert err.count("\n") == 1
    assert not list(folder.glob("*.kernel.json"))


def test_a_kernel_is_no_profile(run):
    run(*FIT)
    status, _, err = run("fit", KERNEL, "--method", "svd")
    assert status == 1
    assert err.startswith(f"Error: {KERNEL} is not a profile; ")
    assert err.count("\n") == 1


def test_an_empty_folder_is_one_line(run, folder):
    (folder / "wax.profile.npz").unlink()
    status, _, err = run("fit", "--method", "svd")
    assert status == 1
    assert "make one with `sssfit simulate skin1`" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["gone.npz", "."])
def test_a_missing_profile_and_a_folder_are_one_line(run, name):
    status, _, err = run("fit", name, "--method", "svd")
    assert status == 1
    assert err.startswith(f"Error: {name} ")
    assert err.count("\n") == 1
