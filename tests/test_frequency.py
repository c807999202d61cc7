"""R(k), a profile's response to sinusoids of light: theory, errors, table and chart."""

import csv

import numpy as np
import pytest
from figures import assert_legible
from matplotlib.text import Text

from sssfit.chart.frequency import frequency_figure
from sssfit.errors import KernelError, ProfileError
from sssfit.export import exported, is_ours
from sssfit.formats.csv import csv_text, parse_csv
from sssfit.kernel import SeparableKernel
from sssfit.material import Layer, Material, load_material
from sssfit.profile.frequency import frequency_response
from sssfit.simulate import simulate_burley, simulate_exact, simulate_montecarlo


@pytest.fixture(scope="module")
def skin1():
    return load_material("skin1")


def test_normalised_diffusion_has_its_closed_form():
    """e^(-r/d)/r + e^(-r/3d)/r over 8 pi d: A/4 [1/sqrt(1 + k^2 d^2) + 3/sqrt(1 + 9 k^2 d^2)]."""
    d = 0.5
    edges = np.linspace(0.0, 60.0, 6001)
    profile = burley(edges, d)
    k = np.array([0.0, 0.01, 0.1, 1.0, 3.0, 10.0, 30.0])
    theory = 0.25 / np.sqrt(1 + (k * d) ** 2) + 0.75 / np.sqrt(1 + 9 * (k * d) ** 2)
    found = frequency_response(profile, k).response[:, 0]
    np.testing.assert_allclose(found, theory, rtol=2e-5)


def burley(edges, d):
    from sssfit.profile import FORMAT, Profile

    within = 1.0 - 0.25 * np.exp(-edges / d) - 0.75 * np.exp(-edges / (3.0 * d))
    energy = np.diff(within)[:, None]
    none, meta = np.zeros(1), {"format": FORMAT, "channels": ["grey"], "method": "burley"}
    return Profile(
        edges, energy, 0.0 * energy, 1.0 - energy.sum(axis=0), none, 0.0, np.zeros((0, 1)), none,
        None, meta,
    )  # fmt: skip


def test_a_walk_agrees_with_the_exact_solution_within_its_errors(skin1):
    """z at 40 frequencies; neighbours are correlated, so the worst is what counts."""
    walk = simulate_montecarlo(skin1, photons=300_000, seed=5)
    k = np.linspace(0.0, 12.0, 40)
    found = frequency_response(walk, k)
    exact = frequency_response(simulate_exact(skin1, dr_mm=walk.r_edges_mm[1]), k).response
    z = (found.response - exact) / found.stderr
    assert np.abs(z).max() < 4.5
    assert 0.2 < np.sqrt((z**2).mean()) < 1.6


def test_frequencies_by_default_reach_from_flat_to_the_first_annulus(skin1):
    profile = simulate_burley(skin1)
    found = frequency_response(profile)
    assert found.k_per_mm[0] == 0.0
    assert (found.response[1] > 0.99 * found.response[0]).all()
    assert found.k_per_mm[-1] == pytest.approx(1.0 / profile.r_edges_mm[1])
    np.testing.assert_array_equal(found.response[0], profile.diffuse_reflectance)


@pytest.mark.parametrize("k", [-1.0, np.nan, np.inf, [[1.0]]])
def test_bad_frequencies_are_refused(skin1, k):
    with pytest.raises(ProfileError, match="not a number from 0 up"):
        frequency_response(simulate_burley(skin1), k)


def test_its_table_has_every_digit(skin1, tmp_path):
    profile = simulate_burley(skin1)
    made = exported([profile], "frequency")
    lines = [each for each in made.content.decode().splitlines() if not each.startswith("#")]
    heads, *rows = csv.reader(lines)
    assert heads == ["k_per_mm", *"RGB", "R_stderr", "G_stderr", "B_stderr"]
    found = frequency_response(profile)
    whole = np.column_stack([found.k_per_mm, found.response, found.stderr])
    np.testing.assert_array_equal(np.array(rows, float), whole)
    path = tmp_path / "x.csv"
    path.write_bytes(made.content)
    assert is_ours(path, "frequency")
    assert not is_ours(path, "csv")


def test_a_kernel_has_no_table(skin1):
    kernel = SeparableKernel.__new__(SeparableKernel)
    for sources in ([kernel], [simulate_burley(skin1)] * 2):
        with pytest.raises(KernelError, match="of one profile"):
            exported(sources, "frequency")


def test_the_chart_draws_each_channel_with_its_error(skin1):
    found = frequency_response(simulate_montecarlo(skin1, photons=20_000))
    figure = assert_legible(lambda: frequency_figure(found))
    left, right = (each for each in figure.axes if each.get_title(loc="left"))
    assert len(left.lines) == len(right.lines) == 3
    np.testing.assert_array_equal(left.lines[0].get_ydata(), found.response[:, 0])
    np.testing.assert_allclose(right.lines[2].get_xdata(), found.k_per_mm / (2.0 * np.pi))
    assert len(left.collections) == 3


def test_of_many_channels_eight_are_drawn_and_the_rest_is_told(skin1):
    names = tuple(f"{400 + 30 * k}nm" for k in range(12))
    layer = Layer(1.4, 0.0, np.linspace(2.0, 0.05, 12), np.full(12, 3.0))
    found = frequency_response(simulate_burley(Material("bands", names, (layer,))))
    figure = assert_legible(lambda: frequency_figure(found))
    left = next(each for each in figure.axes if each.get_title(loc="left"))
    drawn = np.array([each.get_ydata() for each in left.lines])
    np.testing.assert_array_equal(drawn, found.response[:, [0, 2, 3, 5, 6, 8, 9, 11]].T)
    assert len({str(each.get_color()) for each in left.lines}) == 8
    words = " ".join(each.get_text() for each in figure.findobj(Text))
    assert "4 channels between these are not drawn." in words


def imported(profile):
    """A walk as it comes back from a table, which does not say how many photons it took."""
    return parse_csv(csv_text(profile), "walk.csv")


def test_errors_are_named_for_what_they_are(skin1):
    """Noise of a walk, imported too, estimates of the exact solver; diffusion has none."""
    made = (
        (simulate_montecarlo(skin1, photons=20_000), "bands show ± the standard error"),
        (simulate_exact(skin1), "bands show ± the estimated error"),
        (simulate_burley(skin1), "light cos(kx)."),
        (imported(simulate_montecarlo(skin1, photons=20_000)), "bands show ± the standard error"),
    )
    for profile, words in made:
        figure = frequency_figure(frequency_response(profile))
        texts = [each.get_text().replace("\n", " ") for each in figure.findobj(Text)]
        assert words in " ".join(texts)
