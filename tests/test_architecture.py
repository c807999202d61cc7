"""docs/architecture.md is true: every room is in its picture, imports point down, paths exist."""

import re
from itertools import pairwise
from pathlib import Path

import pytest
from test_imports import CLI, IN_ROOMS, ROOMS, imports, module_of, name_of, room_of

from sssfit.cli import cli

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def picture() -> dict[str, int]:
    """The line of each room in the picture, from the top; the right column holds words."""
    (drawn,) = re.findall(r"^```text\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return {
        room: number for number, line in enumerate(drawn.splitlines()) for room in line[:38].split()
    }


def test_the_picture_has_every_room_once():
    assert sorted(picture()) == sorted(ROOMS)


@pytest.mark.parametrize("path", IN_ROOMS, ids=name_of)
def test_imports_point_down_the_picture(path):
    line, room = picture(), room_of(module_of(path))
    others = {
        room_of(module)
        for module in imports(path)
        if module.startswith("sssfit.") and module != "sssfit.__version__"
    } - {room, "_jit"}
    assert [other for other in others if line[other] <= line[room]] == []


def test_every_path_exists():
    paths = re.findall(r"`((?:sssfit|cli|docs|tests|materials)/[\w/.]*|pyproject\.toml)`", PAGE)
    assert len(paths) > 25
    assert [path for path in paths if not (ROOT / path).exists() and "test_x" not in path] == []


def test_the_way_of_a_photon_is_a_chain_of_records():
    """Each step of the way names a file, and the steps are in the order of the rooms."""
    steps = re.findall(r"^(\d)\. (.*?)(?=^\d\. |\n\n)", PAGE, re.MULTILINE | re.DOTALL)
    rooms = [re.findall(r"`sssfit/(\w+)/", text)[-1] for _, text in steps]
    assert rooms == ["material", "simulate", "_jit", "profile", "fit", "kernel", "export"]
    assert all(int(b) == int(a) + 1 for (a, _), (b, _) in pairwise(steps))


def test_a_verb_parses_calls_and_writes_in_150_lines():
    verbs = [each for each in (ROOT / "cli").glob("*.py") if not each.name.startswith("_")]
    lengths = {each.name: len(each.read_text(encoding="utf-8").splitlines()) for each in verbs}
    assert {name.removesuffix(".py").rstrip("_") for name in lengths} == {*cli.commands}
    assert {name: length for name, length in lengths.items() if length > 150} == {}


def test_the_command_line_is_at_most_2000_lines_and_100_for_a_verb_beyond_ten():
    """What a verb does is a call of the library; here are its options, and what it writes."""
    lengths = [len(each.read_text(encoding="utf-8").splitlines()) for each in CLI]
    assert sum(lengths) <= 2000 + 100 * (len(cli.commands) - 10), lengths


def test_the_ground_is_at_most_twelve_files():
    assert len(list((ROOT / "sssfit").glob("*.py"))) <= 12
