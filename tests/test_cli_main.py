"""What all verbs share: options, exit codes, one line of error, interruption, pipes."""

import importlib.metadata
import os
import re
import select
import signal
import subprocess
import sys
import textwrap
import tomllib
import warnings
from pathlib import Path

import click
import fork_server
import processes
import pytest
from click.testing import CliRunner
from turns import in_turn

import sssfit
from sssfit.cli import cli, main
from sssfit.errors import MaterialError, SssfitWarning

COMMON = {"-q", "--quiet", "-v", "--verbose", "--json", "--threads", "--seed"}
PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"
DECLARED = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["project"]["dependencies"]
posix_only = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals, pipes, terminals")


@pytest.fixture
def run(capfd):
    """Call ``main`` in this process: (exit status, stdout, stderr)."""
    before = signal.getsignal(signal.SIGTERM)

    def call(*args: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            main(args)
        out, err = capfd.readouterr()
        return end.value.code or 0, out, err

    yield call
    signal.signal(signal.SIGTERM, before)


@pytest.fixture
def verb():
    """Add a verb ``trial`` that does what a test wants; it goes with the test."""

    def add(body) -> None:
        cli.add_command(click.Command("trial", callback=body))

    yield add
    cli.commands.pop("trial", None)


def raising(error: BaseException):
    """A verb's body that fails."""

    def body() -> None:
        raise error

    return body


def trial(body: str) -> list[str]:
    """The program with a verb ``trial`` of the given source, for another process."""
    program = f"""
import time
import click
from sssfit.cli import cli, main

@cli.command()
def trial():
{textwrap.indent(textwrap.dedent(body), "    ")}

main(["trial"])
"""
    return [sys.executable, "-c", program]


# Options


@pytest.mark.parametrize("name", list(cli.commands))
def test_every_verb_has_the_common_options(name):
    command = cli.commands[name]
    options = {option for each in command.params for option in each.opts}
    assert options >= COMMON
    seed = next(each for each in command.params if each.name == "seed")
    assert seed.default == 1


@pytest.mark.parametrize("name", list(cli.commands))
def test_every_verb_explains_itself(name, run):
    for flag in ("--help", "-h"):
        status, out, err = run(name, flag)
        assert status == 0
        assert out.startswith(f"Usage: sssfit {name}")
        assert "\\b" not in out  # its examples keep their lines
        assert err == ""


def test_the_list_of_verbs_cuts_no_sentence():
    context = click.Context(cli, info_name="sssfit", terminal_width=80)
    lines = cli.get_help(context).partition("Commands:\n")[2].splitlines()
    assert [each.split()[0] for each in lines] == sorted(cli.commands)
    assert [each for each in lines if each.endswith("...") or not each.endswith(".")] == []


def test_version(run):
    assert run("--version") == (0, f"sssfit {sssfit.__version__}\n", "")


@pytest.mark.parametrize("flags", [("--version", "-v"), ("-v", "--version")])
def test_version_with_v_lists_what_is_installed_with_us(flags, run):
    status, out, _ = run(*flags)
    assert status == 0
    listed = dict(line.split(" ") for line in out.splitlines())
    needed = {re.match(r"[\w-]+", each)[0] for each in DECLARED}
    assert set(listed) == {"sssfit", "python", "llvmlite"} | needed
    for library in needed:
        assert listed[library] == importlib.metadata.version(library)


# Exit status


@pytest.mark.parametrize(
    "args",
    [
        (),
        ("no-such-verb",),
        ("--no-such-option",),
        *(
            (name, *wrong)
            for name in cli.commands
            for wrong in (("--no-such-option",), ("--threads", "0"), ("--seed", "-1"))
        ),
    ],
)
def test_wrong_usage_is_2(args, run):
    status, out, err = run(*args)
    assert status == 2
    assert "Usage: sssfit" in out + err
    assert "Traceback" not in out + err


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (MaterialError("skin9: no such material"), "Error: skin9: no such material"),
        (click.ClickException("no"), "Error: no"),
        (
            FileNotFoundError(2, "No such file or directory", "a.npz"),
            "Error: a.npz: no such file or directory.",
        ),
        (MemoryError(), "Error: out of memory"),
        (RuntimeError("two\nlines"), "Error: internal error, RuntimeError: two lines."),
    ],
)
def test_failure_is_1_with_one_line(error, line, run, verb):
    verb(raising(error))
    status, out, err = run("trial")
    assert status == 1
    assert out == ""
    assert err.startswith(line)
    assert err.count("\n") == 1
    assert "Traceback" not in err


def test_internal_error_shows_its_traceback_when_asked(verb, monkeypatch):
    monkeypatch.setenv("SSSFIT_TRACEBACK", "1")
    verb(raising(RuntimeError("inside")))
    before = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.raises(RuntimeError, match="inside"):
            main(["trial"])
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), click.Abort()])
def test_interrupted_is_130(error, run, verb):
    verb(raising(error))
    status, out, err = run("trial")
    assert status == 130
    assert out == ""
    assert err.strip().count("\n") == 0


def test_status_of_a_verb_is_the_status_of_the_program(run, verb):
    verb(lambda: click.get_current_context().exit(130))
    assert run("trial")[0] == 130


@posix_only
def test_sigterm_is_130():
    with fork_server.start(trial("click.echo('ready')\ntime.sleep(60)")) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "Traceback" not in err


# Words


def test_warning_is_one_line_on_stderr(run, verb):
    verb(lambda: warnings.warn("mind the gap", SssfitWarning, stacklevel=1))
    assert run("trial") == (0, "", "Warning: mind the gap\n")


@posix_only
def test_reader_that_goes_away_is_no_error():
    with fork_server.start(trial("while True:\n    click.echo('x' * 4096)")) as process:
        process.stdout.readline()
        process.stdout.close()
        err = process.stderr.read()
        process.wait(timeout=20)
    assert err == ""
    assert process.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_a_full_disk_under_stdout_is_told_as_such():
    with fork_server.start(trial("open('/dev/full', 'wb', 0).write(b'x')")) as process:
        _, err = process.communicate(timeout=20)
    assert (process.returncode, err) == (
        1,
        "Error: stdout cannot be written: no space left on device.\n",
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full")
def test_notes_that_cannot_be_written_end_no_run():
    body = """
        import logging
        from sssfit.cli._options import _notes_on_stderr
        with _notes_on_stderr(quiet=False):
            logging.getLogger("sssfit").info("using the newest")
        click.echo("done")
    """
    with Path("/dev/full").open("wb") as full:
        ended = fork_server.run(trial(body), stderr=full, timeout=20)
    assert (ended.returncode, ended.stdout) == (0, "done\n")


@posix_only
def test_no_color_is_honoured_on_a_terminal(tmp_path):
    import pty

    ours, theirs = pty.openpty()
    with fork_server.start(
        [sys.executable, "-m", "sssfit.cli", "simulate", "skin1", "--photons", "1e5"],
        cwd=tmp_path,
        env=os.environ | {"NO_COLOR": "1", "TERM": "xterm-256color"},
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        seen = b""
        while select.select([ours], [], [], 120)[0]:
            try:
                part = os.read(ours, 65536)
            except OSError:  # Linux: the other end is closed
                break
            if not part:
                break
            seen += part
    os.close(ours)
    assert process.returncode == 0, seen
    colours = re.findall(rb"\x1b\[[\d;]*m", seen)
    assert not [
        each for each in colours if re.search(rb"[\[;](?:3[0-8]|4[0-8]|9\d|10\d)[;m]", each)
    ]


MATPLOTLIBRC = "no_such_key: 5\nbackend: nonsense\nfont.size: large?\n"


CHANGED = [
    {"HOME": "{there}/file", "MPLCONFIGDIR": "{there}/file/x"},  # nowhere to keep its fonts
    {"MPLBACKEND": "nonsense"},
    {"MPLBACKEND": ""},
    {"MPLCONFIGDIR": "{there}/config"},
]
# What draws, and what judges colours: both import matplotlib.
MODULES = ["sssfit.chart.page", "colour"]


@pytest.mark.parametrize(("changed", "module"), in_turn(CHANGED, MODULES))
def test_matplotlib_says_nothing_and_draws_without_a_display(tmp_path, changed, module):
    (tmp_path / "file").write_text("in the way of a folder")
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / "matplotlibrc").write_text(MATPLOTLIBRC)
    environment = {key: value for key, value in os.environ.items() if not key.startswith("MPL")}
    environment |= {key: value.format(there=tmp_path) for key, value in changed.items()}
    body = f"""
    import importlib
    importlib.import_module("{module}")
    from matplotlib import font_manager
    import matplotlib
    print(matplotlib.get_backend().lower())
    """
    with processes.start(trial(body), env=environment) as program:
        out, err = program.communicate()
    assert (program.returncode, out.strip(), err) == (0, "agg", "")


@pytest.mark.parametrize(("verb", "status"), [("stability", 2), ("show", 1), ("export", 2)])
def test_an_empty_name_is_not_one_that_was_left_out(monkeypatch, tmp_path, verb, status):
    """It stood for the newest file here, and for all eleven materials."""
    monkeypatch.chdir(tmp_path)
    Path("a.profile.npz").write_bytes(b"")
    found = CliRunner().invoke(cli, [verb, ""])
    assert found.exit_code == status
    assert "Using" not in found.output
