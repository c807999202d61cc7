"""The documents say what the program does, and no file names a private place."""

import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sssfit.cli import cli
from sssfit.material import parse_material

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def code_blocks(language: str = "") -> list[str]:
    """The README's fenced blocks of one language, in order."""
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    return [body for found, body in fences if found == language]


def test_readme_has_two_commands_of_one_line():
    first, tests = (block.strip() for block in code_blocks()[:2])
    assert first.startswith("python3 -m venv .venv && ")
    assert first.endswith("sssfit chart skin1.profile.npz")
    assert "pytest" in tests
    assert "\n" not in first + tests


def test_ci_runs_the_test_command_of_the_readme():
    command = code_blocks()[1].strip()
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert lines[-1] == command


@pytest.mark.parametrize("verb", list(cli.commands))
def test_readme_names_every_verb(verb):
    assert f"sssfit {verb}" in README


def test_materials_in_the_readme_load():
    (example,) = code_blocks("toml")
    assert len(parse_material(example, "README.md").layers) == 2


def commands_of(start: str) -> list[list[str]]:
    """The README's commands that begin so, as words."""
    return [block.split() for block in code_blocks() if block.startswith(start)]


def printed_by(arguments: list[str], folder: Path) -> str:
    """What a command of ours that ends well prints on stdout."""
    return subprocess.run(
        [sys.executable, "-m", "sssfit.cli", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        check=True,
        timeout=300,
    ).stdout


def table_of(text: str) -> list[list[str]]:
    """Channel, diffuse reflectance and standard error of each line about a channel."""
    return [line.split()[:3] for line in text.splitlines() if line.startswith(("R ", "G ", "B "))]


def test_readme_python_does_what_its_command_line_does(tmp_path, monkeypatch, capsys):
    (example,) = code_blocks("python")
    command, _ = commands_of("sssfit simulate")
    python_prints, command_prints, *_ = code_blocks("text")
    from_python, from_command_line = tmp_path / "python", tmp_path / "command-line"
    from_python.mkdir()
    from_command_line.mkdir()

    monkeypatch.chdir(from_python)
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out == python_prints
    printed = printed_by(command[1:], from_command_line)
    assert table_of(printed) == table_of(command_prints)
    assert len(table_of(printed)) == 3

    with (
        np.load(from_python / "skin1.profile.npz") as ours,
        np.load(from_command_line / "skin1.profile.npz") as theirs,
    ):
        assert set(ours) == set(theirs)
        for name in ours:
            np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)
            assert f"| `{name}` |" in README, f"{name} is not in the README's table"


@pytest.mark.parametrize(
    ("verb", "place"), [("sssfit simulate skin1 --method exact", 2), ("sssfit materials --from", 3)]
)
def test_readme_commands_print_what_it_says(tmp_path, verb, place):
    (command,) = commands_of(verb)
    printed = printed_by(command[1:], tmp_path)
    assert figures_of(printed) == figures_of(code_blocks("text")[place])


def test_readme_session_ends_in_shader_source(tmp_path):
    (fit,) = commands_of("sssfit fit")
    commands = (["simulate", "skin1", "--method", "exact"], fit[1:], ["export", "--format", "hlsl"])
    printed = [printed_by(each, tmp_path) for each in commands]
    assert figures_of(printed[1]) == figures_of(code_blocks("text")[4])
    assert "SSS_WEIGHTS[3][427]" in (tmp_path / "skin1.exact.svd3.hlsl").read_text()
    (render,) = commands_of("sssfit render")
    assert figures_of(printed_by(render[1:], tmp_path)) == figures_of(code_blocks("text")[5])


def figures_of(text: str) -> str:
    """A verb's output without what differs from run to run: seconds, and what is but rounding."""
    return re.sub(r"\d+(\.\d+)? s\b;?|[+-]?\d\.\de-\d\d|\de-\d\d|worst channel, \w+ \w", "", text)


def test_readme_links_lead_somewhere():
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def words_of(page: str) -> list[str]:
    """A page without the brackets and line breaks that click sets anew in each version."""
    return re.sub(r"[\[\]\s]+", " ", page).split()


def test_generated_help_is_up_to_date():
    page = runpy.run_path(str(ROOT / "docs" / "make_cli.py"))["page"]()
    written = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    assert words_of(written) == words_of(page), "run: python docs/make_cli.py"


# Spelled so that this file does not match itself.
PACKAGE_HOST = re.compile(
    r"p[y]pi\.|p[y]thonhosted\.|a[n]aconda\.org|d[e]b\.debian\.org|/s[i]mple/"
)
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:h[o]me|U[s]ers|r[o]ot|w[o]rk)/\w|\b[C]:\\+U[s]ers")


def tracked_files() -> list[Path]:
    """Files under version control, and new ones that are not ignored."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: which files belong to the project is not known")
    listed = subprocess.run(
        [
            *("git", "-c", f"safe.directory={ROOT}"),
            *("ls-files", "-z", "--cached", "--others", "--exclude-standard"),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return [path for name in listed.split("\0") if name and (path := ROOT / name).is_file()]


def test_no_file_names_a_package_host_or_a_path_of_some_machine():
    for path in tracked_files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # pictures and arrays
        for pattern in (PACKAGE_HOST, MACHINE_PATH):
            found = pattern.search(text)
            assert found is None, f"{path.relative_to(ROOT)}: {found and found[0]}"


DECISION = re.compile(r"^\*\*(\d{4}-\d\d-\d\d)\. (.+?\?)\*\* (.+)$")


def decisions() -> list[str]:
    """The entries of docs/decisions.md, each on one line."""
    page = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    paragraphs = re.split(r"\n\n+", page.strip())
    return [" ".join(each.split()) for each in paragraphs if not each.startswith("#")][1:]


def test_decisions_are_dated_and_take_three_sentences_at_most():
    for each in decisions():
        match = DECISION.match(each)
        assert match, f"expected **DATE. Question?** Answer: {each[:60]}"
        answer = re.sub(r"\b(et al|eq|vs|e\.g|i\.e)\.", r"\1", match[3])
        sentences = re.split(r"[.?!](?= [A-Z`\"|\d])", answer)
        assert len(sentences) <= 3, f"{len(sentences)} sentences: {match[2]}"


def test_decisions_name_files_that_are_there():
    page = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    paths = re.findall(r"\b(?:sssfit|cli|docs|tests)/[\w/-]+(?:\.\w+)?", page)
    assert len(paths) > 5
    assert [path for path in paths if not (ROOT / path).exists()] == []
