"""Plans of sweeps: what they say of each point, and one line for every fault."""

import math
import pickle

import numpy as np
import pytest

from sssfit.errors import PlanError
from sssfit.material import load_material
from sssfit.sweep import Axis, load_plan
from sssfit.sweep.expression import Expression
from sssfit.sweep.plan import Plan
from sssfit.sweep.plan_checks import in_keys

AXIS = '[[axes]]\nkey = "eta"\nvalues = [1.3, 1.4]\n'
HEAD = 'material = "skin1"\nmethod = "exact"\n'
SKIN = (
    'name = "skin"\nchannels = ["mono"]\n'
    "[[layers]]\neta = 1.4\ng = 0.8\nsigma_a_per_mm = [0.1]\nsigma_s_per_mm = [10.0]\n"
    "thickness_mm = 0.1\n"
    "[[layers]]\neta = 1.4\ng = 0.8\nsigma_a_per_mm = [0.02]\nsigma_s_per_mm = [12.0]\n"
)
SPECTRAL = (
    'material = "skin.toml"\nseed = 7\n[settings]\nphotons = 1e5\n[grid]\nradius_mm = 10.0\n'
    '[[axes]]\nname = "melanin"\nvalues = [0.02, 0.2]\n'
    '[[axes]]\nkey = "layers[0].thickness_mm"\nfrom = 0.05\nto = 0.2\ncount = 3\nspacing = "log"\n'
    '[[axes]]\ntable = "bands.csv"\n'
    '[set]\n"layers[0].sigma_a_per_mm" = "melanin * mel_per_mm + (1 - melanin) * 0.01"\n'
    '"layers[1].sigma_a_per_mm" = "2 * blood_per_mm"\n'
)
BANDS = "# made up\nwavelength_nm,mel_per_mm,blood_per_mm\n500,40,0.2\n600,20,0.03\n"


def written(folder, text, name="plan.toml"):
    path = folder / name
    path.write_text(text)
    return path


@pytest.fixture
def spectral(tmp_path):
    written(tmp_path, SKIN, "skin.toml")
    written(tmp_path, BANDS, "bands.csv")
    return load_plan(written(tmp_path, SPECTRAL))


def test_points_are_all_combinations_with_the_last_axis_fastest(spectral):
    assert spectral.shape == (2, 3, 2)
    assert [spectral.position(k) for k in (0, 1, 2, 11)] == [
        (0, 0, 0),
        (0, 0, 1),
        (0, 1, 0),
        (1, 2, 1),
    ]
    assert [axis.units for axis in spectral.axes] == ["1", "mm", "nm"]


def test_a_point_has_what_axes_and_formulas_set(spectral):
    top, below = spectral.material(9).layers  # melanin .2, thickness the middle one, 600 nm
    assert top.thickness_mm == pytest.approx(math.sqrt(0.05 * 0.2))
    assert top.sigma_a_per_mm[0] == 0.2 * 20.0 + 0.8 * 0.01
    assert below.sigma_a_per_mm[0] == 2 * 0.03
    assert (top.sigma_s_per_mm[0], below.sigma_s_per_mm[0], top.g[0]) == (10.0, 12.0, 0.8)


def test_albedo_keeps_the_extinction(tmp_path):
    plan = load_plan(written(tmp_path, HEAD + '[[axes]]\nkey = "albedo"\nvalues = [0.0, 0.3, 1.0]'))
    base = load_material("skin1").layers[0]
    for k, albedo in enumerate((0.0, 0.3, 1.0)):
        layer = plan.material(k).layers[0]
        np.testing.assert_allclose(layer.sigma_t_per_mm, base.sigma_t_per_mm, rtol=1e-15)
        np.testing.assert_allclose(layer.albedo, albedo, rtol=1e-15)


def test_one_channel_can_be_set(tmp_path):
    text = HEAD + '[[axes]]\nkey = "sigma_s_per_mm.G"\nvalues = [2.0]'
    material = load_plan(written(tmp_path, text)).material(0)
    assert material.layers[0].sigma_s_per_mm.tolist() == [0.74, 2.0, 1.01]


def test_the_grid_serves_the_shortest_and_the_longest_path(tmp_path):
    text = HEAD + '[[axes]]\nkey = "sigma_s_per_mm"\nvalues = [1.0, 4.0]'
    plan = load_plan(written(tmp_path, text))
    a = load_material("skin1").layers[0].sigma_a_per_mm
    assert plan.grid.dr_mm == pytest.approx(1.0 / (4.0 + a.max()) / 20.0)
    assert plan.grid.radius_mm == pytest.approx(32.0 / (1.0 + a.min()), abs=plan.grid.dr_mm)


def test_every_point_has_a_seed_of_its_own(tmp_path, spectral):
    seeds = {spectral.point_seed(k) for k in range(spectral.count)}
    assert len(seeds) == spectral.count
    assert all(0 <= each < 2**63 for each in seeds)
    other = load_plan(tmp_path / "plan.toml", seed=8)
    assert seeds.isdisjoint(other.point_seed(k) for k in range(other.count))


def test_what_changes_a_result_changes_the_fingerprint(spectral):
    fields = {name: getattr(spectral, name) for name in Plan.__dataclass_fields__}
    prints = {spectral.sha256}
    for name, value in (("seed", 8), ("radius_mm", 11.0), ("settings", {"photons": 2})):
        prints.add(Plan(**(fields | {name: value})).sha256)
    assert len(prints) == 4


def in_python(**fields):
    """A plan of two points made in Python; a dictionary is an axis's fields."""
    axis = Axis(**({"name": "eta", "values": (1.3, 1.4), "key": "eta"} | fields.pop("axis", {})))
    return Plan(**({"base": load_material("skin1"), "axes": (axis,), "method": "exact"} | fields))


BAD_IN_PYTHON = {
    "base = 'skin1'; expected a Material": {"base": "skin1"},
    "method = 'exat'; did you mean exact?": {"method": "exat"},
    "method = ['exact']; expected one of": {"method": ["exact"]},
    "seed = -1; expected a whole number": {"seed": -1},
    "seed = 2.5; expected a whole number": {"seed": 2.5},
    "seed = True; expected a whole number": {"seed": True},
    "axes = ({'name': 'eta'},); expected a tuple of Axis": {"axes": ({"name": "eta"},)},
    "axes is missing": {"axes": ()},
    "axis eta has the values (); expected a list of 1 or more": {"axis": {"values": ()}},
    "axis eta has the values (1.3, nan)": {"axis": {"values": (1.3, math.nan)}},
    "axis eta: values is not an array of numbers": {"axis": {"values": ("a",)}},
    "axis eta has the value 1.3 twice": {"axis": {"values": (1.3, 1.4, 1.3)}},
    "axis eta, column m, has 1 values and the axis 2": {"axis": {"columns": {"m": (1.0,)}}},
    "settings.nope is none of exact's": {"settings": {"nope": 1}},
    "settings.dr_mm is none of exact's": {"settings": {"dr_mm": 0.2}},
    "settings.3 is none of exact's": {"settings": {3: 1}},
    "settings = 3; expected a mapping": {"settings": 3},
    "settings.target_error is none of montecarlo's": {
        "method": "montecarlo",
        "settings": {"target_error": 0.01},
    },
    "fit.method = 'nope'": {"fit": {"method": "nope"}},
    "fit.rang is unknown; did you mean rank?": {"fit": {"method": "svd", "rang": 3}},
    "fit = 'svd'; expected a mapping": {"fit": "svd"},
    "set.g = None; expected a formula": {"formulas": {"g": None}},
}


@pytest.mark.parametrize("words", BAD_IN_PYTHON)
def test_a_fault_of_a_plan_in_python_is_one_line_too(words):
    with pytest.raises(PlanError) as caught:
        in_python(**BAD_IN_PYTHON[words])
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_numbers_of_numpy_become_numbers_of_python():
    given = {"axis": {"values": np.array([1.25, 1.5], np.float32)}, "method": "montecarlo"}
    given |= {"settings": {"photons": np.int64(5)}, "seed": np.int64(3)}
    given |= {"formulas": {"g": np.float32(0.5)}, "fit": {"method": "svd", "rank": np.int32(2)}}
    plain = {"axis": {"values": (1.25, 1.5)}, "method": "montecarlo", "settings": {"photons": 5}}
    plain |= {"seed": 3, "formulas": {"g": "0.5"}, "fit": {"method": "svd", "rank": 2}}
    grid = {"dr_mm": 0.25, "radius_mm": 5.0}
    ours, theirs = (in_python(**each, **grid) for each in (given, plain))
    assert ours.sha256 == theirs.sha256
    assert pickle.loads(pickle.dumps(ours)).to_dict() == theirs.to_dict()


@pytest.mark.parametrize(
    ("text", "value"),
    [("1 + 2 * x", 7.0), ("-(x - 1) ** 2 / 4", -1.0), ("1e3*x", 3000.0), ("2 ** -x", 0.125)],
)
def test_arithmetic(text, value):
    assert Expression(text, {"x": 0})({"x": 3.0}) == value


@pytest.mark.parametrize("named", ["micro sign \u00b5", "Greek letter \u03bc"])
@pytest.mark.parametrize("used", ["\u00b5", "\u03bc"])
def test_the_micro_sign_is_the_greek_letter(tmp_path, named, used):
    axis = f'[[axes]]\nname = "{named[-1]}"\nvalues = [0.1]\n'
    path = tmp_path / "plan.toml"
    path.write_text(HEAD + axis + f'[set]\ng = "2 * {used}"', encoding="utf-8")
    assert load_plan(path).material(0).layers[0].g[0] == 0.2


BAD = {
    "x = 1": "x is not a key of a plan",
    "material = 3": "material = 3; expected a name",
    'material = "skin"\n' + AXIS: "there is no material 'skin'",
    'material = "skin1"': "axes is missing",
    HEAD.replace("exact", "exakt") + AXIS: "did you mean exact?",
    HEAD + "seed = -1\n" + AXIS: "seed = -1",
    HEAD + "axes = 3": "expected [[axes]] tables",
    HEAD + "axes = [3]": "axes[0] = 3 is not a table",
    HEAD + AXIS.replace("values", "value"): "axes[0].value is not a key of an axis; did you mean",
    HEAD + AXIS.replace("eta", "etta"): "did you mean eta?",
    HEAD + AXIS.replace("[1.3, 1.4]", "[1.3, nan]"): "values[1] = nan; expected a number",
    HEAD + AXIS.replace("[1.3, 1.4]", "[]"): "expected a list",
    HEAD + AXIS.replace("[1.3, 1.4]", '["a"]'): "values[0] = 'a'",
    HEAD + AXIS.replace("1.4", "14"): "point eta = 14: eta = 14.0 is out of range",
    HEAD + AXIS + "from = 1\n": "axes[0] has values and from",
    HEAD + AXIS + 'spacing = "log"\n': "axes[0] has values and spacing; only a range",
    HEAD + AXIS + "to = 2\ncount = 3\n": "axes[0] has values and to and count; only a range",
    HEAD + '[[axes]]\ntable = "t.csv"\ncount = 3\n': "axes[0] has table and count; only a range",
    HEAD + AXIS + "[settings]\nangles = 6": "settings.angles is none of exact's",
    HEAD + '[[axes]]\nkey = "eta"\n': "axes[0] has no values",
    HEAD + '[[axes]]\nkey = "eta"\nfrom = 1\nto = 2\n': "axes[0] has no count",
    HEAD + '[[axes]]\nkey = "eta"\nfrom = 1\nto = 2\ncount = 1.5': "count = 1.5",
    HEAD + '[[axes]]\nkey = "g"\nfrom = 0\nto = 1\ncount = 3\nspacing = "log"': "above 0 for log",
    HEAD + '[[axes]]\nkey = "eta"\nfrom = 1\nto = inf\ncount = 3': "expected finite ends",
    HEAD + '[[axes]]\nkey = "eta"\nfrom = 1\nto = 2\ncount = 3\nspacing = "lin"': "linear or log",
    HEAD + AXIS.replace("1.4", "1.3"): "axis eta has the value 1.3 twice",
    HEAD + AXIS + AXIS: "two axes or columns are called eta",
    HEAD + AXIS + AXIS.replace("key", 'name = "n"\nkey'): "key = 'eta' is set twice; leave",
    HEAD + AXIS + '[[axes]]\nname = "m"\nvalues = [1.0]': "axis m sets nothing",
    HEAD + AXIS.replace("eta", "albedo") + '[set]\n"sigma_a_per_mm.R" = 0.1': (
        "key = 'sigma_a_per_mm.R' sets a number that 'albedo' sets as well"
    ),
    HEAD + AXIS + "[grid]\ndr_mm = 1e-5": "; use [grid] dr_mm = ",
    HEAD + '[[axes]]\nname = "m"\nvalues = [1.0]': "no axis has a key",
    HEAD + AXIS.replace("key", 'name = "channel"\nkey'): "is a dimension of the store",
    HEAD + AXIS.replace("key", 'name = "absorbed"\nkey'): "absorbed is an array of results in the",
    HEAD + AXIS.replace("key", 'name = "seed"\nkey'): "seed is an array of results in the store",
    HEAD + AXIS.replace("key", 'name = "lambda"\nkey'): "axes[0].name = 'lambda'; the word has",
    HEAD + AXIS.replace("eta", "layers[1].eta"): "skin1 has layers[0] only",
    HEAD + AXIS.replace("eta", "sigma_a_per_mm.X"): "has the channels R, G, B",
    HEAD + AXIS.replace("eta", "thickness_mm") + 'units = "cm"': (
        "axes[0].units = 'cm'; thickness_mm is set in mm: give the values in that"
    ),
    HEAD + AXIS.replace("eta", "eta.R"): "the same for all channels",
    HEAD + AXIS + '[set]\ng = "x + 1"': "'x' is no axis and no column",
    HEAD + AXIS + '[set]\ng = "eta("': "is not arithmetic",
    HEAD + AXIS + '[set]\ng = "open"': "'open' is no axis",
    HEAD + AXIS + '[set]\ng = "eta.real"': "is not arithmetic",
    HEAD + AXIS + '[set]\ng = "eta / 0"': "no real value at a point",
    HEAD + AXIS + '[set]\ng = "9.0 ** 9.0 ** 9.0"': "no real value at a point",
    HEAD + AXIS + "[set]\ng = true": "expected a formula",
    HEAD + AXIS + "[settings]\nphotons = 5": "settings.photons is none of exact's",
    HEAD + AXIS + '[settings]\ntolerance = "x"': "expected a finite number",
    HEAD + AXIS + "[settings]\ntolerance = nan": "expected a finite number",
    HEAD + AXIS + "[grid]\ndr = 1": "grid.dr is unknown; expected dr_mm",
    HEAD + AXIS + "[grid]\ndr_mm = -1.0": "dr_mm = -1.0",
    HEAD + AXIS + '[fit]\nmethod = "svdd"': "did you mean svd?",
    HEAD + AXIS + '[fit]\nmethod = "svd"\nrang = 3': "fit.rang is unknown; did you mean rank?",
    HEAD + AXIS + '[fit]\nfetches = "12"': "fit.fetches = '12'; expected a number.",
    HEAD + AXIS + '[fit]\nseed = "x"': "fit.seed = 'x'; expected a whole number.",
    HEAD + AXIS + '[fit]\nmethod = "guided"\ncentre_bound = "5%"': "expected a number.",
    HEAD + AXIS + '[fit]\nmethod = "artist"\nnear_mm2 = "a"': "expected a number, or one per",
    HEAD + '[[axes]]\ntable = "none.csv"': "none.csv cannot be read",
    "material = [": "not valid TOML",
    HEAD + AXIS.replace("1.4", "1" + 400 * "0"): "expected a number",
    'material = "skin1"\n[settings]\nphotons = 1.5\n' + AXIS: "expected a whole number",
    'material = "skin1"\n[settings]\nphotons = 0\n' + AXIS: "photons = 0",
    'material = "skin1"\n' + AXIS + '[set]\ng = "0.99999"': "the photon walk covers",
    HEAD
    + "".join(
        f'[[axes]]\nkey = "{key}"\nfrom = 0.1\nto = 0.9\ncount = 100\n'
        for key in ("sigma_a_per_mm.R", "sigma_a_per_mm.G", "albedo.B")
    ).replace('key = "sigma_a_per_mm.G"', 'name = "a_g"\nkey = "sigma_a_per_mm.G"'): (
        "100 x 100 x 100 = 1,000,000 points; expected at most 100,000"
    ),
}


@pytest.mark.parametrize("text", BAD, ids=BAD.values())
def test_a_fault_is_one_line_that_names_file_and_remedy(tmp_path, text):
    path = written(tmp_path, text)
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    assert BAD[text] in str(caught.value)


@pytest.mark.parametrize(
    ("said", "in_plan"),
    [
        ("use a smaller `dr_mm`.", "use a smaller [grid] dr_mm."),
        ("use `mm_per_pixel = 0.5` or more", "use [fit] mm_per_pixel = 0.5 or more"),
        ("with `similarity = True`", "with [settings] similarity = true"),
    ],
)
def test_arguments_of_messages_become_keys_of_a_plan(said, in_plan):
    assert in_keys(PlanError(said)) == in_plan


TABLES = {
    "a\n": "t.csv has 0 rows below its head; expected 1 to 100000",
    "a,b\n1\n": "line 2 has 1 cell, and the head has 2",
    "# made up\n\na,b\n1,2\n# more\n1,x\n": "t.csv: line 6: 'x' is not a number",
    "a,a\n1,2\n": "names a column twice",
    "1,2\n1,2\n": "column '1'; an axis that sets no key has a name of letters",
    "a,lambda\n1,2\n": "column 'lambda'; the word has another meaning in formulas",
    "a,b\n1,nan\n": "'nan' is not a number",
}


@pytest.mark.parametrize("table", TABLES, ids=TABLES.values())
def test_faults_of_tables(tmp_path, table):
    written(tmp_path, table, "t.csv")
    text = HEAD + '[[axes]]\ntable = "t.csv"\n[set]\neta = "a"'
    with pytest.raises(PlanError, match=r"t\.csv") as caught:
        load_plan(written(tmp_path, text))
    assert TABLES[table] in str(caught.value)


def test_a_plan_does_not_come_from_stdin():
    with pytest.raises(PlanError, match="- is stdin, and what a plan names lies in the plan's"):
        load_plan("-")


def test_advice_names_keys_of_the_plan():
    told = ValueError(
        "use `method = montecarlo`, `dr_mm = 0.1`, `normalize = True` or `tolerance`."
    )
    assert in_keys(told) == (
        'use method = "montecarlo", [grid] dr_mm = 0.1, [fit] normalize = true or [settings] '
        "tolerance."
    )
