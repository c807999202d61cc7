"""Every figure that is printed is the figure of --json of the same run, cell by cell."""

import csv
import io
import json

import cli_world as world
import pytest
from printed import Exact, Percent, Rough, Table, Words, agrees, check
from printed_layouts import PRINTED, markdown, simulation

from sssfit.cli import cli


@pytest.fixture(scope="module", autouse=True)
def recorded():
    with world.recording():
        yield


@pytest.mark.parametrize("command", list(PRINTED))
def test_what_is_printed_is_what_json_has(command):
    ran = world.run(command, both=True)
    assert ran.status == 0, ran.stdout + ran.stderr
    check(ran.text, PRINTED[command](ran.figures))


def test_tables_in_files_are_those_of_json():
    command = "compare wax.profile.npz --only kernels --size 24x16 --cost passes --table"
    ran = world.run(f"{command} t.md", both=True)
    text = ran.written["t.md"].decode()
    rows = [line for line in text.splitlines() if not line.startswith(("|---", "<!--"))]
    check("\n".join(line.strip("| ").replace(" | ", "  ") for line in rows), markdown(ran.figures))
    ran = world.run(f"{command} t.csv", both=True)
    content = ran.written["t.csv"].decode().removeprefix("# sssfit.table/1\n")
    lines = list(csv.DictReader(io.StringIO(content)))
    assert lines == [flat(row, ran.figures["channels"]) for row in ran.figures["rows"]]


def flat(row, channels):
    """A row of the JSON object as text, a column for each number."""
    found = {}
    for key, value in row.items():
        if key == "on_front":
            found |= {
                f"{key}_{error}_{cost}": str(int(value[error][cost]))
                for error in value
                for cost in value[error]
            }
        elif isinstance(value, list):
            found |= {f"{key}_{name}": value[c] for c, name in enumerate(channels)}
        else:
            found[key] = json.dumps(value) if isinstance(value, dict) else value
    return {key: "" if value is None else str(value) for key, value in found.items()}


@pytest.mark.parametrize("verb", list(cli.commands))
def test_every_verb_is_looked_at(verb):
    assert any(command.split()[0] == verb for command in PRINTED)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.432", 0.43197),
        ("1,236", 1236),
        ("+1.2e-05", 1.234e-5),
        ("9.24 %", Percent(0.09238)),
        ("0 %", Percent(3e-12)),
        ("-", None),
        ("5e-09", Rough(4.7e-9)),
        ("1e4", Exact(10_000)),
        ("2 x 3 mm", Words("{} x {} mm", 2, 3)),
    ],
)
def test_a_rounded_figure_agrees(text, value):
    assert agrees(text, value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.433", 0.43197),
        ("0.4", 0.43197),  # one digit
        ("1,236", 1237),
        ("9.24", Percent(0.09238)),
        ("9.25 %", Percent(0.09238)),
        ("0 %", Percent(1e-4)),
        ("0.1", None),
        ("-", 0.1),
        ("1e4", Exact(12_000)),
        ("3 x 2 mm", Words("{} x {} mm", 2, 3)),
        ("nan", 0.1),
    ],
)
def test_another_figure_does_not(text, value):
    assert not agrees(text, value)


def test_a_table_has_all_its_rows_and_they_differ():
    text = "channel  energy\nR          0.25\nG          0.50\n"
    check(text, [Table(["channel", "energy"], [["R", 0.25], ["G", 0.5]])])
    for rows in ([["R", 0.5], ["G", 0.25]], [["R", 0.25]]):
        with pytest.raises(AssertionError):
            check(text, [Table(["channel", "energy"], rows)])
    with pytest.raises(AssertionError, match="swaps"):
        check(
            text.replace("0.50", "0.25"), [Table(["channel", "energy"], [["R", 0.25], ["G", 0.25]])]
        )


def test_what_went_wrong_in_a_walk_is_printed(capsys):
    """Energy lost in one channel of one material, walks cut off, a target that was not met."""
    from sssfit.cli._simulate_report import figures_of

    rows = [
        figures_of(each, 0.25) | {"path": f"{each.material_name}.npz", "target_error": 0.2}
        for each in (world.profile(), world.profile())
    ]
    rows[0]["relative_error"] = 0.125
    rows[1] |= {
        "material": "lard",
        "energy_balance": [1e-4, -3e-3, 2e-4],
        "energy_balance_stderr": [2e-4, 4e-4, 6e-4],
        "unfinished": [1.25e-4, 2.5e-4, 3.75e-4],
        "relative_error": 0.375,
    }
    figures, text = reported(rows, capsys)
    assert (
        "NOT WITHIN the run's own error: -3.0e-03, standard error 4e-04 (worst channel, lard G)"
        in text
    )
    assert "unfinished, at most: 0.000375" in text
    assert "NOT MET with 4,000 photons, 37.5 % reached" in text  # by the worst of the materials
    check(text, simulation(figures))


def test_of_several_computed_materials_the_worst_error_is_printed(capsys):
    from sssfit.cli._simulate_report import figures_of

    rows = [figures_of(world.exact_profile(), 0.25) | {"path": f"{k}.npz"} for k in range(3)]
    for row, error in zip(rows, (2e-5, 7e-5, 4e-5), strict=True):
        row |= {"material": f"wax {error}", "relative_error": error}
    figures, text = reported(rows, capsys)
    assert text.startswith("3 materials: exact to 0.007 % of the total")
    check(text, simulation(figures))


def reported(rows, capsys):
    """The JSON object and the text of a run of several materials."""
    from sssfit.cli._options import Common
    from sssfit.cli._simulate_report import report

    for as_json in (True, False):
        common = Common(quiet=False, verbose=False, json=as_json, threads=None, seed=1)
        report([dict(row) for row in rows], several=True, common=common, interrupted=False)
    first, _, text = capsys.readouterr().out.partition("\n")
    return json.loads(first), text
