"""What an unlucky user meets: devices for files, closed streams, links, a damaged cache."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sssfit import _jit, files
from sssfit._jit.pixel_energy import ENTRY
from sssfit.errors import FileError, ProfileError, SimulationError
from sssfit.material import load_material
from sssfit.profile import Profile
from sssfit.simulate import simulate, simulate_montecarlo

posix = pytest.mark.skipif(os.name != "posix", reason="devices and descriptors are POSIX")


def sssfit(folder, *arguments, redirect="", **environment):
    """Run the command line under a shell with a redirection; give status, stdout and stderr."""
    command = f'exec "{sys.executable}" -m sssfit.cli {" ".join(arguments)} {redirect}'
    ended = subprocess.run(
        ["sh", "-c", command],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )
    return ended.returncode, ended.stdout, ended.stderr


@posix
def test_devices_and_pipes_are_no_outputs_even_by_force(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/null"), tmp_path / "pipe"):
        with pytest.raises(FileError, match="is not an ordinary file"):
            files.check_output(path, lambda _: True, force=True)


@posix
def test_devices_and_pipes_are_no_profiles(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        with pytest.raises(ProfileError, match="is not an ordinary file"):
            Profile.load(path)


@posix
def test_closed_streams_are_said_before_the_work(tmp_path):
    for arguments, redirect, fragment in (
        (("simulate", "skin1", "-o", "-"), ">&-", "stdout is closed"),
        (("simulate", "-"), "<&-", "stdin is closed"),
        (("show", "-"), "<&-", "stdin is closed"),
    ):
        status, _, err = sssfit(tmp_path, *arguments, redirect=redirect)
        assert status == 1
        assert fragment in err
        assert err.count("\n") == 1


@posix
def test_a_link_is_followed_and_a_mode_is_kept(tmp_path):
    real, link = tmp_path / "real.npz", tmp_path / "link.npz"
    real.write_bytes(b"old")
    real.chmod(0o600)
    link.symlink_to(real)
    files.write_atomically(link, lambda stream: stream.write(b"new"))
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    assert real.stat().st_mode & 0o777 == 0o600


def test_a_name_too_long_to_write_is_refused_before_the_work(tmp_path):
    # 245 letters are legal, the temporary file's 14 more are not
    with pytest.raises(FileError, match="too long"):
        files.check_output(tmp_path / ("a" * 241 + ".npz"), lambda _: True)


def test_whole_numbers_of_any_kind_and_no_others():
    skin = load_material("skin1")
    profile = simulate_montecarlo(skin, photons=np.int64(2000), seed=np.uint8(3))
    same = simulate_montecarlo(skin, photons=2000, seed=3)
    assert profile.annulus_energy.tobytes() == same.annulus_energy.tobytes()
    for wrong in ({"seed": 1.5}, {"seed": None}, {"photons": "1e5"}, {"threads": 1.0}):
        with pytest.raises(SimulationError, match="give a whole number"):
            simulate_montecarlo(skin, **wrong)
    with pytest.raises(SimulationError, match="is not a Material"):
        simulate_montecarlo("skin1")


def test_a_grid_too_large_names_the_material_and_its_lengths():
    with pytest.raises(SimulationError, match=r"skin1: the grid .* mean free paths from 0\.671 to"):
        simulate_montecarlo(load_material("skin1"), dr_mm=1e-6)


def test_a_damaged_cache_is_a_miss_and_mends_itself(tmp_path):
    """The closed forms of kernels, say, which take half as long to compile as a walk."""
    cache = tmp_path / "cache"
    simulate(load_material("skin1"), "dipole").save(tmp_path / "skin1.profile.npz")
    run = ("fit", "skin1.profile.npz", "--method", "svd", "-o", "kernel.json", "--force", "-q")
    ENTRY.load()  # what this run of the tests has compiled need not be compiled for a copy
    copy = cache / _jit.source_key()
    copy.mkdir(parents=True)
    for kept in Path(_jit.cache_folder()).glob("pixels-*.o") if _jit.cache_folder() else ():
        shutil.copyfile(kept, copy / kept.name)
    assert sssfit(tmp_path, *run, NUMBA_CACHE_DIR=str(cache)) == (0, "", "")
    good = (tmp_path / "kernel.json").read_bytes()
    whole = {each: each.stat().st_size for each in copy.glob("pixels-*.o")}
    for each, size in whole.items():
        os.truncate(each, size // 2)
    for _ in range(2):
        assert sssfit(tmp_path, *run, NUMBA_CACHE_DIR=str(cache)) == (0, "", "")
        assert (tmp_path / "kernel.json").read_bytes() == good
        assert any(each.stat().st_size > size // 2 for each, size in whole.items())
