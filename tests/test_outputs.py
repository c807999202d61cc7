"""Outputs of every verb: inputs and foreign files stay, whatever name leads to them."""

import os
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from matplotlib.figure import Figure
from reference_pixels import make_profile

from sssfit import files
from sssfit.chart import page
from sssfit.chart.files import is_chart_file
from sssfit.chart.page import save_figure
from sssfit.cli import main
from sssfit.errors import FileError
from sssfit.export import is_ours, kernel_text
from sssfit.fit import fit_svd
from sssfit.formats.csv import csv_text, is_profile_csv
from sssfit.formats.pictures import is_image_file, save_image
from sssfit.kernel import SeparableKernel, is_kernel_file
from sssfit.profile import is_profile_file

posix = pytest.mark.skipif(os.name != "posix", reason="links, pipes and modes are POSIX")

# A verb that writes, and the options that name its outputs; {} is the name.
WRITES = {
    "simulate": ("simulate wax.toml --photons 2000 -q -o {}.npz",),
    "simulate, exact": ("simulate wax.toml --method dipole -o {}.npz",),
    "fit": ("fit wax.profile.npz --method svd --rank 1 -o {}.json",),
    "render": tuple(
        f"render wax.kernel.json --irradiance disk --size 8x8 {option} {{}}.{ending}"
        for option in ("-o", "--truth", "--difference")
        for ending in ("exr", "tif", "png")
    ),
    "compare": (
        *(f"compare wax.profile.npz --chart {{}}.{each}" for each in ("png", "svg", "pdf")),
        *(f"compare wax.profile.npz --table {{}}.{each}" for each in ("md", "csv", "json")),
        "compare wax.toml --budget-chart {}.png",
        "compare wax.profile.npz --what sheet --chart {}.png",
        "compare wax.profile.npz --what front --chart {}.svg",
    ),
    "choose": ("choose wax.toml --irradiance disk -o {}.json",),
    "import": ("import wax.csv -o {}.npz",),
    "export": (
        "export wax.kernel.json --format hlsl -o {}.hlsl",
        "export wax.kernel.json --format json -o {}.json",
        "export wax.profile.npz --format csv -o {}.csv",
    ),
    "chart": tuple(
        f"chart {option} -o {{}}.{ending}"
        for option in (
            "wax.profile.npz",
            "--spectrum wax.profile.npz",
            "--guide wax.profile.npz --mm-per-pixel .2",
            "--models wax.toml",
        )
        for ending in ("png", "svg", "pdf")
    ),
    "materials": (
        "materials --from-reflectance .4 --channels a --mean-free-path 1 --eta 1.3 -o {}.toml",
    ),
}
CALLS = [pytest.param(call, id=call) for calls in WRITES.values() for call in calls]
TOML = """
name = "wax"
channels = ["R"]
eta = 1.3
g = 0.0
sigma_a_per_mm = [0.1]
sigma_s_per_mm = [1.0]
"""


def foreign(ending):
    """A file of somebody else: of the same format, made by other means."""
    drawn = {"png", "svg", "pdf"}
    if ending in drawn:
        path = Path(f"made.{ending}")
        Figure().savefig(path)
        content = path.read_bytes()
        path.unlink()
        return content
    if ending in {"exr", "tif"}:
        spec = OpenImageIO.ImageSpec(4, 4, 3, "float")
        target = OpenImageIO.ImageOutput.create(f"made.{ending}")
        target.open(f"made.{ending}", spec)
        target.write_image(np.zeros((4, 4, 3), np.float32))
        target.close()
        content = Path(f"made.{ending}").read_bytes()
        Path(f"made.{ending}").unlink()
        return content
    return {
        "npz": b"PK\x03\x04 another archive",
        "json": b'{"kernel": [1, 2, 1], "made with": "sssfit.kernel/1 in mind"}\n',
        "csv": b"r_mm,R\n1,.3\n",
        "md": b"# wax: kernels by error and cost\n\nmy notes\n",
        "hlsl": b"// Subsurface scattering kernel: my own\nstatic const float K = 1;\n",
        "toml": TOML.encode(),
    }[ending]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A material, a profile as file and table, and a kernel."""
    folder = tmp_path_factory.mktemp("made")
    r = np.linspace(0.0, 4.0, 41)
    profile = make_profile(r, np.diff(0.5 - 0.5 * np.exp(-r / 0.4))[:, None] * [1.0, 0.5, 0.2])
    profile.save(folder / "wax.profile.npz")
    fit_svd(profile, rank=1, mm_per_pixel=0.2).kernel.save(folder / "wax.kernel.json")
    (folder / "wax.csv").write_text(csv_text(profile))
    (folder / "wax.toml").write_text(TOML)
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(folder, capfd):
    def call(line, *more):
        with pytest.raises(SystemExit) as ended:
            main([*line.split(), *more])
        out, err = capfd.readouterr()
        return ended.value.code, out, err

    return call


def contents(folder):
    return {each.name: each.read_bytes() for each in folder.iterdir() if each.is_file()}


@pytest.mark.parametrize("call", CALLS)
def test_a_foreign_file_of_the_same_format_stays(run, folder, call):
    target = folder / f"theirs.{call.rpartition('.')[2]}"
    target.write_bytes(foreign(target.suffix[1:]))
    before = contents(folder)
    status, out, err = run(call.format("theirs"))
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert err.startswith(f"Error: {target.name} exists and was not written by sssfit as such ")
    assert "--force" in err
    assert contents(folder) == before


QUICK = [
    *WRITES["simulate"],
    *WRITES["simulate, exact"],
    *WRITES["fit"],
    *WRITES["render"],
    *WRITES["import"],
    *WRITES["export"],
    *WRITES["chart"][:3],
    *WRITES["materials"],
    # Another chart in the same files.
    *(pytest.param(each, marks=pytest.mark.slow) for each in WRITES["chart"][3:6]),
]


@pytest.mark.parametrize("call", QUICK)
def test_our_own_files_are_known_again_and_force_replaces_others(run, folder, call, monkeypatch):
    # Half of a chart's time; files are known by other things than where its panels are.
    monkeypatch.setattr(page, "lay_out", lambda figure: figure.set_layout_engine(None))
    target = folder / f"theirs.{call.rpartition('.')[2]}"
    target.write_bytes(foreign(target.suffix[1:]))
    assert run(call.format("theirs"), "--force")[0] == 0
    ours = target.read_bytes()
    assert run(call.format("theirs"))[0] == 0
    assert target.read_bytes() == ours


@pytest.mark.parametrize("number", range(5))
def test_an_input_is_no_output_by_any_name(run, folder, number):
    save_image("in.exr", np.ones((8, 8, 3)), mm_per_pixel=0.2)
    names = [
        "in.exr",
        f"../{folder.name}/in.exr",
        str(folder / "in.exr"),
        "link.exr",
        "hard.exr",
    ]
    Path("link.exr").symlink_to("in.exr")
    Path("hard.exr").hardlink_to("in.exr")
    before = contents(folder)
    status, _, err = run(f"render wax.kernel.json --irradiance in.exr -o {names[number]}")
    assert status == 1
    assert "is read as an input as well; choose another name, or replace it with --force" in err
    assert contents(folder) == before
    assert run(f"render wax.kernel.json --irradiance in.exr -o {names[number]}", "--force")[0] == 0
    assert contents(folder)["in.exr" if number != 4 else "hard.exr"] != before["in.exr"]


@posix
def test_inputs_of_other_verbs_are_no_outputs(run, folder):
    """By the name itself, or by a link whose ending is that of what is written."""
    for link, source in (
        ("of-profile.json", "wax.profile.npz"),
        ("of-material.npz", "wax.toml"),
        ("of-material.json", "wax.toml"),
        ("of-table.npz", "wax.csv"),
    ):
        (folder / link).symlink_to(source)
    for call in (
        "export wax.kernel.json --format json -o wax.kernel.json",
        "fit wax.profile.npz --method svd -o of-profile.json",
        "simulate wax.toml -o of-material.npz",
        "simulate wax.toml --method dipole -o of-material.npz",
        "choose wax.toml -o of-material.json",
        "import wax.csv -o of-table.npz",
    ):
        before = contents(folder)
        status, out, err = run(call)
        assert (status, out, err.count("\n")) == (1, "", 1)
        assert "is read as an input as well" in err
        assert contents(folder) == before


@posix
def test_a_file_that_comes_in_as_stdin_is_no_output(folder):
    before = contents(folder)
    command = f'"{sys.executable}" -m sssfit.cli export - --format json -o wax.kernel.json'
    status = os.system(f"{command} < wax.kernel.json 2> said")
    assert os.waitstatus_to_exitcode(status) == 1
    assert "is read as an input" in (folder / "said").read_text()
    assert contents(folder).items() >= before.items()


def test_two_outputs_into_one_file_are_refused(run, folder):
    for call in (
        "render wax.kernel.json --irradiance disk -o a.exr --truth ./a.exr",
        "render wax.kernel.json --irradiance disk --truth a.png --difference sub/../a.png",
        "compare wax.profile.npz --chart a.png --budget-chart a.png",
    ):
        (folder / "sub").mkdir(exist_ok=True)
        before = contents(folder)
        status, out, err = run(call)
        assert (status, out) == (2, "")
        assert "two outputs name the same file" in err
        assert contents(folder) == before


def test_a_budgets_chart_is_checked_before_the_kernels_are_compared(run, folder, monkeypatch):
    monkeypatch.setattr("sssfit.compare.runner.compare_kernels", pytest.fail)
    (folder / "b.png").write_text("mine")
    assert run("compare wax.profile.npz --picture disk --budget-chart b.png")[0] == 1


def test_a_foreign_checkpoint_stays(run, folder):
    (folder / "a.npz.checkpoint").write_text("mine")
    status, _, err = run("simulate wax.toml --photons 2000 --checkpoint-every 0 -o a.npz")
    assert status == 1
    assert "a.npz.checkpoint exists and was not written by sssfit" in err
    assert run("simulate wax.toml --photons 3e5 --checkpoint-every 0 -o a.npz", "--force")[0] == 0


# What a file system can say before the work


@pytest.mark.parametrize(
    "arguments",
    [
        "simulate wax.toml --photons 2000",
        "fit wax.profile.npz --method svd --rank 1",
        "render wax.kernel.json --irradiance disk --size 8x8",
        "choose wax.toml --irradiance disk",
        "import wax.csv",
        "export wax.kernel.json --format hlsl",
        "chart wax.profile.npz",
        "chart --models wax.toml",
        "materials --from-reflectance .4 --channels a --mean-free-path 1 --eta 1.3",
    ],
)
def test_an_empty_name_is_no_output(run, folder, arguments):
    before = contents(folder)
    status, _, err = run(arguments, "-o", "")  # as a script gives it whose variable is not set
    assert (status, err.count("\n")) == (1, 1)
    assert err.startswith("Error: ")
    assert contents(folder) == before


@posix
def test_links_round_in_a_circle_are_refused(run, folder):
    Path("a.npz").symlink_to("b.npz")
    Path("b.npz").symlink_to("a.npz")
    status, _, err = run("simulate wax.toml --photons 2000 -o a.npz")
    assert (status, err) == (1, "Error: a.npz is a link that leads back to itself; name a file.\n")
    Path("in").symlink_to("in")
    status, _, err = run("simulate wax.toml --photons 2000 -o in/a.npz")
    assert (status, err.count("\n")) == (1, 1)


@posix
def test_a_pipe_is_refused(run, folder):
    os.mkfifo("a.npz")
    status, _, err = run("simulate wax.toml --photons 2000 -o a.npz", "--force")
    assert status == 1
    assert "a.npz is not an ordinary file; name another." in err


@posix
def test_a_write_protected_file_needs_force(folder, monkeypatch):
    path = folder / "wax.profile.npz"
    path.chmod(0o444)
    real = os.access  # root may write anywhere
    monkeypatch.setattr(os, "access", lambda of, mode: real(of, mode) and of != path)
    with pytest.raises(
        FileError, match=r"is write-protected; choose .* or replace it with `force = True`"
    ):
        files.check_output(path, is_profile_file)
    files.check_output(path, is_profile_file, force=True)


@posix
def test_a_file_that_only_its_owner_may_replace_is_refused_even_by_force(folder, monkeypatch):
    path = folder / "wax.profile.npz"
    folder.chmod(0o1777)
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    with pytest.raises(FileError, match="belongs to somebody else, and only the owner may"):
        files.check_output(path, is_profile_file, force=True)
    folder.chmod(0o755)
    files.check_output(path, is_profile_file, force=True)


# Marks


def test_every_kind_is_told_from_every_other(folder):
    kernel = SeparableKernel.load("wax.kernel.json")
    (folder / "a.hlsl").write_text(kernel_text(kernel, "hlsl")[0])
    for ending in ("exr", "tif", "png"):
        save_image(f"picture.{ending}", np.ones((300, 300, 3)))
    for ending in ("png", "svg", "pdf"):
        save_figure(Figure(), f"chart.{ending}")
    kinds = {
        is_profile_file: {"wax.profile.npz"},
        is_kernel_file: {"wax.kernel.json"},
        partial(is_ours, form="hlsl"): {"a.hlsl"},
        is_profile_csv: {"wax.csv"},
        is_image_file: {f"picture.{each}" for each in ("exr", "tif", "png")},
        is_chart_file: {f"chart.{each}" for each in ("png", "svg", "pdf")},
    }
    for is_own, own in kinds.items():
        assert {each.name for each in folder.iterdir() if is_own(each)} == own
        assert not is_own(folder / "missing")
        assert not is_own(folder)


def test_a_mark_is_found_near_either_end_and_nowhere_else(tmp_path):
    path = tmp_path / "a"
    for before, after, is_found in (
        (0, 10**6, True),
        (10**6, 0, True),
        (60_000, 10_000, True),
        (70_000, 1_000, True),
        (500_000, 500_000, False),
    ):
        path.write_bytes(b"%P" + bytes(before) + b"mark" + bytes(after))
        assert files.has_mark(path, {b"%P": b"mark"}) is is_found
        assert not files.has_mark(path, {b"%Q": b"mark"})
