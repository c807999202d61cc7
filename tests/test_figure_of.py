"""Any record that has a chart is drawn by what it is."""

import ast
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from reference_pixels import make_profile

import sssfit.chart
from sssfit.chart import FIGURES, figure_of
from sssfit.compare import compute_spectrum
from sssfit.errors import ArgumentError
from sssfit.material import load_material
from sssfit.methods import imported

ROOM = Path(sssfit.chart.__file__).parent


def test_the_registry_has_every_figure_of_the_room():
    drawn = {
        f"sssfit.chart.{path.stem}:{node.name}"
        for path in ROOM.glob("*.py")
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.FunctionDef)
        and node.name.endswith("_figure")
        and node.returns is not None
        and ast.unparse(node.returns) == "Figure"
    }
    assert drawn == set(FIGURES.values())


@pytest.mark.parametrize("kind", FIGURES)
def test_a_figure_takes_the_record_that_it_is_registered_for(kind):
    annotations = [str(each) for each in imported(FIGURES[kind]).__annotations__.values()]
    assert any(kind in each for each in annotations), annotations


@pytest.mark.parametrize("kind", FIGURES)
@pytest.mark.parametrize("other", [None, "skin1", []], ids=repr)
def test_a_figure_refuses_other_records(kind, other):
    with pytest.raises(ArgumentError, match=f"is not drawn here; expected the record {kind}"):
        imported(FIGURES[kind])(other)


def test_a_record_is_drawn_by_what_it_is():
    profile = make_profile([0.0, 1.0, 4.0, 9.0], [[0.2, 0.1], [0.1, 0.1], [0.1, 0.05]])
    spectrum = compute_spectrum(profile, mm_per_pixel=1.0)
    for each in (load_material("skin1"), profile, spectrum):
        assert isinstance(figure_of(each), Figure)
    assert isinstance(profile.plot(), Figure)


@pytest.mark.parametrize("other", [None, "skin1", [], ["skin1"]], ids=repr)
def test_what_has_no_chart_is_refused_in_one_line(other):
    with pytest.raises(ArgumentError) as caught:
        figure_of(other)
    said = f"there is no chart of {other!r}; expected one of AngularReflectance, Budget, "
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)
