"""A kernel beside its profile: figures against literal sums and integrals, the chart, the verb."""

import io
import json
import math

import numpy as np
import pytest
from figures import assert_legible, drawn_texts, legends_of, words_of
from matplotlib.patches import StepPatch
from reference_pixels import make_profile, one_over_r_centre_pixel, one_over_r_profile
from scipy.integrate import dblquad
from turns import mostly_slow

from sssfit.chart.kernel import _percent, kernel_figure
from sssfit.chart.page import save_figure
from sssfit.cli import main
from sssfit.compare import view_kernel
from sssfit.errors import KernelError
from sssfit.fit import fit_gaussians, fit_preintegrated, fit_svd
from sssfit.kernel import SeparableKernel
from sssfit.profile import full_kernel

LENGTHS_MM = (0.3, 0.5, 0.9)
PITCH_MM = 0.25


@pytest.fixture(scope="module")
def profile():
    """Three channels of R_d ~ exp(-r/L)/r."""
    return one_over_r_profile(400, 0.025, LENGTHS_MM)


@pytest.fixture(scope="module")
def kernel(profile):
    return fit_svd(profile, rank=3, mm_per_pixel=PITCH_MM, support_mm=5.0).kernel


@pytest.fixture(scope="module")
def view(kernel, profile):
    return view_kernel(kernel, profile)


@pytest.fixture(scope="module")
def figure(view):
    return kernel_figure(view)


@pytest.fixture(scope="module")
def figure_again(view):
    return kernel_figure(view)


def literal(kernel, c, i, j):
    """Energy of pixel (i, j) from the middle, term by term, times the scale."""
    h = kernel.half_pixels
    terms = zip(kernel.signs[:, c], kernel.weights[:, :, c], strict=True)
    return kernel.scale[c] * sum(sign * w[h + i] * w[h + j] for sign, w in terms)


def one_over_r_pixel(i, j, length_mm):
    """Energy of the pixel (i, j) of R_d = exp(-r/L) / (2 pi r), by quadrature."""
    low, high = ((each - 0.5) * PITCH_MM for each in (i, i + 1))
    below, above = ((each - 0.5) * PITCH_MM for each in (j, j + 1))

    def density(y, x):
        r = math.hypot(x, y)
        return math.exp(-r / length_mm) / (2.0 * math.pi * r)

    return dblquad(density, low, high, below, above, epsabs=0.0, epsrel=1e-9)[0]


@pytest.mark.parametrize("normalize", [False, True])
def test_images_and_slices_of_the_kernel_are_sums_of_its_terms(profile, normalize):
    kernel = fit_svd(profile, rank=2, mm_per_pixel=PITCH_MM, normalize=normalize).kernel
    view = view_kernel(kernel, profile)
    assert (view.block, view.channels) == (1, (0, 1, 2))
    area_mm2 = PITCH_MM**2
    for c in range(3):
        for i in range(0, 9, 2):
            assert view.axis[c, i] == pytest.approx(literal(kernel, c, i, 0) / area_mm2, rel=1e-9)
            assert view.diagonal[c, i] == pytest.approx(
                literal(kernel, c, i, i) / area_mm2, rel=1e-9
            )
            assert view.image[c, i, 3] == pytest.approx(
                literal(kernel, c, i, 3) / area_mm2, rel=1e-9
            )
        assert view.energy[c] == pytest.approx(kernel.scale[c] * kernel.full(c).sum(), rel=1e-12)


def test_the_true_plane_is_the_integral_of_the_profile(view):
    for c, length_mm in enumerate(LENGTHS_MM):
        middle = one_over_r_centre_pixel(PITCH_MM, length_mm) / PITCH_MM**2
        assert view.true_axis[c, 0] == view.true_diagonal[c, 0] == view.true_image[c, 0, 0]
        assert view.true_axis[c, 0] == pytest.approx(middle, rel=2e-3)
        for i, j, found in (
            (3, 0, view.true_axis[c, 3]),
            (2, 2, view.true_diagonal[c, 2]),
            (5, 2, view.true_image[c, 5, 2]),
        ):
            expected = one_over_r_pixel(i, j, length_mm) / PITCH_MM**2
            assert found == pytest.approx(expected, rel=2e-3), (i, j)


def test_errors_are_those_of_whole_planes(view, kernel, profile):
    for c in range(3):
        true = full_kernel(profile.quadrant_kernel(PITCH_MM, kernel.half_pixels, channel=c))
        apart = kernel.full(c) - true
        total = profile.diffuse_reflectance[c]
        np.testing.assert_allclose(full_kernel(view.difference[c]), apart / total, atol=1e-15)
        assert view.misplaced[c] == pytest.approx(0.5 * np.abs(apart).sum() / total, rel=1e-10)
        frobenius = np.linalg.norm(apart) / np.linalg.norm(true)
        assert view.relative_frobenius_error[c] == pytest.approx(frobenius, rel=1e-10)
        assert view.energy_error[c] == pytest.approx(kernel.full(c).sum() / total - 1, abs=1e-12)
    # The fit took the same norm of the same pixels.
    np.testing.assert_allclose(
        view.relative_frobenius_error, kernel.relative_frobenius_error, rtol=1e-9
    )


def test_large_kernels_are_averaged_over_blocks_around_the_middle(
    view, kernel, profile, monkeypatch
):
    monkeypatch.setattr("sssfit.compare.kernel_view._MOST_PIXELS", 14)  # of 41: blocks of 3
    coarse = view_kernel(kernel, profile)
    assert coarse.block == 3
    pairs = (coarse.image, view.image), (coarse.true_image, view.true_image)
    for means, pixels in (*pairs, (coarse.difference, view.difference)):
        assert means.shape == (3, 7, 7)
        plane = full_kernel(pixels[1])
        for i, k in ((0, 0), (0, 2), (6, 6), (3, 1)):
            block = plane[19 + 3 * i : 22 + 3 * i, 19 + 3 * k : 22 + 3 * k]
            assert means[1, i, k] == pytest.approx(block.mean(), rel=1e-12)
    np.testing.assert_array_equal(coarse.axis, view.axis)
    np.testing.assert_array_equal(coarse.misplaced, view.misplaced)


def test_without_a_profile_the_errors_are_the_recorded_ones(kernel):
    alone = view_kernel(kernel)
    assert alone.true_image is alone.true_axis is alone.difference is alone.misplaced is None
    np.testing.assert_array_equal(alone.energy_error, kernel.energy_error)
    np.testing.assert_array_equal(alone.relative_frobenius_error, kernel.relative_frobenius_error)


def test_channels_are_chosen_by_name_or_spread():
    profile = one_over_r_profile(60, 0.1, np.linspace(0.4, 1.0, 9))
    kernel = fit_svd(profile, rank=1, mm_per_pixel="profile").kernel
    assert view_kernel(kernel, profile).channels == (0, 4, 8)
    assert view_kernel(kernel, profile, channels=["c3"]).channels == (3,)
    with pytest.raises(KernelError, match="there is no channel X; expected one of c0, c1"):
        view_kernel(kernel, profile, channels=["X"])
    with pytest.raises(KernelError, match="the profile c0; give the profile that the kernel"):
        view_kernel(kernel, one_over_r_profile(60, 0.1, [0.4]))


def test_a_channel_without_light_has_no_errors():
    energy = np.outer(np.full(20, 0.02), [1.0, 0.0])
    profile = make_profile(np.arange(21) * 0.1, energy)
    kernel = fit_svd(profile, rank=1, mm_per_pixel="profile").kernel
    view = view_kernel(kernel, profile)
    assert view.misplaced[1] == view.relative_frobenius_error[1] == view.energy_error[1] == 0.0
    assert_legible(lambda: kernel_figure(view))


def panels(figure, title):
    """The axes whose titles begin so."""
    return [each for each in figure.axes if each.get_title(loc="left").startswith(title)]


def steps(axes):
    return [each for each in axes.patches if isinstance(each, StepPatch)]


def test_passes_are_drawn_from_the_middle_outwards(figure, kernel):
    drawn = panels(figure, "passes")
    assert [each.get_title(loc="left") for each in drawn] == [f"passes, c{c}" for c in range(3)]
    h = kernel.half_pixels
    edges = (np.arange(h + 2) - 0.5) * PITCH_MM
    for c, axes in enumerate(drawn):
        assert axes.get_xlabel() == "distance from the middle (mm)"
        for t, each in enumerate(steps(axes)):
            data = each.get_data()
            np.testing.assert_array_equal(data.values, kernel.weights[t, h:, c] / PITCH_MM)
            np.testing.assert_allclose(data.edges[1:], edges[1:], rtol=1e-12)
            low, high = sorted(axes.get_ylim())
            assert low < data.values.min()
            assert data.values.max() < high
        dashes = {str(each.get_linestyle()) for each in steps(axes)}
        assert len(dashes) == len(steps(axes)) == kernel.rank
    assert drawn[0].get_ylabel() == "weight (1/mm)"


def test_slices_are_drawn_beside_the_true_ones(figure, view):
    for c, axes in enumerate(panels(figure, "slices")):
        true_axis, axis, _, true_diagonal, diagonal, _ = (s.get_data() for s in steps(axes))
        for found, expected in (
            (true_axis, view.true_axis),
            (axis, view.axis),
            (true_diagonal, view.true_diagonal),
            (diagonal, view.diagonal),
        ):
            wanted = np.where(expected[c] > 0.0, expected[c], np.nan)
            np.testing.assert_array_equal(found.values, wanted)
        np.testing.assert_allclose(diagonal.edges[1:], math.sqrt(2.0) * axis.edges[1:], rtol=1e-12)
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        assert axes.get_ylabel() == "per mm²"
    legend = panels(figure, "slices")[0].get_legend()
    assert [each.get_text() for each in legend.get_texts()] == [
        "axis",
        "diagonal",
        "profile (wide)",
    ]


def test_planes_stand_beside_each_other_on_one_scale(figure, view):
    half_mm = 20.5 * PITCH_MM
    for title, expected in (("profile", view.true_image), ("kernel", view.image)):
        for c, axes in enumerate(panels(figure, title)):
            (image,) = axes.images
            seen = full_kernel(expected[c])
            is_on_scale = seen > image.norm.vmin
            assert is_on_scale.sum() > 100
            np.testing.assert_array_equal(image.get_array()[is_on_scale], seen[is_on_scale])
            np.testing.assert_allclose(image.get_extent(), [-half_mm, half_mm] * 2)
            most = max(view.image.max(), view.true_image.max())
            assert (image.norm.vmin, image.norm.vmax) == pytest.approx((most * 1e-5, most))
    for c, axes in enumerate(panels(figure, "difference")):
        np.testing.assert_array_equal(axes.images[0].get_array(), full_kernel(view.difference[c]))


def test_what_is_below_zero_is_grey_and_dotted(kernel):
    negative = SeparableKernel(
        **{name: getattr(kernel, name) for name in kernel.__slots__}
        | {"signs": -kernel.signs, "scale": np.ones(3)}
    )
    drawn = kernel_figure(view_kernel(negative, channels=["c1"]))
    (image,) = panels(drawn, "kernel")[0].images
    assert image.norm(image.get_array()).mask.all()
    positive, below = steps(panels(drawn, "slices")[0])[:2]
    assert np.isnan(positive.get_data().values).all()
    assert (below.get_data().values > 0.0).any()
    texts = words_of(drawn)
    assert "Where the kernel is below 0, images are grey" in texts
    labels = [each.get_text() for each in legends_of(drawn)[1].get_texts()]
    assert labels == ["term 1 (−)", "term 2 (−)", "term 3 (−)"]  # noqa: RUF001


def test_signs_that_differ_between_channels_are_told(kernel):
    signs = kernel.signs.copy()
    signs[1, 2] = -1.0
    changed = SeparableKernel(
        **{name: getattr(kernel, name) for name in kernel.__slots__} | {"signs": signs}
    )
    _, terms = legends_of(kernel_figure(view_kernel(changed)))
    labels = [each.get_text() for each in terms.get_texts()]
    assert labels[1] == "term 2 (c0 +, c1 +, c2 −)"  # noqa: RUF001


def test_the_table_has_the_figures(figure, view):
    assert words_of(figure).startswith("test: svd kernel, 3 terms 41 x 41 pixels of 0.25 mm")
    texts = [text for text, _ in drawn_texts(figure)]
    for c in range(3):
        assert f"{view.energy[c]:.5f}" in texts
        assert f"{100 * view.relative_frobenius_error[c]:.2g} %" in texts
        assert f"{100 * view.misplaced[c]:#.2g}".rstrip(".") + " %" in texts


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.01, "1.0 %"),
        (-0.053, "-5.3 %"),
        (0.207, "21 %"),
        (0.996, "100 %"),
        (12.0, "1200 %"),
        (1e-7, "<0.0001 %"),
        (math.nan, "unknown"),
    ],
)
def test_shares_have_two_digits(share, text):
    assert _percent(share) == text


def test_channels_that_are_not_drawn_and_grey_are_told():
    profile = one_over_r_profile(60, 0.1, np.linspace(0.4, 1.0, 5))
    kernel = fit_svd(profile, rank=1, mm_per_pixel="profile", support_mm=9.0).kernel
    words = words_of(kernel_figure(view_kernel(kernel, profile)))
    assert "Not drawn: 2 channels." in words
    assert "Images are grey where there is no light." in words
    only = words_of(kernel_figure(view_kernel(kernel, channels=["c1"])))
    assert "Not drawn: 4 channels." in only


def test_nothing_is_said_of_what_is_not_there(figure):
    assert "Not drawn" not in words_of(figure)


def test_long_names_stand_beside_the_images():
    profile = one_over_r_profile(60, 0.1, LENGTHS_MM)
    names = ["near-infrared-850nm", "G", "B"]
    long = make_profile(
        profile.r_edges_mm, profile.annulus_energy, meta=dict(profile.meta) | {"channels": names}
    )
    kernel = fit_svd(long, rank=1, mm_per_pixel="profile").kernel
    drawn = panels(kernel_figure(view_kernel(kernel, long)), "profile")
    assert [each.get_ylabel() for each in drawn] == [
        "near-…-850nm\ny (mm)",
        "G\ny (mm)",
        "B\ny (mm)",
    ]


def odd_views():
    """Views whose charts may come out illegible."""
    grey = one_over_r_profile(80, 0.1, [0.6])
    three = one_over_r_profile(80, 0.1, LENGTHS_MM)
    names = ["near-infrared-850nm", "Wm@$漢" * 10, "b"]
    long = make_profile(
        three.r_edges_mm,
        three.annulus_energy,
        meta=dict(three.meta) | {"channels": names, "material": {"name": "m" * 90}},
    )
    return {
        "three": lambda: view_kernel(fit_svd(three, mm_per_pixel=0.2).kernel, three),
        "grey": lambda: view_kernel(fit_svd(grey, rank=2, mm_per_pixel="profile").kernel, grey),
        "no profile": lambda: view_kernel(fit_svd(three, mm_per_pixel=0.2).kernel),
        "one pass": lambda: view_kernel(
            fit_preintegrated(three, mm_per_pixel="profile").kernel, three
        ),
        "ten terms": lambda: view_kernel(
            fit_svd(three, rank=10, mm_per_pixel="profile").kernel, three
        ),
        "six Gaussians": lambda: view_kernel(
            fit_gaussians(three, terms=6, mm_per_pixel=0.2).kernel, three
        ),
        "long names": lambda: view_kernel(fit_svd(long, rank=4, mm_per_pixel=0.2).kernel, long),
        "one pixel": lambda: view_kernel(
            fit_preintegrated(three, mm_per_pixel=40.0, support_mm=9.0).kernel, three
        ),
        "small": lambda: view_kernel(
            fit_svd(one_over_r_profile(80, 1e-4, [6e-4]), rank=1, mm_per_pixel="profile").kernel,
        ),
    }


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize(
    "name",
    mostly_slow(odd_views(), "no profile", "ten terms", "six Gaussians", "long names", "one pixel"),
)
def test_no_text_is_cut_off_or_runs_into_another(name):
    view = odd_views()[name]()
    assert_legible(lambda: kernel_figure(view))


@pytest.mark.parametrize("format", mostly_slow(["png", "svg", "pdf"], "png"))
def test_same_kernel_same_bytes(figure, figure_again, format):
    written = []
    for each in (figure, figure_again):
        stream = io.BytesIO()
        save_figure(each, stream, format=format)
        written.append(stream.getvalue())
    assert written[0] == written[1]
    if format == "png":
        width, height = (int.from_bytes(written[0][k : k + 4]) for k in (16, 20))
        assert (width, height) == (1600, round(200 * figure.get_figheight()))
        assert height < 2400


@pytest.fixture
def run(tmp_path, monkeypatch, capfd, profile, kernel):
    """Run ``sssfit chart`` beside a kernel and its profile; give exit status, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    profile.save(tmp_path / "wax.profile.npz")
    kernel.save(tmp_path / "wax.svd3.kernel.json")

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["chart", *arguments])
        out, err = capfd.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_the_verb_finds_the_profile_and_tabulates_the_errors(run, tmp_path, view):
    status, out, err = run("wax.svd3.kernel.json")
    assert (status, err) == (0, "")
    assert (tmp_path / "wax.svd3.kernel.png").read_bytes().startswith(b"\x89PNG")
    lines = out.splitlines()
    assert lines[0].endswith("41 x 41 pixels of 0.25 mm; against wax.profile.npz")
    (line,) = [each for each in lines if each.startswith("c1 ")]
    name, energy, *shares = line.replace(" %", "").split()
    assert (name, energy) == ("c1", f"{view.energy[1]:.6f}")
    assert shares == [
        "0",
        f"{100 * view.relative_frobenius_error[1]:.3g}",
        f"{100 * view.misplaced[1]:.3g}",
    ]
    assert lines[-1] == "Wrote wax.svd3.kernel.png"


def test_the_verb_gives_json_of_one_channel(run, view):
    status, out, err = run(
        "wax.svd3.kernel.json", "--channel", "c2", "-o", "a.svg", "--json", "--profile",
        "wax.profile.npz",
    )  # fmt: skip
    assert (status, err) == (0, "")
    figures = json.loads(out)
    assert figures["output"] == ["a.svg"]
    assert (figures["kind"], figures["file"]) == ("kernel", "wax.svd3.kernel.json")
    assert (figures["profile"], figures["channels"]) == ("wax.profile.npz", ["c2"])
    for name in ("energy", "energy_error", "relative_frobenius_error", "misplaced"):
        assert figures[name] == [pytest.approx(getattr(view, name)[2], rel=1e-12, abs=1e-15)]


def test_a_kernel_without_its_profile_is_drawn_alone(run, tmp_path):
    (tmp_path / "wax.profile.npz").unlink()
    status, out, err = run("wax.svd3.kernel.json", "--json", "--channel", "c1")
    assert status == 0
    assert "No profile here is the one that wax.svd3.kernel.json was fitted to" in err
    figures = json.loads(out)
    assert figures["profile"] is figures["misplaced"] is None


@pytest.mark.parametrize(
    ("arguments", "status", "fragment"),
    [
        (("wax.svd3.kernel.json", "--spectrum"), 1, "is not a profile; --spectrum draws one"),
        (("wax.svd3.kernel.json", "--guide"), 1, "is not a profile; --guide draws one"),
        (("wax.svd3.kernel.json", "--channel", "X"), 1, "there is no channel X"),
        (("wax.svd3.kernel.json", "--profile", "no.npz"), 1, "no.npz"),
        (("wax.profile.npz", "--profile", "wax.profile.npz"), 2, "--profile is for a kernel"),
        (("wax.profile.npz", "--channel", "c1"), 2, "--channel is for the fits of --guide, or"),
        (("--guide", "--profile", "wax.profile.npz"), 2, "--profile is for a kernel"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, arguments, status, fragment):
    code, out, err = run(*arguments)
    assert code == status
    assert out == ""
    assert fragment in err.splitlines()[-1]
    assert "Traceback" not in err
    assert not list(tmp_path.glob("*.png"))
