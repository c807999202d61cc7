"""What is installed: one import name, every room, the materials, one version."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import sssfit

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PAPER = {
    *("apple", "chicken1", "chicken2", "cream", "ketchup", "marble"),
    *("potato", "skimmilk", "skin1", "skin2", "wholemilk"),
}
MATERIALS = {path.stem for path in (ROOT / "materials").rglob("*.toml")}
# Distributions that are imported by another name.
IMPORT_NAMES = {
    "colour-science": "colour",
    "scikit-image": "skimage",
    "flip-evaluator": "flip_evaluator",
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built through the sdist from a copy of the sources, without a network."""
    source = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    for name in ("sssfit", "cli", "materials"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    run = subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation"],
        cwd=source,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    (wheel,) = (source / "dist").glob("*.whl")
    return wheel


def test_packages_are_the_folders_with_an_init_file():
    settings = PYPROJECT["tool"]["setuptools"]
    folders = {
        path.parent.relative_to(ROOT)
        for top in ("sssfit", "cli", "materials")
        for path in (ROOT / top).rglob("__init__.py")
    }
    names = {
        ".".join(folder.parts if folder.parts[0] == "sssfit" else ("sssfit", *folder.parts))
        for folder in folders
    }
    assert set(settings["packages"]) == names
    assert len(settings["packages"]) == len(names)


def test_wheel_has_one_import_name(wheel):
    with zipfile.ZipFile(wheel) as archive:
        top = {name.partition("/")[0] for name in archive.namelist()}
    assert top == {"sssfit", f"sssfit-{sssfit.__version__}.dist-info"}


def test_wheel_holds_every_source_and_material(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert "sssfit/py.typed" in names
    tables = {
        Path(name).stem
        for name in names
        if name.startswith("sssfit/materials/") and name.endswith(".toml")
    }
    assert tables == MATERIALS > PAPER
    for top, installed in (("sssfit", "sssfit"), ("cli", "sssfit/cli")):
        for path in (ROOT / top).rglob("*.py"):
            assert f"{installed}/{path.relative_to(ROOT / top).as_posix()}" in names


def test_wheel_runs_without_the_checkout(wheel, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    run = subprocess.run(
        [sys.executable, "-c", "import sssfit.cli as c; print(c.__file__); c.main(['materials'])"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path / "installed")},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert run.returncode == 0, run.stderr
    where, *listing = run.stdout.splitlines()
    assert Path(where).is_relative_to(tmp_path / "installed")
    assert {line.split()[0] for line in listing if line} >= MATERIALS


def test_citation_has_the_version():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (.+)$", citation, re.MULTILINE)[1] == sssfit.__version__


def test_declared_dependencies_are_the_imported_ones():
    project = PYPROJECT["project"]
    needed = import_names(project["dependencies"])
    extras = (project["optional-dependencies"][name] for name in ("metrics", "mesh"))
    extra = set[str]().union(*map(import_names, extras))
    foreign = set(sys.stdlib_module_names) | {"sssfit"}
    assert needed | extra == imported(r"^\s*(?:from|import) (\w+)") - foreign
    at_heads = imported(r"^(?:from|import) (\w+)")
    assert not extra & at_heads, "what an extra brings is imported in functions only"


def import_names(requirements):
    """What is imported of each, where it has another name."""
    names = {re.match(r"[\w.-]+", requirement)[0] for requirement in requirements}
    return {IMPORT_NAMES.get(name, name) for name in names}


def imported(pattern):
    """The packages that lines of this form import, anywhere in the sources."""
    sources = "\n".join(
        path.read_text(encoding="utf-8")
        for top in ("sssfit", "cli")
        for path in (ROOT / top).rglob("*.py")
    )
    return set(re.findall(pattern, sources, re.MULTILINE))
