"""What the library says names no option of the command line, which writes its own in."""

import ast
import functools
import re
import threading
from pathlib import Path

import click
import pytest

from sssfit.cli import main
from sssfit.cli._main import cli
from sssfit.cli._options import _notes_on_stderr, in_options
from sssfit.messages import Columns, counted, filled, note, number, report

LIBRARY = sorted((Path(__file__).parents[1] / "sssfit").rglob("*.py"))
APPROVED = Path(__file__).parent / "approved"
# A long option, a short one, or a command: none of these stands in text for Python.
OPTION = re.compile(r"(?<![\w-])--?[a-zA-Z][\w-]*(?![\w\]])")
COMMAND = re.compile(r"`sssfit |\bsssfit (simulate|fit|render|chart|show|export|import|compare) ")
MARKED = re.compile(r"`[^`\n]+`")
# Commands of others: Radiance's own program, the shell's limit.
FOREIGN = ("ra_xyze -r", "ulimit -v", "ulimit -n")
# Backquoted in messages without being an argument: a field of the profile. The name of a view is
# one, which tests/test_methods.py asks of each.
FIELDS = {"`unfinished`", "`0 = True`"}


def texts(path: Path) -> list[str]:
    """Every text of a file that is not a docstring, with the values in f-strings as 0."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and isinstance(node.body[0], ast.Expr)
    }
    found, parts = [], set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts |= {id(each) for each in node.values}
            found.append(
                "".join(
                    getattr(each, "value", None) if isinstance(each, ast.Constant) else "0"
                    for each in node.values
                )
            )
        elif isinstance(node, ast.Constant) and id(node) not in docs | parts:
            found += [node.value] if isinstance(node.value, str) else []
    return found


# The registry of methods has the help of their options, and a page shows command lines to copy:
# neither are messages.
@pytest.mark.parametrize(
    "path",
    [each for each in LIBRARY if each.name not in ("methods.py", "commands.py")],
    ids=lambda path: path.name,
)
def test_no_text_of_the_library_names_an_option_or_a_command(path):
    for text in texts(path):
        ours = functools.reduce(lambda rest, each: rest.replace(each, ""), FOREIGN, text)
        assert not OPTION.search(ours), text
        assert not COMMAND.search(text), text


def test_the_scan_finds_options_and_spares_words():
    for text in ("give --photons 3", "name one with -o.", "use -o FILE", "(--dr 3)"):
        assert OPTION.search(text), text
    for text in ("x-axis", "half-width -1 to 1", "-0.5", "pre-integrated", "a - b", "[a-z]"):
        assert not OPTION.search(text), text
    assert COMMAND.search("`sssfit fit` writes it")


def test_the_command_line_knows_every_argument_that_a_message_marks():
    marked = {each for path in LIBRARY for text in texts(path) for each in MARKED.findall(text)}
    assert len(marked) > 10
    for each in marked - FIELDS:
        assert "`" not in in_options(each) or "`sssfit " in in_options(each), each


@pytest.mark.parametrize(
    ("said", "printed"),
    [
        ("use a smaller `dr_mm`.", "use a smaller --dr."),
        ("use `dr_mm = 0.5` or more", "use --dr 0.5 or more"),
        ('give `quantity = "density"` (R_d)', "give --quantity density (R_d)"),
        ("replace it with `force = True`.", "replace it with --force."),
        ("start a new run with `resume = False`.", "start a new run without --resume."),
        ("with `photons = 20000` alone", "with --photons 20000 alone"),
        ("fit it at `mm_per_pixel = 0.3`.", "fit it at --mm-per-pixel 0.3."),
        ("`material_names()` lists them", "`sssfit materials` lists them"),
        ("kept apart as `unfinished` and", "kept apart as `unfinished` and"),
        ("a file named `a b` is none", "a file named `a b` is none"),
        ("rank = 3; expected 1 to 2", "rank = 3; expected 1 to 2"),
    ],
)
def test_arguments_become_options_where_the_command_line_prints_them(said, printed):
    assert in_options(said) == printed


@pytest.mark.parametrize(
    ("verb", "said", "printed"),
    [
        ("simulate", "give `tolerance = 0.005` or more", "give --tolerance 0.005 or more"),
        ("report", "give `tolerance = 0.005` or more", "give `sssfit simulate --tolerance 0.005`"),
        ("compare", "`method = montecarlo`", "`sssfit simulate --method montecarlo`"),  # fits only
        ("fit", "`method = cascade`", "--method cascade"),
        ("simulate", "give fewer `angles`", "give fewer --angles"),  # which chart has as a switch
        ("chart", "compute it with `angles = 30`", "compute it with `sssfit simulate --angles 30`"),
        ("chart", "use `dr_mm = 0.2`", "use `sssfit simulate --dr 0.2`"),
        ("render", "start with `resume = False`", "start without `sssfit simulate --resume`"),
        ("render", "replace it with `force = True`", "replace it with --force"),
    ],
)
def test_an_option_that_the_verb_lacks_is_named_with_its_own_verb(verb, said, printed):
    with click.Context(cli.commands[verb], info_name=verb):
        assert in_options(said).startswith(printed)


def test_notes_from_threads_name_the_options_of_the_verb_that_runs(capsys):
    with click.Context(cli.commands["compare"], info_name="compare"), _notes_on_stderr(quiet=False):
        thread = threading.Thread(target=note, args=("stack R: try `method = montecarlo`.",))
        thread.start()
        thread.join()
    assert capsys.readouterr().err == "stack R: try `sssfit simulate --method montecarlo`.\n"


def test_errors_name_options_of_the_verb_that_ran(tmp_path, capsys):
    path = tmp_path / "wide.toml"
    path.write_text(
        'name = "wide"\nsource = "a test"\nchannels = ["R", "G"]\neta = 1.3\ng = 0\n'
        "sigma_a_per_mm = [0.001, 1.0]\nsigma_s_per_mm = [0.0009, 8.0]\n"
    )
    for verb, words in ("simulate", "use --dr"), ("stability", "use `sssfit simulate --dr"):
        with pytest.raises(SystemExit, match=r"^1$"):
            main([verb, str(path)])
        assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("share", "form", "written"),
    [
        (0.99375, ".2g%", "99 %"),
        (0.9975, ".2g%", "100 %"),  # and not 1e+02 %
        (2.7, "+.2g%", "+270 %"),
        (-11.14, "+.2g%", "-1100 %"),
        (0.000123, ".2g%", "0.012 %"),
        (1e-10, "+.2g%", "0 %"),
        (-2.7e-6, "+.3f%", "+0.000 %"),
        (None, ".2g%|unknown", "unknown"),
        (float("nan"), ".4f", "-"),
        (float("inf"), ".3g%", "inf %"),
    ],
)
def test_shares_are_written_in_per_cent(share, form, written):
    assert number(share, form) == written


FIGURES = {
    "name": "skin1",
    "width": 1024,
    "share": 0.1234,
    "nothing": None,
    "channels": ["R", "G"],
    "error": [0.5, float("nan")],
    "chosen": {"label": "svd 2"},
}


def test_templates_are_filled_by_the_formats_of_figures():
    text = "{name}: {width:,} wide, {share:.2g%}, {nothing:.3g|unknown}, {nothing:.3g}, {{}}"
    assert filled(text, FIGURES) == "skin1: 1,024 wide, 12 %, unknown, -, {}"
    assert filled("{chosen[label]} {error[0]:.2f}", FIGURES) == "svd 2 0.50"
    with pytest.raises(KeyError):
        filled("{unknown}", FIGURES)


@pytest.mark.parametrize(
    ("value", "noun", "form", "said"),
    [
        (1, "pass", "", "1 pass"),
        (0, "pass", "", "0 passes"),
        (2, "fetch", "", "2 fetches"),
        (1.0, "fetch", ".4g", "1 fetch"),
        (22.84375, "fetch", ".4g", "22.84 fetches"),
        (1, "annulus", "", "1 annulus"),
        (12, "annulus", "", "12 annuli"),
        (2, "entry", "", "2 entries"),
        (1000, "photon", ",", "1,000 photons"),
        (1, "mean free path", "", "1 mean free path"),
        (3, "mean free path", "", "3 mean free paths"),
        (None, "photon", "", "- photons"),
    ],
)
def test_a_count_has_its_noun(value, noun, form, said):
    assert counted(value, noun, form) == said
    assert filled(f"{{value:{form}#{noun}}}.", {"value": value}) == f"{said}."


_NOUNS = (
    *("annuli", "bytes", "cells", "channels", "columns", "entries", "fetches", "files", "kernels"),
    *("layers", "levels", "materials", "numbers", "passes", "photons", "pictures", "pixels"),
    *("points", "rows", "runs", "stages", "steps", "taps", "terms", "threads", "values", "weights"),
)


@pytest.mark.parametrize("path", sorted(APPROVED.glob("*.txt")), ids=lambda path: path.stem)
def test_nothing_says_1_passes(path):
    """In what verbs and records print; "2 x 1 pixels" is two numbers, "edge: 1 points" a list."""
    one = re.compile(rf"(?<! x)(?<!:) 1 (?:{'|'.join(_NOUNS)})\b")
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if one.search(line)] == []


def test_a_report_leaves_out_what_is_not_known():
    error = Columns("channel", "channels", (("error", "error", ".2g%"), ("no", "nothing", "")))
    parts = ["{name}", ("nothing", "nothing is {nothing}"), ("width", "{width}"), error]
    assert report(parts, FIGURES).splitlines() == [
        "skin1",
        "1024",
        "channel  error",
        "R         50 %",
        "G            -",
    ]
    assert report([("nothing", error)], FIGURES) == ""


def test_a_note_is_printed_by_the_command_line_alone_and_not_under_q(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sssfit.simulate.inversion.is_solver_compiled", lambda: False)
    make = ["materials", "--from-reflectance", "0.4", "--channels", "A", "--mean-free-path", "1"]
    for quiet, is_said in ((["-q"], False), ([], True)):
        with pytest.raises(SystemExit):
            main([*make, "-o", "x.toml", "--force", *quiet])
        assert ("Compiling the solver, some 3 s" in capsys.readouterr().err) is is_said
        note("to nobody")
        assert capsys.readouterr() == ("", "")
