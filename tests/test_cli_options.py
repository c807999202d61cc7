"""Every option of every verb does what the library does with its value; its default is its default.

The options are those of click's own objects: one without a row in ``option_rows`` fails here.
"""

import re

import cli_world as world
import click
import numpy as np
import pytest
from option_rows import COMMANDS, FITS, ROWS, SEEDS, STREAMS, THREADS, VERBOSE, status

from sssfit.cli import cli
from sssfit.cli._options import common_options
from sssfit.compare import pictures
from sssfit.fit import artist


@pytest.fixture(scope="module", autouse=True)
def recorded():
    with world.recording():
        yield


def options_of(command):
    """The options of a command by their long names."""
    return {
        max(each.opts, key=len): each for each in command.params if isinstance(each, click.Option)
    }


@click.command()
@common_options
def nothing(common):
    """What all verbs have in common, and nothing else."""


SHARED = set(options_of(nothing))
CASES = [(verb, option) for verb, rows in ROWS.items() for option in rows]
DEFAULTS = [case for case in CASES if ROWS[case[0]][case[1]].default]
RANDOM = [("seed", name, row) for name, row in SEEDS.items()]
THREADED = [("threads", name, row) for name, row in THREADS.items()]


def same(found, wanted):
    """Whether two results are the same bits; NaN is NaN."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        return found.keys() == wanted.keys() and all(same(found[k], wanted[k]) for k in wanted)
    if isinstance(found, (list, tuple)) and isinstance(wanted, (list, tuple)):
        return len(found) == len(wanted) and all(map(same, found, wanted))
    if isinstance(found, np.ndarray) or isinstance(wanted, np.ndarray):
        found, wanted = np.asarray(found), np.asarray(wanted)
        return found.shape == wanted.shape and np.array_equal(
            found, wanted, equal_nan=found.dtype.kind == wanted.dtype.kind == "f"
        )
    return found == wanted


def with_option(row):
    """The command with the option at its other value."""
    whole = row.given.split()[0] == row.command.split()[0]
    return world.run(row.given if whole else f"{row.command} {row.given}")


def check(row):
    ran = with_option(row)
    wanted = row.library()
    assert ran.status == (wanted if row.seen is status else 0), ran.stdout + ran.stderr
    found = row.seen(ran)
    assert same(found, wanted), f"the command line: {found}\nthe library: {wanted}"
    without = world.run(row.command)
    assert without.status == 1 or not same(row.seen(without), found), "the option changes nothing"


@pytest.mark.parametrize("verb", list(cli.commands))
def test_every_option_has_a_row(verb):
    assert set(options_of(cli.commands[verb])) == SHARED | set(ROWS[verb])


@pytest.mark.parametrize(("verb", "option"), CASES)
def test_an_option_does_what_the_library_does_with_its_value(verb, option):
    check(ROWS[verb][option])


@pytest.mark.parametrize(("option", "name", "row"), RANDOM + THREADED)
def test_seed_and_threads_reach_the_library(option, name, row):
    check(row)


@pytest.mark.parametrize("name", list(FITS))
def test_an_option_of_several_methods_reaches_each_of_them(name, monkeypatch):
    monkeypatch.setattr(pictures, "PIXELS", 13)  # fits to pictures of 67 x 67 took 7 s
    monkeypatch.setattr(artist, "_MAX_EVALUATIONS", 60)  # of 500: near enough to compare bits
    check(FITS[name])


def documented(option):
    """What the help says of a default, "" where it says nothing."""
    in_words = re.search(r"\[default: (.*)\]$", option.help or "")
    shown = str(option.default) if option.show_default else ""
    return in_words[1] if in_words else shown


@pytest.mark.parametrize(("verb", "option"), CASES)
def test_defaults_in_the_help_are_those_of_the_table(verb, option):
    row = ROWS[verb][option]
    text = documented(options_of(cli.commands[verb])[option])
    if row.words:
        assert text == row.words
    else:
        assert text.split(";")[0] == row.default


@pytest.mark.parametrize(("verb", "option"), DEFAULTS)
def test_a_default_given_is_a_default_left_out(verb, option):
    row = ROWS[verb][option]
    default = row.typed_default()
    left_out, given = world.run(row.command), world.run(f"{row.command} {option} {default}")
    assert given.status == 0, given.stdout + given.stderr
    assert same(row.seen(given), row.seen(left_out))


@pytest.mark.parametrize("verb", list(COMMANDS))
def test_quiet_says_nothing_and_json_one_object(verb):
    quiet, as_json = (world.run(f"{COMMANDS[verb]} {each}") for each in ("-q", "--json"))
    assert (quiet.status, quiet.stdout, quiet.stderr) == (0, "", "")
    assert as_json.status == 0
    assert as_json.stdout.count("\n") == 1
    assert as_json.figures["command"] == verb
    assert set(as_json.figures["output"]) == set(as_json.written)


TIMES = re.compile(r"\d[\d.,]*(e[-+]?\d+)? (s\b|a second)|\(\d[\d,]* a second\)")


def said(*printed):
    """What was printed, but for seconds."""
    return TIMES.sub("", "".join(printed))


@pytest.mark.parametrize("verb", list(COMMANDS))
def test_verbose_says_more_where_there_is_more_to_say(verb):
    runs = world.run(COMMANDS[verb]), world.run(f"{COMMANDS[verb]} -v")
    plain, verbose = (said(each.stdout, each.stderr) for each in runs)
    assert (len(verbose) > len(plain)) == (verb in VERBOSE)
    assert verb in VERBOSE or verbose == plain


@pytest.mark.parametrize("verb", list(COMMANDS))
@pytest.mark.parametrize("option", ["--seed 5", "--threads 1"])
def test_what_is_not_random_depends_neither_on_seed_nor_on_threads(verb, option):
    if verb in (SEEDS if "seed" in option else {}):
        pytest.skip("it is random; see the test above")
    plain, other = world.run(COMMANDS[verb]), world.run(f"{COMMANDS[verb]} {option}")
    assert other.status == 0
    assert plain.written.keys() == other.written.keys()
    for name, data in plain.written.items():
        if not name.endswith((".png", ".exr")):  # they carry the time of their making
            assert other.written[name] == data


@pytest.mark.parametrize("command", STREAMS)
def test_a_dash_sends_the_file_to_stdout_and_the_words_to_stderr(command):
    start, name = command.rsplit(" ", 1)
    to_file, to_stdout = world.run(command), world.run(f"{start} -")
    assert (to_file.status, to_stdout.status) == (0, 0), to_stdout.stderr
    beside = [name.replace(".taps.json", ".profile.npz")] if command.startswith("choose") else []
    assert (sorted(to_file.written), list(to_stdout.written)) == (sorted([name, *beside]), [])
    content = to_file.written[name]
    assert to_stdout.raw[:4] == content[:4]
    if not name.endswith((".png", ".exr")):  # they carry the time of their making
        assert to_stdout.raw == content
    words, same_words = (
        said(*each).splitlines() for each in ((to_stdout.stderr,), (to_file.stderr, to_file.stdout))
    )
    assert "stdout" in words[-1] or words[-1] == "Wrote -"
    assert words[:-1] == same_words[:-1]
