"""The documents say what the program does, and no file names a private place."""

import contextlib
import io
import re
import runpy
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from sssfit.cli import cli, main
from sssfit.formats.pictures import load_image
from sssfit.kernel import Taps
from sssfit.material import parse_material
from sssfit.measure.score import measure
from sssfit.scene.made import make_scene

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
README = (ROOT / "README.md").read_text(encoding="utf-8")
LINES = 130  # of the README
STRUCTURE = "1-1|1-2|2-2|2-2"  # of the default cascade of skin1; docs/integrate.md is for it


def code_blocks(language: str = "", page: str = "") -> list[str]:
    """The fenced blocks of one language of a page of docs/, in order; of the README by default."""
    text = (DOCS / page).read_text(encoding="utf-8") if page else README
    fences = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [body for found, body in fences if found == language]


def test_readme_is_short():
    assert len(README.splitlines()) <= LINES


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


def test_materials_in_the_documents_load():
    (example,) = code_blocks("toml", "own-materials.md")
    assert len(parse_material(example, "own-materials.md").layers) == 2


def commands_of(page: str, start: str = "sssfit ") -> list[list[str]]:
    """A page's commands that begin so, one a line, as words."""
    lines = "\n".join(code_blocks(page=page)).splitlines()
    return [line.split() for line in lines if line.startswith(start)]


def printed_by(arguments: list[str], folder: Path) -> str:
    """What a command of ours that ends well prints on stdout."""
    printed = io.StringIO()
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(printed),
        pytest.raises(SystemExit) as ended,
    ):
        main(arguments)
    assert ended.value.code == 0
    return printed.getvalue()


def table_of(text: str) -> list[list[str]]:
    """Channel, diffuse reflectance and standard error of each line about a channel."""
    return [line.split()[:3] for line in text.splitlines() if line.startswith(("R ", "G ", "B "))]


def test_python_example_does_what_its_command_line_does(tmp_path, monkeypatch, capsys):
    (example,) = code_blocks("python", "simulate.md")
    command, _ = commands_of("simulate.md", "sssfit simulate")
    python_prints, command_prints, *_ = code_blocks("text", "simulate.md")
    arrays = (DOCS / "files.md").read_text(encoding="utf-8")
    from_python, from_command_line = tmp_path / "python", tmp_path / "command-line"
    from_python.mkdir()
    from_command_line.mkdir()

    monkeypatch.chdir(from_python)
    exec(compile(example, "simulate.md", "exec"), {})
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
            assert f"| `{name}` |" in arrays, f"{name} is not in the table of files.md"


def test_the_python_of_the_readme_runs(capsys):
    (example,) = code_blocks("python")
    exec(compile(example, "README.md", "exec"), {})
    assert capsys.readouterr().out == f"{STRUCTURE} (2, 2, 3)\n"


def test_the_overview_of_the_python_pages_runs(capsys):
    (example,) = code_blocks("python", "api/index.md")
    exec(compile(example, "api/index.md", "exec"), {})
    assert [capsys.readouterr().out] == code_blocks("text", "api/index.md")


def defined_on(page: str) -> set[str]:
    """The functions and classes of the packages whose modules a page of the API shows."""
    shown = re.findall(r"^::: sssfit\.(\w+)", (DOCS / "api" / page).read_text(), re.MULTILINE)
    files = [each for room in shown for each in (ROOT / "sssfit").glob(f"{room}*/**/*.py")]
    files += [ROOT / "sssfit" / f"{room}.py" for room in shown]
    code = "\n".join(each.read_text(encoding="utf-8") for each in files if each.exists())
    return {*re.findall(r"(?:def|class) (\w+)", code)}


def test_the_overview_of_the_python_pages_names_what_its_pages_show():
    text = (DOCS / "api" / "index.md").read_text(encoding="utf-8").partition("```python")[0]
    for item in text.split("\n- ")[1:]:
        known = set[str]().union(*map(defined_on, re.findall(r"\]\((\w+\.md)\)", item)))
        named = set(re.findall(r"`(\w+)(?:\(.*?\))?`", item))
        assert not known or named <= known, item


def test_a_material_by_its_colour_is_printed_as_documented(tmp_path):
    command, *_ = commands_of("own-materials.md", "sssfit materials --from")
    (prints,) = code_blocks("text", "own-materials.md")
    assert figures_of(printed_by(command[1:], tmp_path)) == figures_of(prints)


def test_a_colour_in_hex_is_the_same_in_codes(tmp_path):
    page = code_blocks("", "own-materials.md")
    (block,) = (each for each in page if "#c58c6b" in each)
    made = []
    for line in block.splitlines():
        printed_by(shlex.split(line)[1:], tmp_path)
        made.append((tmp_path / "mine.toml").read_text())
    assert len(made) == 2
    assert made[0] == made[1]


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> tuple[Path, dict[tuple[str, ...], str]]:
    """The tutorial, done: its folder, and what each of its commands printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    commands = commands_of("tutorial.md")
    return folder, {tuple(each): printed_by(each[1:], folder) for each in commands}


def test_the_tutorial_prints_what_it_says(session):
    _, printed = session
    assert len(printed) == 6
    found = [figures_of(each) for each in printed.values()]
    said = [figures_of(each) for each in code_blocks("text", "tutorial.md")]
    assert found[: len(said)] == said  # the last command, export, prints the name of its file only


def test_the_tutorial_ends_in_the_passes_that_are_shown(session):
    folder, printed = session
    written = (folder / "skin1.exact.cascade24.hlsl").read_text(encoding="utf-8")
    rows, blur = code_blocks("hlsl", "tutorial.md")
    assert rows in written
    assert f"\n{blur}\n" in written
    assert abs(len(written) - 9_000) < 500, "9 kB, says the tutorial"
    assert STRUCTURE in printed["sssfit", "fit"]
    assert f"// {STRUCTURE}: " in written


def test_the_readme_shows_ten_lines_of_its_session(session):
    folder, _ = session
    (excerpt,) = code_blocks("hlsl")
    written = (folder / "skin1.exact.cascade24.hlsl").read_text(encoding="utf-8")
    assert excerpt in written
    assert len(excerpt.splitlines()) == 10
    assert "9 kB of HLSL" in " ".join(README.split())


def test_the_readme_says_how_near_its_session_ends(session):
    folder, _ = session
    name = "skin1.exact.cascade24.taps.json"
    files = ["-o", "own.exr", "--truth", "truth.exr"]
    said = printed_by(["render", name, "--irradiance", "head", *files], folder)
    own, truth = (load_image(folder / each).pixels for each in ("own.exr", "truth.exr"))
    scene = make_scene("head", height=len(truth), width=truth.shape[1], mm_per_pixel=0.3)
    unblurred = scene.irradiance * Taps.load(folder / name).energy
    near, far = (measure(each, truth, mask=scene.mask) for each in (own, unblurred))
    assert f"95th percentile {near.delta_e_2000_p95:.3g}" in said
    words = " ".join(README.split())
    assert (
        f"below {far.delta_e_2000_p95:.2g} without blur and below {near.delta_e_2000_p95:.2g} with "
        "the cascade's 23 texture fetches"
    ) in words


def test_the_commands_of_the_readme_are_those_of_the_tutorial(session):
    _, printed = session
    commands = [tuple(line) for line in (each.split() for each in README.splitlines()) if line]
    commands = [each for each in commands if each[0] == "sssfit" and each[1] in cli.commands]
    four = [each for each in commands if each in printed]
    assert [each[1] for each in four] == ["simulate", "fit", "export", "render"]


def test_other_pages_print_what_the_tutorial_does(session):
    _, printed = session
    *_, exact = code_blocks("text", "simulate.md")
    fit, render = code_blocks("text", "kernels.md")
    for page, verb, said in (
        ("simulate.md", ["simulate", "skin1", "--method"], exact),
        ("kernels.md", ["fit"], fit),
        ("kernels.md", ["render"], render),
    ):
        (command,) = commands_of(page, " ".join(["sssfit", *verb]))
        assert figures_of(printed[tuple(command)]) == figures_of(said)


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


# Phrases that stop a reader; what stands beside them reads at speed.
ODD_PHRASES = {
    r"of no use": "invalid",
    r"ha(s|ve) not the": "does not ...",
    r"\bto be had\b": "available",
    r"\banew\b": "again",
    r"leaves? off": "omits",
    r"\bwhatever\b": "any, independent of",
    r"held against": "compared with",
    r"\bby custom\b": "by convention",
    r"\bis no file\b": "is missing",
    r"\btakes? the place\b": "replaces",
    r"\bis said to\b": "the page that says it",
    r"\bnow and then\b": "at intervals",
    r"\bto be looked at\b": "to be used",
}


@pytest.mark.parametrize("phrase", ODD_PHRASES)
def test_prose_is_plain(phrase):
    places = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"]
        + [path for room in ("sssfit", "cli") for path in (ROOT / room).rglob("*.py")]
        + list(DOCS.rglob("*.md"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(phrase, line, re.IGNORECASE)
    ]
    assert places == [], f"write {ODD_PHRASES[phrase]}"
