"""A report in headless Chromium: it shows what the library computes, and all of it can be used."""

import dataclasses
import json
from urllib.parse import quote

import numpy as np
import pytest
import report_world as world
from browser import Browser

from sssfit.export import kernel_text
from sssfit.formats.pictures import load_image
from sssfit.measure.delta_e import delta_e_2000
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.report import page as html_page
from sssfit.report.pack import unpacked_picture

SHOWN = ("svd 2 on 7 taps", "svd 3 on 11 taps", "disk 24")
CONTROLS = ("kernel", "scene", "light", "distance", "format", "show")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "page.html"
    path.write_text(world.text(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    made = Browser(tmp_path_factory.mktemp("downloads"))
    yield made
    made.driver.quit()


def picture_of(key):
    (found,) = (each for each in world.report().pictures if each.key == key)
    return found


def kernel_of(label):
    (found,) = (each for each in world.report().kernels if each.label == label)
    return found


def labels():
    """A chain with halved pictures, a disk, and terms that share their first pass."""
    every = [each.label for each in world.report().kernels]
    return [world.LABEL, *(each for each in every if each in SHOWN)]


def test_the_page_loads_without_an_error_and_without_a_network(page, window):
    window.open(page)
    assert window.log("browser") == []
    events = [json.loads(each["message"])["message"] for each in window.log("performance")]
    asked = [each["params"]["request"]["url"] for each in events
             if each["method"] == "Network.requestWillBeSent"]  # fmt: skip
    assert {url.partition(":")[0] for url in asked} <= {"file", "data", "blob"}
    assert [url for url in asked if url.startswith("file:")] == [f"file://{page}"]


def test_a_dangerous_name_is_text(page, window):
    window.show(page)
    assert window.js("return document.querySelector('h1').textContent") == world.NAME
    window.set("kernel", world.LABEL)
    assert window.text("single-title").endswith(world.LABEL)
    assert window.js("return document.querySelectorAll('img').length") == 0


@pytest.mark.parametrize(
    ("key", "kernels"),
    [
        *(("head-45-1", slice(None)), ("edge", slice(0, None, 3)), ("disk", slice(1, 2))),
        *(pytest.param(each, slice(None), marks=pytest.mark.slow) for each in ("edge", "disk")),
    ],
)
def test_kernels_that_run_in_the_page_show_the_librarys_pictures(page, window, key, kernels):
    window.show(page, f"#picture={key}")
    reference = picture_of(key).reference
    for label in labels()[kernels]:
        taps = kernel_of(label).taps
        window.set("kernel", label)
        seen = load_image(window.download("kernel")).pixels
        border = "mirror" if reference.border == "mirror" else "clamp"
        ours = render(reference.scene, taps, border=border)
        assert np.abs(seen - ours).max() < 2e-3, label


def middle_of(id_):
    """Code that reads the middle of a canvas, as rows of red, green, blue and alpha."""
    return (
        f"(() => {{ const at = document.getElementById('{id_}'), {{ width, height }} = at;"
        "const [x, y] = [width, height].map((side) => Math.floor(side / 2) - 10);"
        "return [...at.getContext('2d').getImageData(x, y, 20, 20).data]; })()"
    )


def test_one_channel_is_grey_wherever_it_is_shown(tmp_path, window):
    path = tmp_path / "grey.html"
    path.write_text(html_page(world.grey()), encoding="utf-8")
    window.open(path, "#mode=single&pane=kernel")
    canvases = ("single", "loupe-truth", "loupe-kernel")
    for seen in window.js(f"return [{', '.join(map(middle_of, canvases))}]"):
        red, green, blue, _ = np.reshape(seen, (-1, 4)).T
        assert red.max() > 0
        assert (red == green).all()
        assert (red == blue).all()
    reference = world.grey().pictures[0].reference
    label = window.js("return document.getElementById('kernel').value")
    (kernel,) = (each for each in world.grey().kernels if each.label == label)
    ours = render(reference.scene, kernel.taps, border=reference.border)
    made = load_image(window.download("kernel")).pixels
    assert np.abs(made - ours).max() < 2e-3
    truth = np.broadcast_to(reference.truth.astype(np.float16).astype(float), made.shape)
    score = measure(made, truth, exposure=reference.exposure, mask=reference.scene.mask)
    assert float(window.text("figure-mean")) == pytest.approx(score.delta_e_2000_mean, rel=0.01)


def test_the_truth_is_the_librarys_in_half_floats(page, window):
    window.show(page)
    truth = picture_of("head-45-1").reference.truth
    seen = load_image(window.download("truth")).pixels
    np.testing.assert_array_equal(seen, truth.astype(np.float16))


def test_figures_are_the_librarys(page, window):
    window.show(page)
    reference = picture_of("head-45-1").reference
    for label in labels()[::3]:
        window.set("kernel", label)
        seen = load_image(window.download("kernel")).pixels
        truth = reference.truth.astype(np.float16)
        score = measure(seen, truth, exposure=reference.exposure, mask=reference.scene.mask)
        for key, name in (("mean", "mean"), ("p95", "p95"), ("p99", "p99")):
            value = getattr(score, f"delta_e_2000_{name}")
            assert window.text(f"figure-{key}") == f"{float(f'{value:.3g}'):#.3g}"
        assert float(window.text("figure-milliseconds")) > 0.0


def differences_of(window):
    """Truth, kernel and Delta E (H, W) of the picture that is shown, by the library."""
    reference = picture_of("head-45-1").reference
    seen = load_image(window.download("kernel")).pixels.astype(np.float64)
    truth = reference.truth.astype(np.float16).astype(np.float64)
    colours = (each.reshape(-1, 3) for each in (seen, truth))
    found = delta_e_2000(*colours, reference.exposure).reshape(truth.shape[:2])
    return truth, seen, found


def test_quartiles_are_those_of_the_error_as_its_own_weight(page, window):
    window.show(page)
    mask = picture_of("head-45-1").reference.scene.mask
    differences = differences_of(window)[2]
    counted = np.sort(differences.ravel() if mask is None else differences[mask > 0])
    share = np.cumsum(counted) / counted.sum()
    expected = [counted[np.searchsorted(share, k / 4)] for k in (1, 2, 3)]
    said = [float(each) for each in window.text("quartiles").partition(": ")[2].split(", ")]
    assert said == pytest.approx(expected, rel=0.01)  # three digits are shown
    assert len(window.driver.find_elements("css selector", "#histogram .quartile")) == 3


def test_the_loupe_tells_the_pixel_under_the_mouse(page, window):
    window.show(page)
    canvas = window.driver.find_element("id", "single")
    window.mouse().move_to_element(canvas).perform()
    column, row = (int(each) for each in window.text("pixel-place").split(", "))
    pictures = differences_of(window)
    height, width = pictures[2].shape
    assert (abs(column - width / 2), abs(row - height / 2)) <= (2, 2)
    for name, values in zip(("truth", "kernel", "error"), pictures, strict=True):
        said = [float(each) for each in window.text(f"pixel-{name}").split(" ")]
        assert said == pytest.approx(np.atleast_1d(values[row, column]), rel=0.01, abs=1e-3), name
    drawn = window.js(
        "return ['truth', 'kernel'].map((name) => document.getElementById(`loupe-${name}`)"
        ".getContext('2d').getImageData(20, 20, 50, 50).data.some((n) => n > 0 && n < 255))"
    )
    assert drawn == [True, True]


@pytest.mark.parametrize("kernels", [3, pytest.param(None, marks=pytest.mark.slow)])
def test_every_control_does_something(page, window, kernels):
    window.open(page)
    for id_ in CONTROLS:
        options = window.js(
            "return [...document.getElementById(arguments[0]).options].map((at) => at.value)", id_
        )
        assert len(options) > 1, id_
        for each in (*(options[:kernels] if id_ == "kernel" else options), options[0]):
            window.set(id_, each)
    for id_, value in (("stops", 2), ("gain", 4), ("frames", 3), ("split", 0.2)):
        window.set(id_, value)
        assert f"{id_}={value:g}" in window.js("return location.hash")
    window.set("kernel", world.LABEL)
    window.click("#jitter")
    assert "jitter=1" in window.js("return location.hash")
    for name in ("mode", "pane"):
        for each in window.driver.find_elements("name", name):
            each.click()
            window.wait()
            assert each.is_selected()
    for each in ("zoom-in", "zoom-out", "fit", "pin"):
        window.click(f"#{each}")
    for each in ("truth", "unblurred"):
        window.download(each)
    window.click(".inset")
    for key in "123456789teEsfb+-0p":
        window.key(key)
    assert window.log("browser") == []


def test_the_divider_is_dragged_and_elsewhere_the_picture(page, window):
    window.show(page, "#zoom=4")
    canvas = window.driver.find_element("id", "single")
    width = canvas.size["width"]
    mouse = window.mouse()
    mouse.move_to_element(canvas).click_and_hold().move_by_offset(width // 4, 0).release().perform()
    assert float(window.js("return document.getElementById('split').value")) == pytest.approx(
        0.75, abs=0.02
    )
    mouse.move_to_element(canvas).click_and_hold().move_by_offset(40, 0).release().perform()
    seen = dict(each.split("=") for each in window.js("return location.hash")[1:].split("&"))
    assert float(seen["split"]) == pytest.approx(0.75, abs=0.02)
    assert float(seen["x"]) < 0.5
    assert "pins" not in seen


def test_stages_are_shown_one_by_one(page, window):
    window.show(page)
    window.set("kernel", world.LABEL)
    window.set("show", "H1")
    assert window.text("figure-mean") == "-"
    half = load_image(window.download("kernel")).pixels
    assert half.shape[:2] == (world.SIDE // 2, world.SIDE // 2)


def test_jitter_changes_the_picture_and_its_frames_average(page, window):
    still = window.show(page, "#kernel=" + quote(world.LABEL)).download("kernel")
    still = load_image(still).pixels
    window.click("#jitter")
    moved = load_image(window.download("kernel")).pixels
    window.set("frames", 16)
    mean = load_image(window.download("kernel")).pixels
    assert np.abs(moved - still).max() > 1e-3
    assert np.abs(mean - still).mean() < np.abs(moved - still).mean()


def test_the_address_holds_the_view(page, window):
    window.show(page)
    window.set("kernel", labels()[3])
    window.set("scene", "edge")
    window.key("b")
    window.key("E")
    window.click("#pin")
    hash_ = window.js("return location.hash")
    pins = window.text("pins")
    window.open(page, hash_)
    assert window.js("return document.getElementById('kernel').value") == labels()[3]
    assert window.js("return document.getElementById('scene').value") == "edge"
    assert window.js("return document.getElementById('stage').dataset.mode") == "side"
    assert window.text("stops-words") == "+0.5 stops"
    assert window.text("pins") == pins != ""


def test_a_point_of_the_front_tells_and_runs_its_kernel(page, window):
    window.show(page)
    label = world.report().front[0]
    point = f'.point[data-kernel="{label}"]'
    window.point(point)
    assert window.text("pareto-words").startswith(f"{label}: mean ΔE ")
    window.point(point, click=True)
    assert window.js("return document.getElementById('kernel').value") == label
    assert window.js(f"return document.querySelector({point!r}).ariaPressed") == "true"


def test_tables_sort_and_copy(page, window):
    window.open(page)
    heads = window.js(
        "return [...document.querySelectorAll('#table-kernels th')].map((at) => at.dataset.value)"
    )
    column = heads.index("mean ΔE")
    read = (
        "return [...document.querySelectorAll('#table-kernels tbody tr')]"
        f".map((row) => Number(row.cells[{column}].dataset.value))"
    )
    for turn in (False, True):
        window.click(f"#table-kernels th:nth-child({column + 1}) button")
        values = window.js(read)
        assert values == sorted(values, reverse=turn)
    window.click('[data-csv="table-kernels"]')
    window.wait("document.getElementById('status').textContent.startsWith('Copied')")
    lines = window.pasted().splitlines()
    assert len(lines) == len(world.report().comparison.rows) + 1
    assert lines[0].split(",")[:4] == ["kernel", "picture", "on the front", "mean ΔE"]


def test_the_copied_export_is_the_export(page, window):
    window.show(page)
    window.set("kernel", world.LABEL)
    for form in ("hlsl", "glsl", "wgsl", "json"):
        window.js("document.getElementById('status').textContent = ''")
        window.click(f"[data-export={form}]")
        window.wait("document.getElementById('status').textContent.startsWith('Copied')")
        assert window.pasted() == kernel_text(kernel_of(world.LABEL).taps, form)[0], form


def test_a_key_is_seen_in_the_controls(page, window):
    window.show(page)
    for key, mode, pane in (
        *(("3", "single", "difference"), ("1", "single", "truth"), ("s", "swipe", "kernel")),
        *(("f", "flicker", "kernel"), ("b", "side", "kernel")),
    ):
        window.key(key)
        for name, value in (("mode", mode), ("pane", pane)):
            read = f"return document.querySelector('input[name={name}]:checked').value"
            assert window.js(read) == value, (key, name)


def test_the_scale_ends_where_the_gain_says(page, window):
    window.show(page)
    assert window.text("scale-end") == "5 and more"
    window.set("gain", 8)
    assert window.text("scale-end") == "0.625 and more"


@pytest.mark.parametrize(("key", "times"), [("disk", 2), ("edge", 0.5)])
def test_the_page_computes_truths_for_other_pixels(page, window, key, times):
    window.show(page, f"#picture={key}&kernel=" + quote(labels()[0]))
    window.set("distance", times)
    assert f"times={times:g}" in window.js("return location.hash")
    reference = picture_of(key).reference
    scene = reference.scene
    lit = scene.irradiance.astype(np.float16).astype(float)
    pitch = times * scene.mm_per_pixel
    scene = dataclasses.replace(scene, irradiance=lit, mm_per_pixel=pitch)
    border = "mirror" if reference.border == "mirror" else "clamp"
    truth = render_reference(scene, world.report().profile, border=border)
    seen = load_image(window.download("truth")).pixels
    np.testing.assert_allclose(seen, truth, rtol=1e-6, atol=1e-7 * truth.max())
    ours = render(scene, kernel_of(labels()[0]).taps, border=border)
    assert np.abs(load_image(window.download("kernel")).pixels - ours).max() < 2e-3


def test_fetches_go_along_the_front(page, window):
    window.show(page)
    front = world.report().front
    for k, label in enumerate(front):
        window.set("most", k)
        assert window.js("return document.getElementById('kernel').value") == label
        assert window.text("most-words").startswith(f"{kernel_of(label).taps.fetches:.3g}"[:2])


def test_a_chart_shows_one_channel_at_a_time(page, window):
    window.open(page)
    read = (
        "return [...document.querySelectorAll('#chart-models .panel')].map((each) => each.hidden)"
    )
    assert window.js(read) == [True, False, True]
    window.click("#chart-models [data-panel='2']")
    assert window.js(read) == [True, True, False]


def test_the_difference_is_downloaded(page, window):
    window.show(page)
    errors = load_image(window.download("difference")).pixels
    np.testing.assert_array_equal(errors[..., 0], errors[..., 2])
    mask = picture_of("head-45-1").reference.scene.mask > 0
    assert f"{errors[..., 0][mask].mean():.3g}" == f"{float(window.text('figure-mean')):.3g}"


@pytest.mark.parametrize("width", [360, 1600])
@pytest.mark.parametrize("dark", [False, True])
def test_no_width_loses_anything(page, window, width, dark):
    window.open(page, "#mode=side", width=width, dark=dark)
    assert window.js("return document.documentElement.scrollWidth") <= width
    outside = window.js(
        "return [...document.querySelectorAll('button, select, input, canvas, .chart, dd')]"
        ".filter((each) => !each.closest('.scroll')).filter((each) => {"
        "const box = each.getBoundingClientRect();"
        "return box.width && (box.left < 0 || box.right > innerWidth + 0.5); })"
        ".map((each) => each.id || each.textContent)"
    )
    assert outside == []


def test_every_control_has_a_name(page, window):
    window.show(page)
    nameless = window.js(
        "return [...document.querySelectorAll("
        "'button, select, input, canvas, [role=img], [tabindex]')]"
        ".filter((each) => !(each.labels?.length || each.textContent.trim() ||"
        " each.getAttribute('aria-label') || each.getAttribute('aria-labelledby') ||"
        " each.closest('button'))).map((each) => each.outerHTML.slice(0, 80))"
    )
    assert nameless == []


def test_without_webgl_the_page_falls_back_and_says_so(page, tmp_path):
    window = Browser(tmp_path, webgl=False)
    try:
        window.open(page)
        assert window.js("return !document.getElementById('no-webgl').hidden")
        drawn = world.report().to_dict()["drawn"]
        options = "return [...document.getElementById('kernel').options].map((each) => each.value)"
        assert sorted(window.js(options)) == sorted(drawn)
        for label, packed in drawn.items():
            window.set("kernel", label)
            seen = load_image(window.download("kernel")).pixels
            np.testing.assert_array_equal(seen, unpacked_picture(packed))
        assert window.text("figure-milliseconds") == "-"
    finally:
        window.driver.quit()
