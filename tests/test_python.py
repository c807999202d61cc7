"""The toolkit in a notebook: three calls, names or records, loaded when they are asked for."""

import functools
import inspect
import subprocess
import sys

import numpy as np
import pytest

import sssfit
import sssfit.compare
from sssfit.choose.truth import truth_of
from sssfit.compare.evaluate import evaluate
from sssfit.compare.references import references
from sssfit.errors import FitError, MaterialError, RenderError, SimulationError, SssfitError
from sssfit.fit import fit_svd
from sssfit.formats.pictures import save_image
from sssfit.material import Layer
from sssfit.measure.score import measure
from sssfit.methods import SIMULATIONS
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
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


@pytest.mark.parametrize("names", [("950nm", "1050nm"), ("B", "G", "R"), ("R", "G", "B")])
def test_a_files_channels_are_the_kernels_of_the_same_names(names, tmp_path):
    """An EXR holds them by the alphabet: what is drawn into one channel stays in it."""
    count = len(names)
    medium = sssfit.Material(
        "mine", names, (Layer(1.4, 0.0, np.geomspace(0.05, 0.5, count), np.ones(count)),)
    )
    profile = sssfit.simulate(medium, "burley")
    light = np.random.default_rng(6).uniform(size=(12, 10, count)).astype(np.float32)
    path = tmp_path / "light.exr"
    save_image(path, light, channels=names)
    for method, settings in (("svd", {"rank": 2}), ("disk", {})):
        kernel = sssfit.fit(profile, method, mm_per_pixel=1.0, **settings)
        seen = sssfit.render(path, kernel)
        assert np.array_equal(seen, sssfit.render(light, kernel))
        scene = sssfit.Scene.from_image(sssfit.load_image(path), 1.0)
        found = evaluate(scene, kernel, profile, is_timed=False)
        assert np.array_equal(found.picture, seen)
        as_array = sssfit.Scene("light", light, 1.0)
        truth = render_reference(as_array, profile)
        assert np.array_equal(found.truth, truth)
        assert np.array_equal(references([scene], profile)[0].truth, truth)


def test_fits_and_screens_see_a_files_channels_by_their_names():
    medium = sssfit.Material(
        "mine", ("950nm", "1050nm"), (Layer(1.4, 0.0, [0.05, 0.5], [1.0, 1.0]),)
    )
    profile = sssfit.simulate(medium, "burley")
    random = np.random.default_rng(8)
    light = np.cumsum(random.uniform(size=(64, 64, 2)), axis=1) * [1.0, 0.1] + random.uniform(
        size=(64, 64, 2)
    )
    more = {"distance_mm": 600.0, "depth_mm": np.full((64, 64), 600.0)}
    ours = sssfit.Scene("light", light, 1.0, specular=light, **more)
    theirs = sssfit.Scene(
        "light",
        light[..., ::-1],
        1.0,
        specular=light[..., ::-1],
        channel_names=("1050nm", "950nm"),
        **more,
    )
    weighted = [
        sssfit.fit(profile, "weighted", rank=1, mm_per_pixel=1.0, irradiance=each)
        for each in (ours, theirs)
    ]
    assert np.array_equal(weighted[0].weights, weighted[1].weights)
    seen = [render_screen(each, weighted[0]) for each in (ours, theirs)]
    assert np.array_equal(*seen)
    disk = sssfit.fit(profile, "svd", taps=5, rank=1, mm_per_pixel=1.0)
    assert np.array_equal(*[render_screen_taps(each, disk) for each in (ours, theirs)])


@pytest.mark.parametrize("names", [("R", "G"), ("R", "R", "G"), ("R", "G", "B", "A")])
def test_channels_have_one_name_each(names):
    with pytest.raises(RenderError, match="for 3 channels; give each one name"):
        sssfit.Scene("light", np.ones((2, 2, 3)), 1.0, channel_names=names)


def test_a_files_channels_of_other_names_are_taken_by_their_place(tmp_path):
    light = np.random.default_rng(7).uniform(size=(8, 6, 3)).astype(np.float32)
    save_image(tmp_path / "light.exr", light)
    medium = sssfit.Material(
        "mine", ("650nm", "550nm", "450nm"), (Layer(1.4, 0.0, [0.05, 0.2, 0.5], np.ones(3)),)
    )
    kernel = sssfit.fit(sssfit.simulate(medium, "burley"), "svd", rank=1, mm_per_pixel=1.0)
    seen = sssfit.render(tmp_path / "light.exr", kernel)
    assert np.array_equal(seen, sssfit.render(light, kernel))


def test_numbers_of_numpy_are_numbers(profile):
    found = sssfit.fit(profile, "disk", taps=np.int64(9), mm_per_pixel=np.float32(1.0))
    assert found.to_dict() == sssfit.fit(profile, "disk", taps=9, mm_per_pixel=1.0).to_dict()
    exact = sssfit.simulate("skin1", "exact", tolerance=np.float32(0.125), angles=np.int64(3))
    assert exact.meta["settings"]["angles"] == 3
    assert exact.meta["settings"]["tolerance"] == 0.125
    guided = sssfit.fit(profile, "guided", k=np.float32(0.5), mm_per_pixel=1.0)
    assert guided.meta["settings"]["k"] == 0.5
    size = {"height": np.int64(8), "width": np.int64(9), "mm_per_pixel": np.float32(1.0)}
    assert make_scene("noise", seed=np.int64(3), **size).irradiance.shape == (8, 9, 1)


@pytest.mark.parametrize("name", ["noise", "points", "highlights", "disk"])
@pytest.mark.parametrize("wrong", [{"height": 16.0}, {"height": True}, {"width": "9"}])
def test_sizes_are_whole_numbers(name, wrong):
    with pytest.raises(RenderError, match="expected a whole number, 1 or more"):
        make_scene(name, **({"height": 8, "width": 8, "mm_per_pixel": 1.0} | wrong))


@pytest.mark.parametrize(
    ("room", "given", "words"),
    [
        (
            "simulate",
            ("skin1", "exact", {"photons": 10}),
            "exact has no setting photons",
        ),
        (
            "fit",
            ("PROFILE", "svd", {"fetches": 24}),
            "svd has no setting fetches; expected",
        ),
        ("fit", ("PROFILE", "svd", {"ranks": 2}), "did you mean rank"),
        ("fit", ("PROFILE", "cascade", {"taps": 9}), "the fit cascade has no setting taps"),
        ("render", (np.ones((4, 4, 3)), "KERNEL", {"frame": 1}), "kernel has no setting frame"),
        ("fit", ("PROFILE", "svd", {"mm_per_pixel": [1, 2]}), "expected a length in mm, or"),
        ("fit", ("PROFILE", "svd", {"support_mm": "wide"}), "expected a length in mm"),
        ("fit", ("PROFILE", "cascade", {"fetches": "12"}), "fetches = '12'; expected a number"),
        ("fit", ("PROFILE", "cascade", {"passes": "4"}), "passes = '4'; expected a whole number"),
        ("fit", ("PROFILE", "guided", {"centre_bound": "5%"}), "= '5%'; expected a number"),
        ("fit", ("PROFILE", "falloff", {"width": True}), "width = True; expected a number"),
        ("fit", ("PROFILE", "svd", {"rank": True}), "rank = True; expected a whole number"),
        ("fit", ("PROFILE", "svd", {"normalize": "no"}), "= 'no'; expected True or False"),
        ("fit", ("PROFILE", "artist", {"near_mm2": "a"}), "'a'; expected a number, or one per"),
        ("simulate", ("skin1", "exact", {"tolerance": "1%"}), "'1%'; expected a number"),
        ("simulate", ("skin1", "montecarlo", {"target_error": "1%"}), "expected a number"),
        (
            "simulate",
            ("skin1", "burley", {"mapping": ["diffuse"]}),
            "expected one of perpendicular,",
        ),
        ("simulate", ("skin1", "exact", {"similarity": "no"}), "'no'; expected True or False"),
        ("simulate", ("skin1", "exact", {"tolerance": np.array([0.1, 0.2])}), "expected a number"),
    ],
)
def test_settings_of_other_methods_are_refused_in_one_line(room, given, words, profile, kernel):
    records = {"PROFILE": profile, "KERNEL": kernel}
    *first, settings = given
    first = [records.get(each, each) if isinstance(each, str) else each for each in first]
    with pytest.raises(SssfitError, match=words) as caught:
        getattr(sssfit, room)(*first, **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("function", "given", "words"),
    [
        (fit_svd, ["a.profile.npz"], "expected a Profile"),
        (render_reference, [np.ones((4, 4, 3)), "PROFILE"], "expected a Scene"),
        (measure, ["a.png", "a.png"], "not an array of real numbers"),
        (functools.partial(truth_of, seed=1, threads=1), ["skin1"], "not a Material"),
    ],
    ids=["fit", "reference", "measure", "choose"],
)
def test_what_is_no_record_is_refused_in_one_line(function, given, words, profile):
    given = [profile if isinstance(each, str) and each == "PROFILE" else each for each in given]
    with pytest.raises(SssfitError, match=words):
        function(*given)


def test_masked_arrays_are_refused(kernel):
    light = np.ma.masked_greater(np.full((4, 4, 3), [0.1, 0.2, 0.3]), 0.25)
    with pytest.raises(RenderError, match="masked array; fill it first"):
        sssfit.render(light, kernel)
    filled = sssfit.render(light.filled(0.0), kernel)
    assert np.array_equal(sssfit.render(np.ma.masked_array(light.filled(0.0)), kernel), filled)


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
