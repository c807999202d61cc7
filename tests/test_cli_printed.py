"""Every figure that is printed is that of --json of the same run, and that is the file's own."""

import csv
import io
import json

import cli_world as world
import numpy as np
import pytest
from printed import Exact, Percent, Rough, Table, Words, agrees, check
from printed_layouts import PRINTED, markdown, simulation

from sssfit.arrays import plain_value
from sssfit.cli import cli
from sssfit.kernel import SeparableKernel
from sssfit.profile import Profile


@pytest.fixture(scope="module", autouse=True)
def recorded():
    with world.recording():
        yield


@pytest.mark.parametrize("command", list(PRINTED))
def test_what_is_printed_is_what_json_has(command):
    ran = world.run(command, both=True)
    assert ran.status == 0, ran.stdout + ran.stderr
    check(ran.text, PRINTED[command](ran.figures))


# The figures of a profile, by their names in JSON; from the arrays where it has them.
FIGURES = {
    "channels": lambda made: made.channels,
    "method": lambda made: made.meta["method"],
    "photons": lambda made: made.meta["photons"],
    "seed": lambda made: made.meta["seed"],
    "annuli": lambda made: len(made.r_edges_mm) - 1,
    "dr_mm": lambda made: made.r_edges_mm[1],
    "radius_mm": lambda made: made.r_edges_mm[-1],
    "diffuse_reflectance": lambda made: made.annulus_energy.sum(axis=0) + made.beyond_grid,
    "diffuse_reflectance_stderr": lambda made: made.diffuse_reflectance_stderr,
    "specular_reflectance": lambda made: made.specular_reflectance,
    "beyond_grid": lambda made: made.beyond_grid,
    "absorbed": lambda made: sum(made.absorbed) if len(made.absorbed) else None,
    "absorbed_by_layer": lambda made: made.absorbed if len(made.absorbed) else None,
    "transmittance": lambda made: through(made),
    "transmittance_stderr": lambda made: made.transmittance_stderr,
    "unfinished": lambda made: made.unfinished,
    "energy_balance": lambda made: made.energy_balance,
    "energy_balance_stderr": lambda made: made.meta.get("energy_balance_stderr"),
    "relative_error": lambda made: made.meta["relative_error"],
    "radius_of_50_percent_mm": lambda made: made.energy_radii_mm([0.5])[0],
    "radius_of_90_percent_mm": lambda made: made.energy_radii_mm([0.9])[0],
    "radius_of_99_percent_mm": lambda made: made.energy_radii_mm([0.99])[0],
    "settings": lambda made: dict(made.meta.get("settings", {})),
    "empty_annuli": lambda made: (
        None if made.photons is None else (made.annulus_energy == 0.0).sum(axis=0)
    ),
}


# And those of a kernel; the energies are sums over all of its pixels.
KERNEL_FIGURES = {
    "channels": lambda made: made.channels,
    "method": lambda made: made.method,
    "rank": lambda made: len(made.signs),
    "pixels": lambda made: made.weights.shape[1],
    "mm_per_pixel": lambda made: made.mm_per_pixel,
    "support_mm": lambda made: made.weights.shape[1] // 2 * made.mm_per_pixel,
    "energy": lambda made: [made.full(c).sum() for c in range(len(made.channels))],
    "scale": lambda made: made.scale,
    "relative_frobenius_error": lambda made: made.relative_frobenius_error,
    "energy_error": lambda made: made.energy_error,
    "sign": lambda made: made.signs,
    "term_energy": lambda made: [
        [sign * np.outer(half, half).sum() for sign, half in zip(signs, term.T, strict=True)]
        for signs, term in zip(made.signs, made.weights, strict=True)
    ],
    "middle_weight": lambda made: [term[len(term) // 2] for term in made.weights],
    "parameters": lambda made: made.parameters,
    "settings": lambda made: made.meta["settings"],
    **{
        key: lambda made, key=key: made.meta[key]
        for key in ("material", "profile_method", "photons", "seed", "version", "profile_sha256")
    },
}


def through(made):
    """What leaves at the bottom; None where there is none."""
    below = made.annulus_transmittance
    return None if below is None else below.sum(axis=0) + made.beyond_grid_transmittance


# Those that are of the run, and those that are words.
OTHERS = {
    "show": {"kind", "format", "file", "material", "version", "uniform"},
    "simulate": {"material", "seconds", "photons_per_second", "target_error", "finished_before"},
    "import": {"material", "source"},
    "fit": {"profile", "taps", "evaluations", "stop_reason", "seconds"},
}


@pytest.mark.parametrize(
    "command",
    [
        "show wax.profile.npz",
        "show plate.profile.npz",  # of layers, and light comes through
        "simulate wax.toml --photons 4000 --dr .2 --radius 6 -o made.npz",
        "simulate plate.toml --photons 3000 --dr .2 --radius 4",
        "simulate plate.toml --method multipole --dr .3 --radius 8",
        "simulate wax.toml --method dipole --dr .3 --radius 8",
        "import table.csv",
        "import r.mco g.mco --channels a,b -o made.npz",
        "show wax.svd2.kernel.json",
        "show wax.gaussians2.kernel.json",
        "fit wax.profile.npz --method svd --rank 2 --energy keep --mm-per-pixel .4",
        "fit wax.profile.npz --method gaussians --terms 2 --mm-per-pixel .4 --normalize",
    ],
)
def test_the_figures_of_json_are_those_of_the_file(command):
    ran = world.run(command, both=True)
    verb, name, *_ = command.split()
    is_kernel = verb == "fit" or name.endswith(".kernel.json")
    load = SeparableKernel.load if is_kernel else Profile.load
    made = (
        load(world.files() / name)
        if verb == "show"
        else ran.loaded(load, ".kernel.json" if is_kernel else ".npz")
    )
    known = KERNEL_FIGURES if is_kernel else FIGURES
    figures = {key: each for key, each in ran.figures.items() if key in known}
    assert ran.figures.keys() <= {*known, *OTHERS[verb], "command", "output"}
    for key, figure in figures.items():
        wanted = plain_value(known[key](made))
        assert same(figure, wanted), f"{key}: {figure} is not {wanted}"


def same(found, wanted):
    """Whether figures of JSON are equal but for rounding in sums."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        return found.keys() == wanted.keys() and all(same(found[k], wanted[k]) for k in wanted)
    if isinstance(found, list) and isinstance(wanted, list):
        return len(found) == len(wanted) and all(map(same, found, wanted))
    if isinstance(found, float) and isinstance(wanted, (int, float)):
        return found == pytest.approx(wanted, rel=1e-9, abs=1e-15)
    return found == wanted


def test_tables_in_files_are_those_of_json():
    command = "compare wax.profile.npz --what kernels --size 24x16 --cost passes --table"
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


def test_what_went_wrong_in_a_walk_is_printed():
    """Energy lost in one channel of one material, walks cut off, a target that was not met."""
    from sssfit.simulate import run_figures

    rows = [
        run_figures(each, 0.25) | {"path": f"{each.material_name}.npz", "target_error": 0.2}
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
    figures, text = reported(rows)
    assert (
        "NOT WITHIN the run's own error: -3.0e-03, standard error 4e-04 (worst channel, lard G)"
        in text
    )
    assert "unfinished, at most: 0.000375" in text
    assert "NOT MET with 4,000 photons, 37.5 % reached" in text  # by the worst of the materials
    check(text, simulation(figures))


def test_of_several_computed_materials_the_worst_error_is_printed():
    from sssfit.simulate import run_figures

    rows = [run_figures(world.exact_profile(), 0.25) | {"path": f"{k}.npz"} for k in range(3)]
    for row, error in zip(rows, (2e-5, 7e-5, 4e-5), strict=True):
        row |= {"material": f"wax {error}", "relative_error": error}
    figures, text = reported(rows)
    assert text.startswith("3 materials: exact (half-space solver) to 0.007 % of the total")
    check(text, simulation(figures))


def reported(rows):
    """The JSON object and the text of a run of several materials."""
    from sssfit.cli._options import in_options
    from sssfit.simulate.summary import summary

    rows = [dict(row) for row in rows]
    paths = [row.pop("path") for row in rows]
    text = f"{in_options(summary(rows, several=True))}\nWrote {', '.join(paths)}"
    return json.loads(json.dumps({"output": paths, "rows": plain_value(rows)})), text
