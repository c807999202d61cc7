"""The documents as a site: every page has its place, every public name is on a page."""

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import fork_server
import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
CONFIG = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
ROOMS = (
    *("material", "profile", "kernel", "simulate", "fit"),
    *("render", "compare", "export"),
)


def modules_on_pages() -> set[str]:
    """Every module whose docstrings a page shows."""
    text = "\n".join((DOCS / page).read_text(encoding="utf-8") for page in PAGES)
    return set(re.findall(r"^::: ([\w.]+)$", text, re.MULTILINE))


def test_the_navigation_has_every_page_once():
    assert sorted(re.findall(r"^ .*: ([\w/-]+\.md)$", CONFIG, re.MULTILINE)) == PAGES


def pages_between(start, end):
    """Titles of the navigation from one of its lines to another, by page."""
    lines = CONFIG.partition(f"  - {start}")[2].partition(f"  - {end}")[0]
    found = re.findall(r"(?:- |^)([^-\n]+): ([\w-]+\.md)$", lines, re.MULTILINE)
    return {page: title.strip() for title, page in found}


def test_pages_have_the_titles_of_the_navigation():
    pages = pages_between("Home", "Python:")
    assert len(pages) > 20
    for page, title in pages.items():
        if page != "index.md":
            text = (DOCS / page).read_text(encoding="utf-8")
            heading = re.search(r"^# (.+)$", text, re.MULTILINE)[1]
            assert heading.partition(":")[0] == title, page


def test_readme_and_index_link_every_guide():
    for path, folder in ((ROOT / "README.md", "docs/"), (DOCS / "index.md", "")):
        text = path.read_text(encoding="utf-8")
        guides = pages_between("Guide:", "Reference:")
        assert [page for page in guides if f"]({folder}{page})" not in text] == []


@pytest.mark.parametrize("module", sorted(modules_on_pages()))
def test_modules_on_pages_are_there(module):
    assert importlib.import_module(module).__doc__


@pytest.mark.parametrize("room", ROOMS)
def test_public_functions_and_records_are_on_a_page(room):
    public = importlib.import_module(f"sssfit.{room}")
    names = getattr(public, "__all__", None) or [
        name for name in vars(public) if not name.startswith("_")
    ]
    homes = {name: getattr(getattr(public, name), "__module__", None) for name in names}
    shown = modules_on_pages()
    missing = [
        f"{name} of {home}"
        for name, home in homes.items()
        if home and "._" not in home and home.startswith("sssfit.") and home not in shown
    ]
    assert missing == []


@pytest.mark.parametrize("page", PAGES)
def test_links_of_the_pages_lead_somewhere(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)", text):
        found = (DOCS / page).parent / target
        assert found.exists(), target
        assert found.resolve().is_relative_to(DOCS), f"{target} is not a page of the site"


def test_links_to_headings_have_their_heading():
    for page in PAGES:
        for target, heading in re.findall(
            r"\]\(([\w./-]*\.md)#([\w-]+)\)", (DOCS / page).read_text(encoding="utf-8")
        ):
            text = ((DOCS / page).parent / target).read_text(encoding="utf-8")
            words = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
            assert heading in [
                re.sub(r"[^\w\s-]", "", each).lower().replace(" ", "-") for each in words
            ]


# Without the index of words, of which nothing is asked here and which takes a third of the time.
BUILD = """
import sys
from mkdocs.commands.build import build
from mkdocs.config import load_config
from mkdocs.utils import yaml_load
with open("mkdocs.yml", encoding="utf-8") as file:
    plugins = [each for each in yaml_load(file)["plugins"] if each != "search"]
build(load_config("mkdocs.yml", strict=True, site_dir=sys.argv[1], plugins=plugins))
"""


def test_strict_build(tmp_path):
    """What the tests above ask, by mkdocs itself; .ci/run builds the whole site in any case."""
    if shutil.which("mkdocs", path=str(Path(sys.executable).parent)) is None:
        pytest.skip('mkdocs is not installed: pip install -e ".[docs]"')
    run = subprocess.run(
        [sys.executable, "-c", BUILD, tmp_path],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "simulate_exact" in (tmp_path / "api" / "simulate.html").read_text(encoding="utf-8")


def test_ci_builds_the_site():
    assert "mkdocs" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "--strict" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


SHELLS = ("bash", "zsh", "fish")


@pytest.mark.parametrize("shell", SHELLS)
def test_shell_completion_is_as_documented(shell):
    page = (DOCS / "command-line.md").read_text(encoding="utf-8")
    (line,) = re.findall(rf"^```{shell}\n(.+)\n```$", page, re.MULTILINE)
    variable, value = re.search(r"(_\w+_COMPLETE)=(\w+) sssfit", line).groups()
    assert value == f"{shell}_source"
    script = completion({variable: value})
    assert f"{shell}_complete" in script
    given = {"COMP_WORDS": "sssfit si", "COMP_CWORD": "si" if shell == "fish" else "1"}
    assert "simulate" in completion({variable: f"{shell}_complete", **given})


def completion(environment: dict[str, str]) -> str:
    """What the program prints to a shell that asks."""
    program = "import sys; sys.argv[0] = 'sssfit'; from sssfit.cli import main; main()"
    command = [sys.executable, "-c", program]
    ended = fork_server.run(command, env=os.environ | environment, timeout=60)
    assert (ended.returncode, ended.stderr) == (0, "")
    return ended.stdout
