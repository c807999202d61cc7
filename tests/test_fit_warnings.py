"""Profiles that no fit likes: either a kernel that is near, or a word about it. Bad input."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from checks import medium
from reference_pixels import make_profile

from sssfit.cli import main
from sssfit.errors import FitError, SssfitError, SssfitWarning
from sssfit.fit import METHODS, fit_svd, make_target
from sssfit.fit import _result as fit_result
from sssfit.fit._result import ChannelFit, energy_factor, fit_channels
from sssfit.formats.csv import parse_csv
from sssfit.kernel import SeparableKernel
from sssfit.simulate import simulate_dipole, simulate_montecarlo

EDGES = np.linspace(0.0, 5.0, 51)
SMOOTH = -np.diff(np.exp(-(EDGES**2) / 2.0))


def ring():
    """All light at 4 mm."""
    return make_profile(EDGES, np.where(np.arange(50) == 40, 0.5, 0.0)[:, None])


def spike_and_tail():
    energy = np.where(np.arange(50) == 0, 0.5, 0.0)
    energy[30:] = 1e-6 / 20
    return make_profile(EDGES, energy[:, None])


def many_channels(count=64):
    """Alike but for one, which returns nothing."""
    energy = 0.5 * SMOOTH[:, None] * np.ones(count)
    energy[:, 13] = 0.0
    return make_profile(EDGES, energy)


def noise():
    with pytest.warns(SssfitWarning, match="too few"):
        return simulate_montecarlo(
            medium([0.1, 0.5], [0.9, 0.5], 1.3), photons=100, seed=1, dr_mm=0.5, radius_mm=20.0
        )


PROFILES = {
    "one annulus": lambda: make_profile([0.0, 1.0], [[0.3]]),
    "two annuli": lambda: make_profile([0.0, 1.0, 2.0], [[0.3], [0.1]]),
    "three annuli": lambda: make_profile([0.0, 1.0, 2.0, 4.0], [[0.3], [0.1], [0.05]]),
    "ring": ring,
    "spike and tail": spike_and_tail,
    "a spike": lambda: make_profile(EDGES, np.eye(50)[:, :1]),
    "flat": lambda: make_profile(EDGES, np.diff(EDGES**2)[:, None] / 50.0),
    "16 channels": lambda: many_channels(16),
    "white": lambda: simulate_dipole(medium(1e-4, 0.9999, 1.3), dr_mm=0.5, radius_mm=60.0),
    "noise": noise,
    "faint": lambda: make_profile(EDGES, 1e-140 * SMOOTH[:, None]),
}
# (mm per pixel, support): the profile's own, wide pixels, a support that cuts, a single pixel.
PIXELS = [("profile", None), (0.9, None), (0.2, 1.5), (300.0, None)]
OWN = {"svd": {"rank": 1}, "gaussians": {"terms": 2}}


@pytest.mark.parametrize("kind", PROFILES)
@pytest.mark.parametrize("method", METHODS)
def test_a_kernel_is_near_or_warned_about_or_refused(method, kind):
    profile = PROFILES[kind]()
    for pitch, support in PIXELS[:1] if kind == "16 channels" else PIXELS:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                result = METHODS[method].fit(
                    profile, mm_per_pixel=pitch, support_mm=support, **OWN.get(method, {})
                )
            except SssfitError:
                continue  # what it says is tested below
        assert all(issubclass(each.category, SssfitWarning) for each in caught)
        errors, energies = result.relative_frobenius_error, result.energy_error
        assert np.isfinite(errors).all()
        assert np.isfinite(energies).all()
        said = " ".join(str(each.message) for each in caught)
        assert (errors <= 1.0).all() or "than no kernel at all" in said
        assert (np.abs(energies) <= 0.1).all() or "does not preserve the profile's energy" in said
        assert result.kernel.pixels > 1 or "is a single pixel" in said


def fit_a_dim_spike(profile):
    """A method that is off in shape and in energy, as none of ours is by itself."""
    target = make_target(profile, "profile")

    def fit_channel(channel):
        half = np.zeros((2, target.half_pixels + 1))
        half[:, 0] = np.sqrt([0.9, 0.5])
        return ChannelFit(np.array([1.0, -1.0]), half, "made up")

    return fit_channels(target, "burley", fit_channel, settings={})


@pytest.mark.parametrize(
    ("signs", "half", "said"),
    [
        (
            np.ones(1),
            np.ones(5),
            r"signs of shape \(1,\) \(float64\) and half passes of shape \(5,\)",
        ),
        (
            np.ones(2),
            np.ones((1, 5)),
            r"shape \(1, 5\) \(float64\); expected real numbers of shapes",
        ),
        (np.ones(1), np.ones((1, 4)), r"expected real numbers of shapes \(T,\) and \(T, 5\) for T"),
        (np.ones(1), np.ones((1, 5), complex), r"half passes of shape \(1, 5\) \(complex128\)"),
        (
            np.ones((1, 1)),
            np.ones((1, 5)),
            r"channel c0: the own fit gives signs of shape \(1, 1\)",
        ),
        (np.ones(0), np.ones((0, 5)), r"signs of shape \(0,\)"),
    ],
)
def test_terms_of_other_shapes_and_numbers_are_told(signs, half, said):
    target = make_target(make_profile(EDGES, 0.5 * SMOOTH[:, None]), 0.5, 2.0)
    with pytest.raises(FitError, match=said):
        fit_channels(target, "own", lambda _: ChannelFit(signs, half, "made up"), settings={})


def test_what_the_warnings_say():
    with pytest.warns(SssfitWarning) as caught:
        fit_a_dim_spike(many_channels())
    said = str(caught[0].message)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert said.startswith("test: the burley kernel is farther from the profile than no kernel")
    assert "(c0 " in said
    assert "does not preserve the profile's energy (c0 -20" in said
    assert said.count("and 59 more)") == 2
    assert said.endswith("try a larger support, more terms or another method.")


def test_an_energy_that_was_not_asked_for_is_not_warned_about():
    # loses half of it; warnings are errors here
    fit_svd(ring(), rank=1, energy="keep", mm_per_pixel="profile")
    hand = {"width": 0.5, "strength": 0.1, "falloff": 1.0}
    METHODS["falloff"].fit(ring(), mm_per_pixel="profile", **hand)


def test_terms_that_cancel_cannot_be_scaled():
    target = make_target(make_profile(EDGES, 0.5 * SMOOTH[:, None]), 0.5, 2.0)
    half = np.stack((np.full(5, 0.1), np.full(5, 0.2)))
    copies = np.array([1.0, 2.0, 2.0, 2.0, 2.0])
    energies = (half @ copies) ** 2
    apart = energies[1] - energies[0]
    assert energy_factor(0.5, target, 0, np.array([-1.0, 1.0]), half) == pytest.approx(0.5 / apart)
    with pytest.raises(FitError, match=r"channel c0: the terms have the energy -2.43 within the"):
        energy_factor(0.5, target, 0, np.array([1.0, -1.0]), half)
    with pytest.raises(
        FitError, match=r"which cannot be scaled to -0.1; use `energy = \"keep\"`, an"
    ):
        energy_factor(-0.1, target, 0, np.array([-1.0, 1.0]), half)


def test_a_support_without_light_is_refused():
    for method in METHODS.values():
        with pytest.raises(
            FitError, match=r"channel c0: of its .* 0.5 the support of 1 mm holds 0"
        ):
            method.fit(ring(), support_mm=1.0, mm_per_pixel=0.1)
        with pytest.raises(FitError, match="use a larger support, or set the channel to 0"):
            method.fit(make_profile(EDGES, 1e-300 * SMOOTH[:, None]), mm_per_pixel="profile")


def test_errors_that_are_no_numbers_are_refused():
    fit_result.check_finite("test", "preintegrated", np.zeros(1), np.ones(1))
    with pytest.raises(FitError, match="test: the errors of the preintegrated kernel are not fin"):
        fit_result.check_finite("test", "preintegrated", np.zeros(1), np.array([np.inf]))


def test_by_default_a_small_kernel_has_fewer_terms():
    with pytest.warns(SssfitWarning, match="a single pixel, which blurs nothing"):
        one = fit_svd(make_profile(EDGES, SMOOTH[:, None]), mm_per_pixel=20.0).kernel
    assert one.rank == one.pixels == 1
    np.testing.assert_allclose(one.weights**2, SMOOTH.sum(), rtol=1e-12)
    assert one.meta["settings"]["rank"] == 1
    assert fit_svd(make_profile(EDGES, SMOOTH[:, None]), mm_per_pixel="profile").kernel.rank == 3


def test_imported_profiles_go_by_their_file(tmp_path):
    table = "r_mm,red\n0.5,0.1\n1,0.05\n1.5,0.02\n2,0.01\n"
    profile = parse_csv(table, "folder/a.csv", quantity="energy")
    for name, method in METHODS.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            kernel = method.fit(profile, mm_per_pixel="profile", **OWN.get(name, {})).kernel
        assert kernel.meta["material"] == "a.csv"


# Bad input, by command line


@pytest.fixture
def run(tmp_path, monkeypatch, capfd):
    """Run ``sssfit fit`` on a profile in an empty folder; give status, stderr and its files."""
    monkeypatch.chdir(tmp_path)

    def call(profile, *arguments):
        profile.save("wax.profile.npz")
        with pytest.raises(SystemExit) as ending:
            main(["fit", "wax.profile.npz", "--mm-per-pixel", "profile", *arguments])
        kernels = [path.name for path in tmp_path.glob("*.kernel.json")]
        return ending.value.code, capfd.readouterr().err, kernels

    return call


def energies(*values, channels=1):
    return make_profile(np.arange(len(values) + 1.0), np.array(values)[:, None] * np.ones(channels))


def negative():
    return energies(0.3, -0.01, 0.1)


def not_a_number():
    """A profile cannot hold NaN; one that does is made past its checks."""
    profile = energies(0.3, 0.2, 0.1)
    energy = np.array([[0.3], [np.nan], [0.1]])
    object.__setattr__(profile, "annulus_energy", energy)
    return profile


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("profile", "fragment"),
    [
        (energies(0.0, 0.0, 0.0), "no channel of the profile returns any energy: nothing to fit"),
        (negative(), "annulus 1 of channel c0 has the negative energy -0.01; expected energies"),
    ],
    ids=["zeros", "negative"],
)
def test_bad_energies_are_one_line(run, method, profile, fragment):
    status, err, kernels = run(profile, "--method", method)
    assert status == 1
    assert fragment in err
    assert err.startswith("Error: ")
    assert err.count("\n") == 1
    assert kernels == []


@pytest.mark.parametrize("method", METHODS)
def test_nan_is_one_line(run, method):
    with pytest.raises(FitError, match="holds NaN or infinite energies; compute it again"):
        METHODS[method].fit(not_a_number())


def test_too_much_light_is_a_warning(run):
    status, err, kernels = run(energies(1.5, 0.4, 0.1), "--method", "preintegrated")
    assert status == 0
    assert err == (
        "Warning: test: the profile returns 2 times the light that went in; check its unit.\n"
    )
    assert kernels == ["wax.preintegrated.kernel.json"]


@pytest.mark.parametrize("method", METHODS)
def test_a_pixel_wider_than_the_profile_is_the_identity_and_says_so(run, method):
    profile = make_profile(EDGES, 0.5 * SMOOTH[:, None])
    status, err, kernels = run(profile, "--method", method, "--mm-per-pixel", "100")
    assert status == 0
    assert err.startswith("Warning: a pixel of 100 mm is wider than the support of ")
    assert "the kernel is a single pixel, which blurs nothing" in err
    assert err.count("\n") == 1
    kernel = SeparableKernel.load(kernels[0])
    assert kernel.pixels == 1
    np.testing.assert_allclose(kernel.energy, profile.diffuse_reflectance, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_pixel_a_thousand_times_too_small_names_the_memory(run, method):
    profile = simulate_dipole(medium([0.1], [0.9], 1.3))  # a mean free path of 1 mm
    status, err, kernels = run(profile, "--method", method, "--mm-per-pixel", "0.001")
    assert status == 1
    assert "pixels of 0.001 mm would need 2.04 GB of memory a channel, and 2 GB is the most" in err
    assert err.count("\n") == 1
    assert kernels == []


THREE = energies(0.3, 0.1, 0.05, 0.02, channels=3)
FALLOFF = ("--method", "falloff")


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("--method", "svd", "--rank", "99"), 1, "rank = 99; expected 1 to 5: the kernel has 9 x"),
        (("--method", "svd", "--rank", "0"), 2, "0 is not in the range"),
        (("--method", "guided", "--k", "4.01"), 1, "k = 4.01 is outside [0, 4]"),
        (("--method", "guided", "--k", "-1"), 1, "k = -1 is outside [0, 4]"),
        (("--method", "guided", "--k", "nan"), 2, "'nan' is not"),
        (("--method", "guided", "--b", "0"), 1, "b = 0; expected a number above 0"),
        (("--method", "guided", "--centre-bound", "2"), 2, "'2' is not a share from 0 to 100 %"),
        (("--method", "svd", "--mm-per-pixel", "0"), 2, "'0' is not a length above 0"),
        (("--method", "svd", "--mm-per-pixel", "-1"), 2, "'-1' is not a length above 0"),
        (("--method", "svd", "--mm-per-pixel", "nan"), 2, "'nan' is not a length above 0"),
        (("--method", "svd", "--support", "0"), 2, "'0' is not a length above 0"),
        (("--method", "svd", "--support", "nan"), 2, "'nan' is not a length above 0"),
        (("--method", "gaussians", "--terms", "0"), 2, "0 is not in the range 1<=x<=10"),
        (("--method", "gaussians", "--terms", "11"), 2, "11 is not in the range 1<=x<=10"),
        (("--method", "gaussians"), 1, "4 annuli cannot fix the width and the weight"),
        (("--method", "artist", "--near", "1"), 1, "weight and far_mm2 missing: set weight,"),
        (("--method", "artist", "--near", "1", "--weight", "0.5"), 1, "far_mm2 missing: set"),
        ((*FALLOFF, "--width", "1"), 1, "strength and falloff missing: set width, strength, "),
        (
            (*FALLOFF, "--width", "1", "--strength", ".7,.8", "--falloff", ".5"),
            1,
            "strength = [0.7, 0.8]; expected one finite number, or one for each of c0, c1, c2",
        ),
        ((*FALLOFF, "--width", "0", "--strength", "1", "--falloff", "1"), 1, "width = 0.0; expect"),
        (("--method", "svd", "--k", "1"), 2, "--k is for --method guided, and this is svd"),
        (("--method", "nothing"), 2, "'nothing' is not one of 'cascade', 'disk', 'svd'"),
    ],
    ids=str,
)
def test_settings_out_of_range_are_one_line(run, arguments, status, fragment):
    code, err, kernels = run(THREE, *arguments)
    assert code == status
    assert fragment in err.splitlines()[-1]
    assert err.splitlines()[-1].startswith("Error: ")
    assert len(err.splitlines()) == (1 if status == 1 else 4)  # click adds how to get help
    assert kernels == []


def test_a_setting_of_0_is_not_the_default(run):
    kernels = run(energies(*SMOOTH[:8]), "--method", "guided", "--k", "0")[2]
    assert SeparableKernel.load(kernels[0]).meta["settings"]["k"] == 0.0


def test_a_ratio_that_is_whole_but_for_its_last_bits_keeps_its_pixel():
    profile = make_profile(EDGES, SMOOTH[:, None])
    assert 0.6 / 0.2 < 3.0
    assert make_target(profile, 0.2, 0.6).half_pixels == 3


def test_one_annulus_has_no_shape(tmp_path, monkeypatch, capfd):
    profile = make_profile([0.0, 1.0], [[0.5]])
    for method in METHODS.values():
        with pytest.raises(FitError, match="one annulus has no shape"):
            method.fit(profile)


def test_a_support_beyond_the_profile_is_refused_where_there_is_light_beyond():
    profile = make_profile(np.arange(21) * 0.2, np.full((20, 2), 0.02))
    lossy = replace(profile, beyond_grid=np.array([0.0, 1e-4]))
    with pytest.raises(FitError) as caught:
        fit_svd(lossy, support_mm=6.0)
    assert str(caught.value) == (
        f"{lossy.label}: the profile ends at 4 mm and the support at 6 mm, and channel "
        f"{lossy.channels[1]} has light beyond; use a smaller support, or simulate the profile to "
        "a larger radius."
    )
    fit_svd(lossy, support_mm=4.2)  # less than a pixel
    fit_svd(profile, support_mm=6.0)  # all of its light is on the grid: the rest is 0


def test_a_kernel_too_large_is_refused_with_its_true_size():
    with pytest.raises(FitError, match=r"200000000001 x .* 1\.6e\+14 GB"):
        make_target(make_profile(EDGES, SMOOTH[:, None]), 0.01, 1e9)
