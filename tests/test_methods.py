"""One registry of methods: help, options and functions are made from its entries."""

import inspect
import re
import subprocess
import sys

import cli_world as world
import click
import pytest
from option_rows import FITS as SHARED_ROWS
from option_rows import ROWS

from sssfit import fit
from sssfit.cli import cli
from sssfit.cli._options import in_options, method_options
from sssfit.cli.chart import _OF_CHARTS
from sssfit.compare.covered import MODELS
from sssfit.compare.drawing import _FILES, computed, drawn_of
from sssfit.errors import ProfileError
from sssfit.methods import (
    FITS,
    OF_HALF_SPACES,
    OF_LAYERS,
    SEPARABLE,
    SIMULATIONS,
    TRANSPORT,
    VIEWS,
    Method,
    Setting,
    View,
    imported,
    lines_of,
    settings_of,
)

VERBS = {"simulate": SIMULATIONS, "fit": FITS}
ENTRIES = [(verb, name) for verb, methods in VERBS.items() for name in methods]


def option_of(verb, setting):
    """click's own object."""
    (found,) = [each for each in cli.commands[verb].params if each.name == setting.name]
    return found


def test_the_registry_imports_nothing_heavy():
    program = "import sys, sssfit.methods; assert not {'numpy', 'click'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


@pytest.mark.parametrize(("verb", "name"), ENTRIES)
def test_the_function_takes_every_setting_of_its_entry(verb, name):
    method = VERBS[verb][name]
    parameters = inspect.signature(method.load()).parameters
    for each in method.settings:
        if each.name in ("checkpoint_every", "resume"):  # of the file beside the walk
            assert "checkpoint" in parameters
        elif name in SEPARABLE and each.name in ("taps", "place"):  # of any of these kernels
            assert each.name in inspect.signature(fit.fit_result).parameters
        else:
            assert (each.keyword or each.name) in parameters
    if method.shares:
        assert {"threads", "stop"} <= parameters.keys()


@pytest.mark.parametrize(("verb", "name"), ENTRIES)
def test_help_lists_the_method_and_its_settings(verb, name):
    method = VERBS[verb][name]
    command = cli.commands[verb]
    assert any(
        line.split()[:1] == [name] and line.endswith(method.summary)
        for line in command.epilog.splitlines()
    )
    (choices,) = [each.type.choices for each in command.params if each.name == "method"]
    assert name in choices
    for each in method.settings:
        owners, text = option_of(verb, each).help.split(": ", 1)
        assert name in owners.split(", ")
        assert text.startswith(each.help)


@pytest.mark.parametrize("verb", list(VERBS))
def test_every_setting_has_a_row_in_the_tests_of_options(verb):
    settings = settings_of(VERBS[verb])
    assert {f"--{name.replace('_', '-')}" for name in settings} <= set(ROWS[verb])


def test_a_setting_of_several_fits_is_tried_with_each_of_them():
    known = settings_of(FITS)
    shared = {name: owners for name, (_, owners) in known.items() if len(owners) > 1}
    tried = " ".join(row.command + row.given for row in SHARED_ROWS.values())
    tried += " ".join(ROWS["fit"][f"--{name}"].command for name in shared)
    wanted = ["energy", "irradiance", "place", "rank", "spectrum", "stages", "taps"]
    assert sorted(shared) == wanted
    assert all(f"--method {owner}" in tried for owners in shared.values() for owner in owners)


def test_the_library_has_the_methods_of_the_registry():
    assert list(fit.METHODS) == list(SEPARABLE)
    for name, method in SEPARABLE.items():
        assert fit.METHODS[name].fit is method.load()
        assert fit.METHODS[name].summary == method.summary


def test_every_simulation_says_what_it_solves_or_makes():
    """Comparisons, stresses and ``--model`` take the models from what they solve."""
    known = {"transport": TRANSPORT, "half spaces": OF_HALF_SPACES, "layers": OF_LAYERS}
    for name, each in SIMULATIONS.items():
        assert bool(each.solves) != bool(each.makes)
        assert each.makes or name in known[each.solves]
        assert each.label
    assert len({each.label for each in SIMULATIONS.values()}) == len(SIMULATIONS)
    (model,) = [each for each in cli.commands["compare"].params if each.name == "model"]
    assert [*model.type.choices] == [*MODELS] == [*OF_HALF_SPACES, *OF_LAYERS]


@pytest.mark.parametrize("name", [name for name, each in SEPARABLE.items() if each.counted])
def test_the_number_in_a_file_name_is_that_of_the_kernel(name):
    kernel = world.quietly(SEPARABLE[name].load(), world.profile(), mm_per_pixel=0.4).kernel
    assert kernel.rank == int(SEPARABLE[name].count_of({}))


def test_one_entry_is_a_method_with_help_and_options():
    new = Setting("sharpness", "whole", "how sharp.", "N", (1, 9), words="3")
    methods = {**SEPARABLE, "new": Method("sssfit.fit.svd:fit_svd", "as the test says", (new,))}
    assert lines_of(methods).splitlines()[-1] == "  new            as the test says"

    @click.command()
    @method_options(methods)
    def command(**_given):
        """Nothing."""

    (option,) = [each for each in command.params if each.name == "sharpness"]
    assert option.help == "new: how sharp.  [default: 3]"
    assert option.type.convert("9", None, None) == 9
    with pytest.raises(click.BadParameter):
        option.type.convert("10", None, None)
    assert len(command.params) == len(settings_of(SEPARABLE)) + 1


def test_an_entry_without_a_function_says_what_is_expected():
    with pytest.raises(ValueError, match=r"'sssfit.fit' names no function; expected \"module:name"):
        Method("sssfit.fit", "as the test says").load()


@pytest.mark.parametrize("name", VIEWS)
def test_a_view_names_what_there_is(name):
    """Its function takes what it says, which are options that the other charts refuse."""
    view = VIEWS[name]
    assert callable(imported(view.figure))
    assert set(view.of) <= _FILES.keys()
    if view.page:
        assert list(inspect.signature(imported(view.page)).parameters) == ["figures"]
    options = {each.name for each in cli.commands["chart"].params}
    assert set(view.takes) <= _OF_CHARTS.keys() | {"seed", "threads", "walk"}
    assert set(view.takes) & _OF_CHARTS.keys() <= options
    if view.flag:
        assert in_options(f"`{name} = True`") == f"--{name}"
    if view.function:
        assert set(view.takes) <= inspect.signature(imported(view.function)).parameters.keys()


def test_a_view_that_lacks_its_page_or_its_function_is_refused():
    own = {"of": ("Profile",), "record": "Spectrum", "figure": "sssfit.chart.x:x_figure"}
    with pytest.raises(ValueError, match=r"view of Spectrum is computed; give its page, too"):
        View(**own, function="sssfit.compare.spectrum:compute_spectrum")
    with pytest.raises(ValueError, match=r"view of Spectrum has a flag; give its function, too"):
        View(**own, flag="Draw it.")


def test_an_entry_is_a_view_of_the_records_that_it_names(monkeypatch):
    entry = View(
        of=("SeparableKernel", "Material"),
        record="tuple",
        figure="sssfit.chart.x:x_figure",
        flag="Draw the sum.",
        function="builtins:sorted",
        takes=("reverse",),
        page="sssfit.chart.x:x_page",
    )
    monkeypatch.setitem(VIEWS, "new", entry)
    assert drawn_of(world.kernel(), "new", "k.json")[1] == "new"
    assert drawn_of(world.kernel(), "", "k.json")[1] == "kernel"
    assert computed([1, 3, 2], "new", reverse=True) == [3, 2, 1]
    assert computed([1, 3, 2], "new", reverse=None) == [1, 2, 3]
    said = (
        "p.npz is not a separable kernel or a material; `new = True` draws one, a .kernel.json "
        "file or a TOML file."
    )
    with pytest.raises(ProfileError, match=f"^{re.escape(said)}$"):
        drawn_of(world.profile(), "new", "p.npz")
    with pytest.raises(ProfileError, match=r"^no view 'old' of a file; expected one of profile, "):
        drawn_of(world.profile(), "old", "p.npz")
    with pytest.raises(ProfileError, match=r"^x: there is no chart of str"):
        drawn_of("", "", "x")
