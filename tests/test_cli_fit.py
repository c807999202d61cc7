"""``sssfit fit`` and ``sssfit export`` of kernels: files, figures, one line for what is wrong."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from reference_pixels import make_profile

from sssfit.cli import cli, main
from sssfit.fit import METHODS
from sssfit.kernel import SeparableKernel
from sssfit.methods import FITS, SEPARABLE


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty current folder with a small profile."""
    monkeypatch.chdir(tmp_path)
    r = np.linspace(0.0, 4.0, 41)
    energy = np.diff(0.5 - 0.5 * np.exp(-(r**2) / 0.5))[:, None] * [1.0, 0.5]
    make_profile(r, energy).save("wax.profile.npz")
    return tmp_path


def ended(*arguments):
    """What a command ended with: exit status, stdout, stderr."""
    return CliRunner().invoke(cli, arguments)


def failed(capsys, *arguments):
    """Exit status and stderr of the whole program."""
    with pytest.raises(SystemExit) as ending:
        main(arguments)
    return ending.value.code, capsys.readouterr().err


def test_a_session_from_profile_to_shader(folder):
    assert ended("fit", "--method", "preintegrated").exit_code == 0
    kernel = SeparableKernel.load("wax.preintegrated.kernel.json")
    assert kernel.mm_per_pixel == 0.3
    assert ended("export", "--format", "hlsl").exit_code == 0
    assert (
        (folder / "wax.preintegrated.hlsl")
        .read_text()
        .startswith("// sssfit.hlsl/1\n// Subsurface")
    )
    assert ended("export", "--format", "json").exit_code == 0
    assert json.loads((folder / "wax.preintegrated.json").read_text())["pixels"] == kernel.pixels


def test_the_pitch_of_the_profile_on_request(folder):
    own = ended("fit", "--method", "preintegrated", "--mm-per-pixel", "profile", "--json")
    assert json.loads(own.stdout)["mm_per_pixel"] == pytest.approx(0.1)
    wrong = ended("fit", "--method", "preintegrated", "--mm-per-pixel", "kernel")
    assert wrong.exit_code == 2
    assert "'kernel' is not a length above 0, such as 0.05, 3cm or 0.6m, or profile." in (
        " ".join(wrong.stderr.split())
    )


def test_json_has_the_figures(folder):
    result = ended("fit", "wax.profile.npz", "--method", "preintegrated", "--json")
    figures = json.loads(result.stdout)
    for key in (
        *("method", "rank", "mm_per_pixel", "support_mm", "pixels", "taps", "seconds"),
        *("relative_frobenius_error", "energy_error", "stop_reason", "command", "output"),
    ):
        assert key in figures
    assert figures["stop_reason"] == ["closed form"] * 2
    assert figures["pixels"] == 2 * round(figures["support_mm"] / figures["mm_per_pixel"]) + 1


def test_normalised_kernels_keep_their_energy_apart(folder):
    ended("fit", "--method", "preintegrated", "--normalize")
    kernel = SeparableKernel.load("wax.preintegrated.kernel.json")
    np.testing.assert_allclose(kernel.energy, 1.0, rtol=1e-12)
    np.testing.assert_allclose(kernel.scale, [0.5, 0.25], rtol=2e-3)


# A single Gaussian leaves nothing to several, and nothing of some shapes; both are warned of.
@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
@pytest.mark.parametrize(
    ("method", "options", "counted"),
    [
        *(("svd", given, "rank") for given in ([], ["--rank", "2"])),
        *(("gaussians", given, "terms") for given in ([], ["--terms", "2"])),
        *(("weighted", given, "rank") for given in ([], ["--rank", "1"])),
        *((method, [], None) for method in METHODS if not SEPARABLE[method].counted),
    ],
)
def test_the_files_name_has_the_method_and_the_count_that_was_fitted(
    folder, method, options, counted
):
    result = ended("fit", "--method", method, *options, "--mm-per-pixel", "0.4", "--json")
    (name,) = json.loads(result.stdout)["output"]
    kernel = SeparableKernel.load(name)
    count = "" if counted is None else kernel.meta["settings"][counted]
    assert name == f"wax.{kernel.method}{count}.kernel.json"


def test_list_has_a_line_for_each_method(folder):
    lines = ended("fit", "--list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(FITS)
    for line, method in zip(lines, FITS.values(), strict=True):
        assert line.endswith(method.summary)


def test_kernel_goes_to_stdout_and_words_to_stderr(folder):
    result = ended("fit", "--method", "preintegrated", "-o", "-")
    assert json.loads(result.stdout)["format"] == "sssfit.kernel/1"
    assert "Frobenius" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "status", "word"),
    [
        (("fit", "--rank", "3"), 2, "this is cascade"),
        (("fit", "--taps", "9"), 2, "this is cascade"),
        (("fit", "--method", "svd", "--taps", "8"), 1, "odd number"),
        (("fit", "--method", "svd", "--place", "quadratic"), 1, "number as --taps"),
        (("fit", "--method", "svd", "--taps", "9", "--normalize"), 2, "--normalize is for"),
        (("fit", "--method", "preintegrated", "--mm-per-pixel", "0"), 2, "length"),
        (("fit", "--method", "preintegrated", "--mm-per-pixel", "1e-9"), 1, "GB"),
        (("fit", "gone.profile.npz", "--method", "preintegrated"), 1, "gone.profile.npz"),
        (("export", "wax.profile.npz", "--format", "hlsl"), 1, "kernel"),
        (("export", "--format", "hlsl"), 1, "sssfit fit"),
    ],
)
def test_bad_input_gets_one_line(folder, capsys, arguments, status, word):
    code, text = failed(capsys, *arguments)
    assert code == status
    assert word in text.splitlines()[-1]
    assert "Traceback" not in text


def test_a_foreign_file_is_not_replaced(folder, capsys):
    (folder / "wax.preintegrated.kernel.json").write_text("mine")
    code, text = failed(capsys, "fit", "--method", "preintegrated")
    assert code == 1
    assert "--force" in text
    assert (folder / "wax.preintegrated.kernel.json").read_text() == "mine"


# Normalised diffusion is nothing like the Gaussian that it is fitted to here, and says so.
@pytest.mark.filterwarnings("ignore:.* the burley kernel is farther")
@pytest.mark.filterwarnings("ignore:.*stress")  # of few terms and few photons
@pytest.mark.parametrize("method", ["svd", "gaussians", "preintegrated", "burley"])
def test_energy_is_restored_or_kept_as_asked(folder, method):
    short = ("--support", "0.5", "--mm-per-pixel", "0.1")
    kernels = {}
    for energy in ("rescale", "keep"):
        result = ended("fit", "--method", method, "--energy", energy, *short, "--json")
        (path,) = json.loads(result.stdout)["output"]
        kernels[energy] = SeparableKernel.load(path)
        assert kernels[energy].meta["settings"]["energy"] == energy
    ended("fit", "--method", method, *short)
    assert SeparableKernel.load(path).to_dict() == kernels["rescale"].to_dict()
    np.testing.assert_allclose(kernels["rescale"].energy_error, 0.0, atol=1e-9)
    assert (kernels["keep"].energy_error < -0.05).all()


@pytest.mark.parametrize("method", ["guided", "artist", "falloff"])
def test_methods_that_always_keep_the_energy_have_no_option_for_it(folder, capsys, method):
    code, text = failed(capsys, "fit", "--method", method, "--energy", "keep")
    assert code == 2
    assert "--energy is for --method svd or gaussians or preintegrated or burley" in text
