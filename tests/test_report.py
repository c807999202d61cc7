"""A report's parts without a browser: packing, policy, scripts, charts and errors."""

import base64
import hashlib
import html
import json
import os
import re
import shutil
import subprocess
from itertools import combinations, pairwise
from pathlib import Path

import cli_world
import numpy as np
import pytest
import report_world as world

from sssfit.errors import FitError, KernelError, RenderError, SimulationError
from sssfit.formats.pictures import save_image
from sssfit.material import parse_material
from sssfit.measure.delta_e import delta_e_of_lab, lab
from sssfit.methods import FITS
from sssfit.report import finished_page, is_report_file, library_page, make_report, page, parts
from sssfit.report.charts import charts_of
from sssfit.report.charts.names import meet, named
from sssfit.report.commands import commands_of
from sssfit.report.html import SCRIPTS, script_text
from sssfit.report.kept import kept, page_key
from sssfit.report.kernels import shown_candidates
from sssfit.report.pack import packed_picture, unpacked_picture
from sssfit.report.pictures import _reduced
from sssfit.report.tables import Table, tables_of
from sssfit.scene.record import Scene

STATIC = Path(__file__).parents[1] / "sssfit" / "report" / "static"


@pytest.mark.parametrize("shape", [(5, 7, 3), (4, 1, 1), (1, 6, 2)])
def test_a_packed_picture_comes_back_as_half_floats(shape):
    picture = np.random.default_rng(2).normal(size=shape)
    back = unpacked_picture(packed_picture(picture))
    np.testing.assert_array_equal(back, picture.astype(np.float16).astype(float))


def test_light_beyond_half_floats_is_refused():
    with pytest.raises(RenderError, match="65504 of half floats"):
        packed_picture(np.full((2, 2, 3), 1e6))


def test_a_large_picture_is_reduced_by_means(caplog):
    light = np.random.default_rng(3).random((9, 5, 3))
    with caplog.at_level("INFO", logger="sssfit"):
        small = _reduced(Scene("face", light, 0.1), 4)
    assert small.irradiance.shape == (3, 2, 3)
    assert small.mm_per_pixel == pytest.approx(0.3)
    np.testing.assert_allclose(small.irradiance[0, 0], light[:3, :3].mean(axis=(0, 1)))
    np.testing.assert_allclose(small.irradiance[2, 1], light[6:, 3:].mean(axis=(0, 1)))
    assert "scaled down by 3" in caplog.text


def test_the_policy_has_the_hashes_of_the_one_script_and_the_one_style():
    text = world.text()
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', text)
    (script,) = re.findall(r'<script type="module">(.*?)</script>', text, re.DOTALL)
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    for name, each in (("script", script), ("style", style)):
        digest = base64.b64encode(hashlib.sha256(each.encode()).digest()).decode()
        assert f"{name}-src 'sha256-{digest}'" in html.unescape(policy)
    assert "default-src 'none'" in html.unescape(policy)
    assert " style=" not in re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)


def test_nothing_comes_from_elsewhere():
    text = world.text()
    found = re.findall(r'(?:src|href)="([^"#][^"]*)"', text)
    assert [each for each in found if each != "data:,"] == []
    assert len(text) < 5e6


def test_a_name_cannot_leave_its_place():
    text = world.text()
    assert "<script>alert" not in text
    assert "<img" not in text
    (data,) = re.findall(r'id="data">(.*?)</script>', text, re.DOTALL)
    assert json.loads(data)["name"] == world.NAME


def test_modules_share_one_scope_and_have_no_name_twice():
    names = re.findall(
        r"^(?:const|let|class|function|async function) (\w+)", script_text(), re.MULTILINE
    )
    assert len(names) == len(set(names)) > 30
    assert "import " not in script_text()


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_module_imports_from_those_before_it(name):
    text = (STATIC / f"{name}.js").read_text(encoding="utf-8")
    known = SCRIPTS[: SCRIPTS.index(name)]
    for names, other in re.findall(r"^import \{([^}]*)\} from '\./(\w+)\.js';", text, re.MULTILINE):
        assert other in known
        source = (STATIC / f"{other}.js").read_text(encoding="utf-8")
        for each in names.replace(" ", "").split(","):
            exported = rf"^export (?:const|function|async function|class) {each}\b"
            assert re.search(exported, source, re.MULTILINE), each
    assert len(text.splitlines()) <= 250


def faults_of_syntax(sources):
    """What node finds in modules by name, all read by one process; none where all are sound."""
    code = (
        "const { SourceTextModule } = require('vm');"
        "const faultOf = (source) => {"
        "try { new SourceTextModule(source); return []; } catch (error) { return [String(error)]; }"
        "};"
        "const sources = Object.entries(JSON.parse(require('fs').readFileSync(0, 'utf8')));"
        "const found = sources.map(([name, source]) => [name, faultOf(source)]);"
        "console.log(JSON.stringify(Object.fromEntries(found)));"
    )
    command = ["node", "--experimental-vm-modules", "--no-warnings", "--input-type=commonjs"]
    given = json.dumps(sources)
    ran = subprocess.run([*command, "-e", code], input=given, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.fixture(scope="module")
def syntax():
    sources = {path.name: path.read_text(encoding="utf-8") for path in STATIC.glob("*.js")}
    return faults_of_syntax({**sources, "broken": "export const broken = ;"})


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
@pytest.mark.parametrize("path", sorted(STATIC.glob("*.js")), ids=lambda path: path.stem)
def test_modules_are_javascript(syntax, path):
    assert syntax[path.name] == []
    assert syntax["broken"] == ["SyntaxError: Unexpected token ';'"]


# Of TypeScript's checks: unknown names, missing exports, and wrong numbers of arguments. Types of
# elements would need a cast in every second line.
CHECKED = {"TS2304", "TS2305", "TS2306", "TS2307", "TS2552", "TS2554", "TS2555", "TS2588"}


def test_names_imports_and_calls_are_right(tmp_path):
    """By TypeScript, which CI installs; the only faults it finds are those that are put in."""
    if shutil.which("tsc") is None:
        if os.environ.get("CI") == "true":
            pytest.fail("tsc is missing, and CI installs it")
        pytest.skip("needs tsc")
    shutil.copytree(STATIC, tmp_path / "static")
    # Known to browsers since 2020, and not yet to TypeScript 4.8.
    members = "constructor(format: string); readable: any; writable: any;"
    declared = f"declare class DecompressionStream {{ {members} }}"
    (tmp_path / "known.d.ts").write_text(declared)
    with (tmp_path / "static" / "main.js").open("a") as out:
        out.write("import { nothing } from './half.js';\nexrOf(1, 2, 3, 4);\nmystery();\n")
    assert sorted(faults_of(tmp_path)) == ["TS2304", "TS2305", "TS2554"]


def faults_of(folder):
    """The kinds of faults that TypeScript finds in modules of a folder, of those that we check."""
    library = ["--target", "ES2022", "--lib", "ES2022,DOM,DOM.Iterable", "--module", "ES2022"]
    library.append("--skipLibCheck")  # TypeScript's own declarations: a third of the time
    paths = [folder / "known.d.ts", *sorted((folder / "static").glob("*.js"))]
    command = ["tsc", "--noEmit", "--allowJs", "--checkJs", *library, *map(str, paths)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    found = re.findall(r"error (TS\d+)", ran.stdout)
    assert "TS2339" in found, ran.stdout + ran.stderr  # it did read them
    return [each for each in found if each in CHECKED or each.startswith("TS1")]


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_pages_colours_are_the_librarys():
    """Delta E of random and of grey pairs against colour-science's, and L, a, b."""
    rng = np.random.default_rng(5)
    pairs = rng.random((400, 2, 3))
    pairs[:50] = pairs[:50, :, :1]  # greys have no hue
    pairs[50:100, 1] = np.clip(pairs[50:100, 0] + rng.normal(size=(50, 3)) * 0.01, 0.0, 1.0)
    code = (
        f"import {{ labOf, deltaE }} from '{STATIC / 'colour.js'}';"
        "const pairs = JSON.parse(process.argv[1]);"
        "console.log(JSON.stringify(pairs.map((pair) => {"
        "const labs = pair.map((each) => labOf(...each)); return [labs, deltaE(...labs)]; })));"
    )
    command = ["node", "--experimental-default-type=module", "--input-type=module", "-e", code]
    ran = subprocess.run(
        [*command, json.dumps(pairs.tolist())], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    labs, errors = zip(*json.loads(ran.stdout), strict=True)
    ours = np.stack([lab(pairs[:, k]) for k in (0, 1)], axis=1)
    np.testing.assert_allclose(labs, ours, atol=1e-9)
    np.testing.assert_allclose(errors, delta_e_of_lab(ours[:, 0], ours[:, 1]), atol=1e-7)


def test_the_front_of_the_page_is_that_of_the_comparison():
    report = world.report()
    first = report.comparison.pictures[0].name
    front = [row.label for row in report.comparison.front(first, "delta-e", "fetches")]
    assert report.front == front
    assert {each.label for each in report.kernels} == {row.label for row in report.comparison.rows}


def test_two_channels_have_no_colour():
    text = cli_world.WAX.replace("eta", 'channels = ["a", "b"]\neta', 1)
    text = re.sub(r"\[([\d.]+), ([\d.]+), [\d.]+\]", r"[\1, \2]", text)
    with pytest.raises(RenderError, match="2 channels have no colour"):
        make_report(parse_material(text, "two.toml"))


def boxes_of(svg):
    """The boxes of the points of a chart, and those of the lines that are drawn across it."""
    points = re.findall(r'<circle class="point[^"]*" cx="([\d.]+)" cy="([\d.]+)"', svg)
    found = [(float(x), float(y), float(x), float(y)) for x, y in points]
    for path in re.findall(r'<polyline class="(?:front|noticed)" points="([^"]*)"', svg):
        places = [tuple(map(float, each.split(","))) for each in path.split()]
        found += [(min(a, c), min(b, d), max(a, c), max(b, d))
                  for (a, b), (c, d) in pairwise(places)]  # fmt: skip
    return found


def test_every_kernel_of_the_front_has_its_name_on_nothing_else():
    (svg,) = (str(each.panels[0][1]) for each in charts_of(world.report()) if each.key == "pareto")
    text = r'<text class="small (end|start)" x="([\d.]+)" y="([\d.]+)">([^<]*)</text>'
    lines = [(kind, float(x), float(y), html.unescape(words))
             for kind, x, y, words in re.findall(text, svg)]  # fmt: skip
    written = " ".join(words for *_, words in lines)
    assert all(label in written for label in world.report().front)
    for kind, x, y, words in lines:
        width = 5.0 * len(words)
        box = (x - width, y - 10.0, x, y) if kind == "end" else (x, y - 10.0, x + width, y)
        assert not [each for each in boxes_of(svg) if meet(box, each)], words


def crowded(count):
    """Points of one place, whose names cannot all stand beside it."""
    return [((100.0, 100.0), f"kernel {k} on {k} taps") for k in range(count)]


def test_names_never_meet_and_one_without_room_is_left_out():
    room, taken = (0.0, 0.0, 300.0, 200.0), [(0.0, 90.0, 300.0, 95.0), (94.0, 94.0, 106.0, 106.0)]
    found = named(crowded(12), taken, room)
    boxes = [each.box for each in found.values()]
    assert 2 < len(boxes) < 12
    assert not any(meet(*pair) for pair in combinations(boxes, 2))
    assert not any(meet(box, each) for box in boxes for each in taken)
    assert named(crowded(1), taken, (95.0, 0.0, 105.0, 200.0)) == {}


def test_the_budget_has_an_axis_with_numbers():
    (chart,) = (each for each in charts_of(world.report()) if each.key == "budget")
    svg = str(chart.panels[0][1])
    ticks = re.findall(r'<text class="tick middle" x="([\d.]+)"[^>]*>([^<]*)<', svg)
    ends = {float(x) for x, _ in ticks}
    assert len(ticks) == len(ends) > 1
    assert ">mean ΔE 2000, logarithmic<" in svg
    (line,) = re.findall(r'<polyline class="noticed" points="([\d.]+),', svg)
    for kind, x, words in re.findall(r'<text class="small( end)?" x="([\d.]+)"[^>]*>([^<]*)<', svg):
        ends = sorted((float(x), float(x) + (-6.0 if kind else 6.0) * len(words)))
        assert not ends[0] < float(line) < ends[1], words
    (square,) = {*re.findall(r'<(\w+) class="bar b1"', svg)}
    assert square == "rect"


@pytest.mark.parametrize(
    ("value", "words"),
    [(0.0, "0"), (29.2, "29.20"), (24.45, "24.45"), (1234.5, "1234"), (2e-5, "2.000·10⁻⁵")],
)
def test_cells_have_four_digits(value, words):
    (shown, exact, _), *_ = Table("k", "t", "", ("a",), ((value,), (0.5,))).cells()[0]
    assert (shown, exact) == (words, repr(value))


def test_columns_of_whole_numbers_have_no_decimals():
    cells = Table("k", "t", "", ("a", "b"), ((200_000, 9.0), (None, 12.0))).cells()
    assert [[shown for shown, *_ in row] for row in cells] == [["200000", "9"], ["-", "12"]]


def test_an_index_is_lowered():
    svg = str(next(each for each in charts_of(world.report()) if each.key == "profile"))
    assert "R_d" not in svg
    assert '2π r R<tspan class="index" dy="3">d</tspan><tspan dy="-3"> (1/mm)</tspan>' in svg


def test_a_page_knows_itself(tmp_path):
    ours, other = tmp_path / "a.html", tmp_path / "b.html"
    ours.write_text(world.text(), encoding="utf-8")
    other.write_text("<!doctype html><title>mine</title>", encoding="utf-8")
    assert is_report_file(ours)
    assert not is_report_file(other)


def test_the_index_has_a_swatch_of_each_material():
    text = library_page([cli_world.wax()], threads=2)
    assert text.count('class="swatch"') == 1
    assert "<h2>wax</h2>" in text
    (data,) = re.findall(r'id="data">(.*?)</script>', text, re.DOTALL)
    picture = unpacked_picture(json.loads(data)["swatches"][0])
    assert picture.shape == (96, 96, 3)
    assert np.percentile(picture[picture.max(axis=2) > 0.0].max(axis=1), 99.0) > 0.7


def test_a_picture_of_ones_own_comes_first_with_its_pixels(tmp_path):
    light = np.random.default_rng(4).random((40, 30, 3))
    save_image(tmp_path / "face.exr", light, channels=("R", "G", "B"), mm_per_pixel=0.2)
    profile, files = cli_world.profile(), {"irradiance": str(tmp_path / "face.exr")}
    made = make_report(profile, only=["disk"], side=20, threads=1, **files)
    first = made.pictures[0]
    assert (first.key, first.scene.irradiance.shape) == ("own", (20, 15, 3))
    assert made.comparison.mm_per_pixel == pytest.approx(0.4)
    assert made.models is None
    assert made.budgets == ()
    assert "Error budget" not in page(made)


def finished(**more):
    """A small page of a profile, kept in a folder of its own."""
    return finished_page(cli_world.profile(), only=["disk"], side=16, threads=1, **more)


def edged(columns):
    """A picture that is lit on one half."""
    picture = np.zeros((40, columns, 3))
    picture[:20] = 1.0
    return picture


def lasting(told):
    """What lines of a log say, without those that hold for one run."""
    lines = [line.split(": ")[-1] for line in told.splitlines()]
    return [line for line in lines if "Compiling the " not in line]


def test_a_page_is_kept_with_what_was_said(tmp_path, monkeypatch, caplog):
    caplog.set_level("INFO", logger="sssfit")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    save_image(tmp_path / "face.exr", edged(30), mm_per_pixel=0.2)
    first = finished(irradiance=str(tmp_path / "face.exr"))
    told = caplog.text
    assert "scaled down by 3" in told
    assert "scaled down by 3" in first["page"]
    caplog.clear()
    monkeypatch.setattr("sssfit.report.finished.make_report", None)
    assert finished(irradiance=str(tmp_path / "face.exr")) == first
    assert lasting(caplog.text) == lasting(told)
    save_image(tmp_path / "face.exr", edged(31), mm_per_pixel=0.2)
    with pytest.raises(TypeError):  # another picture is another page
        finished(irradiance=str(tmp_path / "face.exr"))


def test_a_damaged_page_is_made_again(tmp_path, monkeypatch, caplog):
    caplog.set_level("INFO", logger="sssfit")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("sssfit.report.finished.page", lambda made: made.name)
    first = finished()
    (path,) = (tmp_path / "pages").glob("*.json")
    raw = bytearray(path.read_bytes())
    raw[40] ^= 1
    path.write_bytes(raw)
    assert finished() == first
    assert path.read_bytes() != raw


def test_the_last_ten_pages_are_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr("sssfit.report.kept.logging.Logger.isEnabledFor", lambda *_: True)
    keys = [page_key({"number": k}) for k in range(12)]
    for k, key in enumerate(keys):
        assert kept(key, lambda k=k: {"made": k}) == {"made": k}
        # Clocks of files tick every few milliseconds: two of these would be of one age.
        os.utime(tmp_path / "pages" / f"{key}.json", (k, k))
    assert {each.stem for each in (tmp_path / "pages").iterdir()} == set(keys[2:])
    for k, key in enumerate(keys[2:], 2):
        assert kept(key, None) == {"made": k}


def test_a_folder_that_cannot_be_written_keeps_nothing(tmp_path, monkeypatch):
    (tmp_path / "pages").write_text("a file")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert kept(page_key({}), lambda: {"made": 1}) == {"made": 1}
    assert (tmp_path / "pages").read_text() == "a file"


def test_the_index_links_to_pages_beside_it(tmp_path):
    (tmp_path / "wax.html").write_text(world.text(), encoding="utf-8")
    assert '<a href="wax.html">wax</a>' in library_page(
        [cli_world.wax()], beside=tmp_path, threads=2
    )
    (tmp_path / "wax.html").write_text("<!doctype html> of somebody else", encoding="utf-8")
    text = library_page([cli_world.wax()], beside=tmp_path, threads=2)
    assert "<a href" not in text
    assert "sssfit report wax" in text


def layered():
    """Two layers of one channel."""
    layers = "".join(
        f"[[layers]]\nsigma_a_per_mm = [{a}]\nsigma_s_per_mm = [2.0]\neta = 1.4\ng = 0.0\n{rest}\n"
        for a, rest in ((0.5, "thickness_mm = 1.0"), (0.1, ""))
    )
    return parse_material(f'channels = ["grey"]\n{layers}', "stack.toml")


def test_a_second_process_changes_nothing_but_seconds(caplog):
    caplog.set_level("INFO", logger="sssfit")
    given = {"only": ["disk"], "side": 16, "photons": 2000}
    found, told = [], []
    for threads in (1, 2):
        caplog.clear()
        made = make_report(layered(), threads=threads, **given)
        rows = [
            {key: value for key, value in row.items() if not re.search("seconds|front", key)}
            for row in made.to_dict()["rows"]
        ]
        found.append({**made.to_dict(), "rows": rows, "charts": str(charts_of(made))})
        lines = [each.getMessage() for each in caplog.records]
        told.append([each for each in lines if not each.startswith("Compiling")])
    assert found[0] == found[1]
    assert told[0] == told[1]


def test_the_table_begins_with_the_front_of_the_first_picture():
    report = world.report()
    table = tables_of(report)[0]
    rows = [dict(zip(table.heads, row, strict=True)) for row in table.rows]
    assert [row["kernel"] for row in rows[: len(report.front)]] == report.front
    assert [row["picture"] for row in rows] == [
        each.name for each in report.comparison.pictures for _ in report.kernels
    ]
    others = [row for row in rows if row["on the front"] == "no"]
    for picture in report.comparison.pictures:
        errors = [row["mean ΔE"] for row in others if row["picture"] == picture.name]
        assert errors == sorted(errors)


def test_one_channel_is_grey():
    made = world.grey()
    reflectance = made.profile.diffuse_reflectance[0]
    assert made.to_dict()["kernels"][0]["albedo"] == [pytest.approx(reflectance)]
    assert "grey" in page(made)


def test_the_commands_of_a_page_are_those_it_was_made_with():
    found = commands_of(
        "my skin.toml",
        is_material=True,
        kernel=["a.taps.json", "b.taps.json"],
        only=["disk", "svd"],
        irradiance=None,
        photons=5000,
    )
    assert found == (
        "sssfit simulate 'my skin.toml' --method exact",
        "sssfit report 'my skin.toml' --kernel a.taps.json --kernel b.taps.json --only disk,svd "
        "--photons 5000",
    )
    assert commands_of("x.npz", is_material=False) == ("sssfit report x.npz",)


@pytest.mark.parametrize("labels", [("mine", "mine"), ("disk 24",)])
def test_kernels_of_one_name_are_refused(labels):
    named = [(each, cli_world.taps()) for each in labels]
    with pytest.raises(KernelError, match=f"two kernels are called {labels[0]}"):
        make_report(cli_world.profile(), named=named, only=["disk"], side=16, threads=1)


def test_every_method_that_can_be_asked_for_has_kernels():
    """Of burley a comparison has the dense kernel only, which no shader runs."""
    found = {each: shown_candidates(41, [each]) for each in FITS}
    assert all(found.values())
    assert [each.label for each in found["burley"]] == [
        f"burley on {taps} taps" for taps in (5, 11, 25)
    ]
    both = [each.method for each in shown_candidates(41, ["burley", "cascade"])]
    assert {*both} == {"burley", "cascade"}


def test_a_method_without_a_kernel_on_these_pixels_is_named(caplog):
    caplog.set_level("INFO", logger="sssfit")
    coarse = {"mm_per_pixel": 4.0, "side": 16, "threads": 1}
    with pytest.raises(FitError, match="no kernel could be fitted"):
        make_report(cli_world.profile(), only=["burley"], **coarse)
    assert "burley is left out: no shader runs a kernel of it on 3 x 3 pixels." in caplog.text


def test_a_page_of_burley():
    made = make_report(cli_world.profile(), only=["burley"], side=16, threads=1)
    assert made.kernels[0].label == "burley on 5 taps"
    assert "--method burley --taps 5 " in made.kernels[0].command


def luminance(colour):
    """WCAG 2.2's relative luminance of a colour such as #1b1c1e."""
    codes = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in codes]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    """WCAG 2.2's contrast ratio."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_black_on_white():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("theme", [0, 1])
def test_words_have_a_contrast_of_4_5_and_marks_of_3(theme):
    """In both themes; WCAG 2.2, 1.4.3 and 1.4.11."""
    style = (STATIC / "style.css").read_text(encoding="utf-8")
    block = re.findall(r":root \{(.*?)\}", style, re.DOTALL)[theme]
    colours = dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", block))
    for ground in ("paper", "card"):
        for words in ("ink", "soft", "accent"):
            assert contrast(colours[words], colours[ground]) >= 4.5, (words, ground)
    assert contrast(colours["ink"], colours["notice"]) >= 4.5
    for mark in ("edge", "c0", "c1", "c2", "m0", "m1", "m2", "m3", "m4", "b0", "b1"):
        assert contrast(colours[mark], colours["card"]) >= 3.0, mark


def test_a_page_of_layers_has_the_models_and_budgets_of_layers(caplog):
    caplog.set_level("INFO", logger="sssfit")
    given = {"only": ["disk"], "side": 16, "threads": 1, "photons": 2000}
    made = make_report(layered(), **given)
    assert made.models is not None
    assert [each.profile.meta["method"] for each in made.models.curves] == [
        *("exact", "montecarlo", "multipole"),
    ]
    assert {each.scene.name for each in made.budgets} == {"disk", "edge"}
    assert made.models.exact.profile is made.profile  # not solved for again
    assert made.profile.meta["method"] == "exact"
    assert caplog.text.count("stack is not one half space: dipole, dipole-grosjean, burley") == 1


def test_what_does_not_cover_a_material_is_left_out_with_a_note(caplog, monkeypatch):
    def refused(*_, **__):
        raise SimulationError("stack is refused.")

    caplog.set_level("INFO", logger="sssfit")
    for each in ("compare_models", "error_budgets", "compute_convergence"):
        monkeypatch.setattr(parts, each, refused)
    exact, walk = world.report().profile, {"photons": 1_000_000, "seed": 1, "threads": 1}
    found = parts.parts_of(layered(), exact, [], walk)
    assert found == (None, (), None)
    for each in ("models", "error budget", "convergence"):
        assert f"The page has no {each}: stack is refused." in caplog.text


def test_passes_are_named_in_words():
    (shown,) = (each for each in world.report().kernels if each.label == world.LABEL)
    labels = [each["label"] for each in shown.to_dict()["plan"]]
    assert labels[:2] == ["stage 1, across", "stage 1, down"]
    assert any(each.startswith("halved, 1/2 of the size") for each in labels)
    assert len(set(labels)) == len(labels)
