"""What a notebook shows of a record: one line, a table, a figure."""

import io
import re
import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

import sssfit
from sssfit.chart import page
from sssfit.chart.kernel import kernel_figure
from sssfit.chart.page import save_figure
from sssfit.chart.profile import profile_figure
from sssfit.compare.kernel_view import view_kernel
from sssfit.errors import KernelError
from sssfit.export import exported
from sssfit.simulate import simulate_burley, simulate_montecarlo

NUMBER = r"[-+]?[\d.]+(?:e[-+]?\d+)?"


@pytest.fixture(scope="module")
def profile():
    return simulate_burley(sssfit.load_material("skin1"))


@pytest.fixture(scope="module")
def kernel(profile):
    return sssfit.fit(profile, "svd", rank=2, mm_per_pixel=0.5)


@pytest.fixture(scope="module")
def spectral():
    """A material of 64 channels, two of them with names that a page could take for tags."""
    names = ("<b>R</b>", "A&B", *(f"{k} nm" for k in range(62)))
    layer = sssfit.Layer(1.3, 0.0, np.linspace(0.1, 1.0, 64), np.linspace(1.0, 0.5, 64))
    return sssfit.Material("paint", names, (layer,))


def named_figures(line: str) -> dict[str, float]:
    """Numbers by channel at the end of a repr."""
    last = line.rpartition(": ")[2]
    return {name: float(value) for name, value in re.findall(rf"(\w+) ({NUMBER})", last)}


def table_of(record) -> tuple[str, list[list[str]]]:
    """Caption and cells of the HTML, which has to be well-formed."""
    table = ElementTree.fromstring(record._repr_html_())
    assert table.tag == "table"
    return table.findtext("caption"), [[cell.text for cell in row] for row in table.iter("tr")]


def test_a_profile_is_one_line_with_what_it_reflects(profile):
    line = repr(profile)
    assert line.startswith("<Profile of skin1 by burley, 1236 annuli to 41.48 mm: R_d R ")
    found = named_figures(line.replace("R_d R", "R"))
    assert list(found) == ["R", "G", "B"]
    np.testing.assert_allclose(list(found.values()), profile.diffuse_reflectance, atol=5e-5)
    walked = simulate_montecarlo(sssfit.load_material("skin1"), photons=5000)
    assert "by montecarlo, 5e+03 photons, " in repr(walked)
    assert "unknown material" in repr(replace(profile, meta={**profile.meta, "material": None}))


def test_a_kernel_is_one_line_with_its_errors(kernel):
    line = repr(kernel)
    assert line.startswith("<SeparableKernel of skin1 by svd, 2 terms, 59 pixels of 0.5 mm: error ")
    found = named_figures(line)
    expected = 100.0 * kernel.relative_frobenius_error
    np.testing.assert_allclose(list(found.values()), expected, rtol=5e-3)
    unfitted = replace(kernel, relative_frobenius_error=np.full(3, np.nan))
    assert repr(unfitted).endswith("error R unknown, G unknown, B unknown>")


def test_a_material_is_one_line(spectral):
    skin = sssfit.load_material("skin1")
    expected = "<Material skin1: eta 1.3, transport mean free path R 1.3, G 0.952, B 0.671 mm>"
    assert repr(skin) == expected
    layer = skin.layers[0]
    stack = sssfit.Material("s", ("R", "G", "B"), (replace(layer, thickness_mm=0.25), layer))
    assert repr(stack) == "<Material s: 2 layers of 0.25, inf mm>"
    assert "2 mm thick, transport mean" in repr(
        replace(stack, layers=(replace(layer, thickness_mm=2.0),))
    )
    assert repr(spectral).endswith(" and 60 more mm>")


@pytest.mark.parametrize("kind", ["material", "profile", "kernel"])
def test_64_channels_and_long_names_stay_one_line(kind, spectral):
    long = replace(spectral, name="p" * 100)
    profile = simulate_burley(long)
    record = {
        "material": lambda: long,
        "profile": lambda: profile,
        "kernel": lambda: sssfit.fit(profile, "svd", rank=1, mm_per_pixel=1.0),
    }[kind]()
    assert len(repr(record)) < 200
    assert repr(record).isprintable()
    assert str(record) == repr(record)


def test_a_profiles_table_has_a_row_for_each_channel(profile, spectral):
    caption, rows = table_of(profile)
    assert repr(profile).startswith(f"<{caption}: ")
    heads = ["channel", "diffuse reflectance", "std. error", "beyond grid", "half within, mm"]
    assert rows[0] == heads
    assert [row[0] for row in rows[1:]] == ["R", "G", "B"]
    for c, row in enumerate(rows[1:]):
        assert float(row[1]) == pytest.approx(profile.diffuse_reflectance[c], abs=5e-7)
        assert row[2] == "-"  # nothing was sampled
        within = profile.cumulative_at(float(row[4]))[c] / profile.total_on_grid[c]
        assert within == pytest.approx(0.5, abs=1e-3)
    _, many = table_of(simulate_burley(spectral))
    assert [row[0] for row in many[1:]] == list(spectral.channels)


def test_a_kernels_table_has_a_row_for_each_channel(kernel):
    caption, rows = table_of(kernel)
    assert repr(kernel).startswith(f"<{caption}: ")
    assert rows[0] == ["channel", "energy", "scale", "Frobenius error", "energy error"]
    for c, row in enumerate(rows[1:]):
        assert row[0] == kernel.channels[c]
        assert float(row[1]) == pytest.approx(kernel.energy[c], abs=5e-7)
        error = float(row[3].removesuffix(" %")) / 100.0
        assert error == pytest.approx(kernel.relative_frobenius_error[c], rel=5e-3)


def test_a_table_of_taps_has_a_row_for_each_channel(profile):
    taps = sssfit.fit(profile, "disk", taps=8)
    caption, rows = table_of(taps)
    assert repr(taps).startswith(f"<{caption}: error R unknown")
    assert caption == "Taps of skin1 by disk, 8 rings, 8 fetches of 0.3 mm pixels"
    assert rows[0] == ["channel", "energy", "spectral error", "energy error"]
    for c, row in enumerate(rows[1:]):
        assert row[0] == taps.channels[c]
        assert float(row[1]) == pytest.approx(taps.energy[c], abs=5e-7)
        assert row[2] == "unknown"
    assert isinstance(taps.plot(profile), Figure)
    with pytest.raises(KernelError, match="has the channels"):
        taps.plot(_grey())


def test_an_exported_file_is_one_line_without_its_content(kernel):
    made = exported([kernel], "csv")
    assert repr(made) == f"<Exported a table (.csv) of a kernel, {len(made.content):,} bytes>"


def _grey():
    """A profile of one channel."""
    return simulate_burley(
        sssfit.Material("grey", ("grey",), (sssfit.Layer(1.3, 0.0, [0.1], [1.0]),))
    )


def test_a_profiles_plot_is_its_chart_and_shows_as_it_is_written(profile):
    stream = io.BytesIO()
    save_figure(profile_figure(profile), stream, format="png")
    plot = profile.plot()
    assert isinstance(plot, Figure)
    assert plot._repr_png_() == stream.getvalue()


def test_a_kernels_plot_is_its_chart_with_or_without_the_profile(profile, kernel, monkeypatch):
    monkeypatch.setattr(page, "lay_out", lambda _: None)  # a second a figure
    for plot, view in (
        (kernel.plot(), view_kernel(kernel)),
        (kernel.plot(profile), view_kernel(kernel, profile)),
    ):
        figure = kernel_figure(view)
        assert isinstance(plot, Figure)
        assert drawn(plot) == drawn(figure)
    with pytest.raises(KernelError, match="channels"):
        replace(kernel, channels=("X", "Y", "Z"), parameters={}).plot(profile)


def drawn(figure: Figure) -> list:
    """Titles, texts and curves of a figure, without the pixels, which take seconds."""
    return [
        (axes.get_title(), [each.get_text() for each in axes.texts], axes.dataLim.bounds)
        for axes in figure.axes
    ]


def test_records_do_not_import_matplotlib_until_they_draw():
    program = """
import sys, sssfit
profile = sssfit.simulate("skin1", "dipole")
kernel = sssfit.fit(profile, "svd", mm_per_pixel=2.0)
repr(profile), profile._repr_html_(), repr(kernel), kernel._repr_html_()
assert "matplotlib" not in sys.modules
kernel.plot(profile)
assert "matplotlib" in sys.modules and "matplotlib.pyplot" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
