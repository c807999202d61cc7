"""The toolkit in a notebook: three calls, names or records, loaded when they are asked for."""

import inspect
import subprocess
import sys

import numpy as np
import pytest

import sssfit
import sssfit.compare
from sssfit.errors import FitError, MaterialError, RenderError, SimulationError
from sssfit.fit import fit_svd
from sssfit.formats.pictures import save_image
from sssfit.methods import SIMULATIONS
from sssfit.render.separable import render_separable
from sssfit.simulate import simulate_burley, simulate_dipole, simulate_montecarlo

HEAVY = {"numpy", "numba", "scipy", "colour", "matplotlib", "rich", "OpenImageIO", "click"}
# Each is a fresh start of the package: the calls have to work after any of them.
ORDERS = [
    "import sssfit",
    "import sssfit.fit, sssfit.render, sssfit.simulate",
    "import sssfit.simulate.montecarlo, sssfit.render.reference, sssfit.fit.svd, sssfit",
    "from sssfit import fit, simulate, render; import sssfit",
    "from sssfit.fit import fit_svd; from sssfit.simulate import simulate_exact; import sssfit",
    "import sssfit.fit as fit; import sssfit.render as render; import sssfit",
    "import sssfit; sssfit.Profile, sssfit.fit; import sssfit.fit, sssfit.simulate.dipole",
    "import sssfit.compare, sssfit.choose.choice, sssfit.chart.kernel",
    "import sssfit, importlib; importlib.reload(sssfit); importlib.reload(sssfit.fit)",
]


@pytest.fixture(scope="module")
def profile():
    return sssfit.simulate("skin1", "burley")


@pytest.fixture(scope="module")
def kernel(profile):
    return sssfit.fit(profile, "svd", rank=2, mm_per_pixel=1.0)


def test_three_calls_are_the_rooms_own_functions(profile, kernel):
    skin = sssfit.load_material("skin1")
    assert profile.sha256 == simulate_burley(skin).sha256
    one = fit_svd(profile, rank=2, mm_per_pixel=1.0).kernel
    assert kernel.to_dict() == one.to_dict()
    light = np.random.default_rng(3).uniform(size=(24, 31, 3))
    picture = sssfit.render(light, kernel, border="clamp")
    scene = sssfit.Scene("light", light, 1.0)
    assert np.array_equal(picture, render_separable(scene, kernel, border="clamp"))


def test_a_material_is_a_name_a_path_or_a_record(profile, tmp_path):
    skin = sssfit.load_material("skin1")
    path = tmp_path / "mine.toml"
    path.write_text(skin.to_toml(), encoding="utf-8")
    for material in (skin, path, str(path)):
        assert sssfit.simulate(material, "burley").sha256 == profile.sha256


def test_the_walk_is_the_default_method():
    skin = sssfit.load_material("skin1")
    walked = sssfit.simulate(skin, photons=5000, seed=7)
    assert walked.meta["method"] == "montecarlo"
    assert walked.sha256 == simulate_montecarlo(skin, photons=5000, seed=7).sha256


@pytest.mark.parametrize("method", [name for name in SIMULATIONS if name != "gaussians"])
def test_every_method_of_the_registry_is_a_name_to_simulate_by(method):
    few = {"photons": 5000} if method == "montecarlo" else {}
    found = sssfit.simulate("skin1", method, dr_mm=0.2, radius_mm=4.0, **few)
    assert (found.meta["method"], found.n_annuli) == (method, 20)


def test_skin_of_six_gaussians_has_its_own_method():
    assert sssfit.simulate("deon-skin").meta["method"] == "gaussians"
    with pytest.raises(SimulationError, match="deon-skin has no coefficients"):
        sssfit.simulate("deon-skin", "exact")
    with pytest.raises(SimulationError, match="makes deon-skin only, and this is 'skin1'"):
        sssfit.simulate("skin1", "gaussians")


def test_a_profile_and_a_kernel_are_records_or_paths(profile, kernel, tmp_path):
    profile.save(tmp_path / "p.npz")
    kernel.save(tmp_path / "k.json")
    light = np.ones((5, 4, 3))
    for source in (tmp_path / "p.npz", str(tmp_path / "p.npz")):
        again = sssfit.fit(source, "svd", rank=2, mm_per_pixel=1.0)
        assert np.array_equal(again.weights, kernel.weights)
    for source in (tmp_path / "k.json", str(tmp_path / "k.json")):
        assert np.array_equal(sssfit.render(light, source), sssfit.render(light, kernel))
    assert sssfit.Profile.load(tmp_path / "p.npz").sha256 == profile.sha256
    assert sssfit.SeparableKernel.load(tmp_path / "k.json").to_dict() == kernel.to_dict()


def test_a_grey_picture_comes_back_in_the_materials_colours(kernel):
    grey = np.random.default_rng(4).uniform(size=(9, 12))
    expected = sssfit.render(np.repeat(grey[:, :, None], 3, axis=2), kernel)
    for image in (grey, grey[:, :, None], grey.tolist()):
        assert np.array_equal(sssfit.render(image, kernel), expected)
    mono = sssfit.fit(_mono(), "svd", rank=1, mm_per_pixel=1.0)
    assert sssfit.render(grey, mono).shape == (9, 12, 1)


def test_a_picture_file_takes_its_own_pixels_or_the_kernels(kernel, tmp_path):
    light = np.random.default_rng(5).uniform(size=(8, 6, 3)).astype(np.float32)
    save_image(tmp_path / "bare.exr", light)
    save_image(tmp_path / "sized.exr", light, mm_per_pixel=0.5)
    expected = sssfit.render(light, kernel)
    assert np.array_equal(sssfit.render(tmp_path / "bare.exr", kernel), expected)
    assert np.array_equal(sssfit.render(sssfit.load_image(tmp_path / "bare.exr"), kernel), expected)
    with pytest.raises(RenderError, match="mm per pixel"):
        sssfit.render(str(tmp_path / "sized.exr"), kernel)


@pytest.mark.parametrize(
    ("asked", "error", "words"),
    [
        (("simulate", "skin1", "exakt"), SimulationError, "expected one of montecarlo, exact"),
        (("simulate", "skin9"), MaterialError, "did you mean skin2"),
        (("simulate", 3), SimulationError, "not a Material"),
        (("fit", "PROFILE", "svdd"), FitError, "expected one of cascade, disk, svd"),
        (("fit", "PROFILE", ["svd"]), FitError, "expected one of cascade, disk, svd"),
        (("fit", "KERNEL"), FitError, "expected a Profile"),
        (("render", np.ones((4, 4)), "PROFILE"), RenderError, "expected a SeparableKernel"),
        (("render", np.ones(4), "KERNEL"), RenderError, "rows, columns"),
        (("render", np.ones((4, 4, 2)), "KERNEL"), RenderError, "2 channels"),
        (("render", -np.ones((4, 4)), "KERNEL"), RenderError, "negative"),
    ],
    ids=repr,
)
def test_what_is_not_a_name_or_a_record_is_refused_in_one_line(
    asked, error, words, profile, kernel
):
    records = {"PROFILE": profile, "KERNEL": kernel}
    room, *given = asked
    given = [records.get(each, each) if isinstance(each, str) else each for each in given]
    with pytest.raises(error, match=words) as caught:
        getattr(sssfit, room)(*given)
    assert "\n" not in str(caught.value)


def test_calls_work_in_every_order_of_imports():
    program = f"""
import sys, types
import numba, scipy.linalg, scipy.optimize, matplotlib.figure
for order in {ORDERS!r}:
    for name in [each for each in sys.modules if each.partition(".")[0] == "sssfit"]:
        del sys.modules[name]
    scope = {{}}
    exec(order, scope)
    sssfit = scope["sssfit"]
    for name in ("fit", "render", "simulate"):
        room = getattr(sssfit, name)
        assert room is sys.modules["sssfit." + name], (order, name)
        assert isinstance(room, types.ModuleType) and callable(room), (order, name)
        assert scope.get(name, room) is room, (order, name)
    profile = sssfit.simulate("skin1", "dipole")
    kernel = sssfit.fit(profile, "svd", rank=1, mm_per_pixel=2.0)
    picture = sssfit.render([[1.0, 1.0], [1.0, 1.0]], kernel)
    assert isinstance(profile, sssfit.Profile) and isinstance(kernel, sssfit.SeparableKernel)
    assert abs(picture - profile.diffuse_reflectance).max() < 1e-6, order
    assert sssfit.fit.fit_svd and sssfit.simulate.simulate_exact, order
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)


def test_callable_rooms_say_what_they_take():
    for room, names in (
        (sssfit.simulate, ["material", "method", "settings"]),
        (sssfit.fit, ["profile", "method", "settings"]),
        (sssfit.render, ["image", "kernel", "settings"]),
    ):
        assert list(inspect.signature(room).parameters) == names
        inner = getattr(room, room.__name__.rpartition(".")[2])
        assert inspect.signature(room) == inspect.signature(inner)
        assert room.__call__.__doc__ == inner.__doc__


def test_top_level_names_are_those_of_the_rooms_and_misspelt_ones_are_refused():
    assert set(sssfit.__all__) <= set(dir(sssfit))
    for name in sssfit.__all__:
        assert callable(getattr(sssfit, name)), name
    assert sssfit.load_material("skin1").name == "skin1"
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        sssfit.simulat  # noqa: B018


def test_importing_sssfit_loads_none_of_its_rooms_and_nothing_heavy():
    program = f"""
import sys, sssfit
rooms = [name for name in sys.modules if name.startswith("sssfit.")]
heavy = {HEAVY!r} & {{name.partition(".")[0] for name in sys.modules}}
assert not rooms and not heavy, (rooms, heavy)
sssfit.SssfitError
assert not {HEAVY!r} & {{name.partition(".")[0] for name in sys.modules}}
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_a_chart_of_a_profile_loads_no_optimiser_and_no_compiler():
    program = """
import sys, sssfit.compare.drawing, sssfit.export, sssfit.fit
heavy = {"numba", "nlopt", "scipy"} & {name.partition(".")[0] for name in sys.modules}
assert not heavy, heavy
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_names_of_comparisons_are_loaded_and_misspelt_ones_are_refused():
    for name in sssfit.compare.__all__:
        assert getattr(sssfit.compare, name).__name__ == name
    with pytest.raises(AttributeError, match=r"'sssfit.compare' has no attribute 'mesure'"):
        sssfit.compare.mesure  # noqa: B018


def test_import_and_help_answer_at_once():
    # Of the processor, Python's own start not counted for the import; the least of five.
    assert min(_seconds("import sssfit", "- begun") for _ in range(5)) < 0.1
    helped = "import sssfit.cli\ntry: sssfit.cli.main(['--help'])\nexcept SystemExit: pass"
    assert min(_seconds(helped, "") for _ in range(5)) < 0.35


def _seconds(program: str, less: str) -> float:
    """Processor time of a new interpreter at the end of the program [s]."""
    timed = (
        f"import sys, time\nbegun = time.process_time()\n{program}\n"
        f"print(time.process_time() {less}, file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", timed], capture_output=True, text=True, check=True)
    return float(run.stderr)


def _mono():
    """A profile of one channel."""
    skin = sssfit.load_material("skin1").layers[0]
    layer = sssfit.Layer(1.3, 0.0, skin.sigma_a_per_mm[:1], skin.sigma_s_per_mm[:1])
    return simulate_dipole(sssfit.Material("mono", ("Y",), (layer,)))
