"""Where machine code is kept: keyed by every source, where the user says, or nowhere at all."""

import ctypes
import errno
import io
import os
import random
import shutil
import subprocess
import sys
import types
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from llvmlite.binding.targets import FeatureMap
from numba.core.registry import cpu_target

from sssfit import __version__, _jit, process
from sssfit._jit import depth_matrix, half_space_walk, layered_walk, machine_code, pixel_energy
from sssfit.errors import SssfitError

SOURCES = Path(_jit.__file__).parent


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A copy of the compiled layer's sources, of which the key is made."""
    folder = tmp_path / "sources"
    shutil.copytree(SOURCES, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(_jit, "__file__", str(folder / "__init__.py"))
    return folder


def python(code, **environment):
    """What a fresh process prints."""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr == ""
    return ended.stdout.split()


def test_key_follows_every_source(sources, monkeypatch):
    source_key = _jit.source_key.__wrapped__  # without its memory
    key = source_key()
    assert key.startswith(f"{__version__}-")
    for path in sorted(sources.glob("*.py")):
        before = path.read_bytes()
        path.write_bytes(before.replace(b"a", b"b", 1))
        assert source_key() != key, path.name
        path.write_bytes(before)
        assert source_key() == key
    (sources / "more.py").write_bytes(b"")
    assert source_key() != key
    (sources / "more.py").unlink()
    monkeypatch.setattr(_jit, "__version__", "0.0.0")
    assert source_key() == key.replace(__version__, "0.0.0", 1)


def test_folder_is_the_users(tmp_path, monkeypatch):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    for platform, variable, without in (
        ("linux", "XDG_CACHE_HOME", Path(".cache", "sssfit")),
        ("darwin", None, Path("Library", "Caches", "sssfit")),
        ("win32", "LOCALAPPDATA", Path("AppData", "Local", "sssfit", "cache")),
    ):
        with monkeypatch.context() as here:
            here.setattr(process.sys, "platform", platform)
            assert process.user_cache_folder() == tmp_path / "home" / without
            if variable:
                here.setenv(variable, str(tmp_path / "base"))
                found = process.user_cache_folder().relative_to(tmp_path / "base")
                assert without.parts[-len(found.parts) :] == found.parts
            here.setenv("NUMBA_CACHE_DIR", str(tmp_path / "chosen"))
            assert process.user_cache_folder() == tmp_path / "chosen"


def test_folder_is_made_and_left_empty(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "a" / "b"))
    folder = Path(_jit._writable_cache_folder())
    assert folder == tmp_path / "a" / "b" / _jit.source_key()
    assert list(folder.iterdir()) == []


def test_no_folder_where_nothing_can_be_written(tmp_path, monkeypatch):
    # there, as on a read-only disk, but it takes no file
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert _jit._writable_cache_folder()

    def refusing(real):
        def opens(path, *arguments, **keywords):
            if str(path).startswith(str(tmp_path)):
                raise OSError(errno.EROFS, os.strerror(errno.EROFS))
            return real(path, *arguments, **keywords)

        return opens

    monkeypatch.setattr(os, "open", refusing(os.open))
    monkeypatch.setattr(io, "open", refusing(io.open))
    assert _jit._writable_cache_folder() == ""


def test_no_folder_without_a_home(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert _jit._writable_cache_folder() == ""


def test_machine_code_goes_there_and_numbas_own_setting_is_put_back(tmp_path, monkeypatch):
    monkeypatch.setattr(_jit, "_CACHE_FOLDER", str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "the host program's")

    @_jit.jit
    def three(x):
        return 3 * x

    assert numba.config.CACHE_DIR == "the host program's"
    assert three(2) == 6
    assert list(tmp_path.rglob("*.nbc"))
    with pytest.raises(TypeError):
        _jit.jit(3)
    assert numba.config.CACHE_DIR == "the host program's"


TWICE = """
from sssfit._jit.sampling import splitmix64
print(int(splitmix64(1)))
_, hits, misses = splitmix64.stats
print(sum(hits.values()), sum(misses.values()))
"""


def test_a_second_process_does_not_compile_again(tmp_path):
    cache = {"NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = python(TWICE, **cache), python(TWICE, **cache)
    assert [each.name for each in tmp_path.iterdir()] == [_jit.source_key()]
    assert first[0] == second[0]
    assert (first[1:], second[1:]) == (["0", "1"], ["1", "0"])


# The closed forms take half as long to compile as the walk.
FORMS = """
import numpy as np
from sssfit import _jit
from sssfit._jit.pixel_energy import quadrant_energy
print(repr(_jit._CACHE_FOLDER))
radii = np.linspace(0.1, 2.0, 20)
energy = quadrant_energy(radii, np.exp(-radii)[:, None] * [1.0, 0.5], 0.3, 6)
print(energy.tobytes().hex())
"""


def test_without_a_folder_code_is_compiled_anew_and_right(tmp_path):
    # a file stands where the folder should: not even root can make it
    (tmp_path / "file").write_bytes(b"")
    folder, energy = python(FORMS, NUMBA_CACHE_DIR=str(tmp_path / "file"))
    assert folder == "''"
    radii = np.linspace(0.1, 2.0, 20)
    densities = np.exp(-radii)[:, None] * [1.0, 0.5]
    expected = pixel_energy.quadrant_energy(radii, densities, 0.3, 6)
    np.testing.assert_array_equal(np.frombuffer(bytes.fromhex(energy)), expected.ravel())
    assert (tmp_path / "file").read_bytes() == b""


WALK = """
from sssfit import _jit
from sssfit.material import load_material
from sssfit.simulate import simulate_montecarlo
print(repr(_jit._CACHE_FOLDER))
profile = simulate_montecarlo(load_material("skin1"), photons=1000)
print(profile.annulus_energy.tobytes().hex())
"""


# Damage. In a process of its own: before the files had checksums, a flipped bit crashed it.

FLIPS = """
import random, sys
from pathlib import Path
from sssfit import _jit

folder, flips, chance = Path(sys.argv[1]), int(sys.argv[2]), random.Random(1)
_jit._CACHE_FOLDER = str(folder)

def tripled(x):
    return 3 * x + 1

def run():
    compiled = _jit.jit(tripled)
    assert compiled(2) == 7
    return sum(compiled.stats.cache_hits.values())

assert (run(), run()) == (0, 1)
files = sorted(each for each in folder.rglob("*") if each.is_file())
whole = {each: each.read_bytes() for each in files}
for file in files:
    size = len(whole[file])
    damaged = [whole[file][:k] for k in (0, 1, 31, 32, 33, size - 1)]
    for place in (0, 31, 32, size - 1, *(chance.randrange(size) for _ in range(flips))):
        content = bytearray(whole[file])
        content[place] ^= 1 << chance.randrange(8)
        damaged.append(bytes(content))
    for content in damaged:
        file.write_bytes(content)
        assert run() == 0, (file.name, len(content))  # compiled again, not loaded
        assert run() == 1  # and mended
        assert sorted(each for each in folder.rglob("*") if each.is_file()) == files
        for each in files:
            each.write_bytes(whole[each])
print(*(each.suffix for each in files), len(damaged))
"""


@pytest.mark.parametrize("flips", [10, pytest.param(40, marks=pytest.mark.slow)])
def test_a_flipped_bit_in_any_file_is_compiled_again(tmp_path, flips):
    (tmp_path / "flips.py").write_text(FLIPS, encoding="utf-8")
    (tmp_path / "cache").mkdir()
    ended = subprocess.run(
        [sys.executable, tmp_path / "flips.py", tmp_path / "cache", str(flips)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.split() == [".nbc", ".nbi", str(10 + flips)]


# Machine code that is loaded without numba


ENTRIES = (depth_matrix, half_space_walk, layered_walk, pixel_energy)
WITHOUT_NUMBA = """
import sys
from sssfit.fit import fit
from sssfit.material import load_material
from sssfit.simulate import simulate_exact, simulate_montecarlo
for name in ("skin1", "skin-melanin-12"):
    simulate_montecarlo(load_material(name), photons=1000, threads=2)
print(*(name for name in ("numba", "scipy") if name in sys.modules))
fit(simulate_exact(load_material("skin1"), tolerance=0.1, threads=2), "svd", rank=3)
print(*(name for name in ("numba",) if name in sys.modules))
"""


def test_what_was_compiled_before_needs_no_numba():
    for each in ENTRIES:
        each.ENTRY.load()
        assert each.ENTRY.is_ready()
    assert python(WITHOUT_NUMBA) == []


@pytest.fixture
def tripled(tmp_path, monkeypatch):
    """An entry of a module of its own, which keeps its code in a folder of its own."""
    monkeypatch.setattr(_jit, "_CACHE_FOLDER", str(tmp_path / "code"))
    (tmp_path / "code").mkdir()
    module = types.ModuleType("sssfit._jit.tripled")
    module.enter = lambda x, values, count: 3 * x + int(numba.carray(values, count, np.float64)[1])
    monkeypatch.setitem(sys.modules, module.__name__, module)
    arguments = ctypes.c_int64, machine_code.Array(np.float64), ctypes.c_int64
    return lambda: machine_code.Entry("tripled", arguments)


def result_of(entry):
    return entry(2, np.array([0.0, 1.0]), 2)


def test_an_entry_is_compiled_once_and_then_read(tripled, monkeypatch):
    first, second = tripled(), tripled()
    assert not first.is_ready()
    assert result_of(first) == 7
    assert first.is_ready()
    assert second.is_ready()
    monkeypatch.delitem(sys.modules, "sssfit._jit.tripled")  # what would be compiled is gone
    assert result_of(second) == 7
    (kept,) = first.path().parent.iterdir()
    assert kept.name.startswith("tripled-")


def test_what_an_entry_is_given_is_checked(tripled):
    entry = tripled()
    for wrong in (np.zeros(2, np.float32), np.zeros((2, 2)), np.zeros(4)[::2], [0.0, 1.0]):
        with pytest.raises((TypeError, ctypes.ArgumentError)):
            entry(2, wrong, 2)


def test_an_entry_takes_arrays_that_are_read_only_or_empty(tripled):
    fixed = np.array([0.0, 1.0])
    fixed.flags.writeable = False
    assert tripled()(2, fixed, 2) == 7
    kind = machine_code.Array(np.float64)
    assert kind.from_param(np.zeros(0)) is not None


def test_without_a_folder_an_entry_is_compiled_all_the_same(tripled, monkeypatch):
    monkeypatch.setattr(_jit, "_CACHE_FOLDER", "")
    entry = tripled()
    assert entry.path() is None
    assert result_of(entry) == 7


def test_an_entry_says_that_it_cannot_do_without_compiling(tripled, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    for asked in (tripled().load, tripled().is_ready):
        with pytest.raises(SssfitError, match=r"NUMBA_DISABLE_JIT is set, .* unset it\.$"):
            asked()


# An entry and its helper, which take .2 s to compile where the library's take 1.5 s and more.
PICKING = """
import numpy as np
from numba import carray
from sssfit._jit import jit

@jit
def picked(values, k):
    return values[k]

def enter(k, values):
    return int(picked(carray(values, (3,), np.float64), k))
"""
LOADING = """
import sys
from ctypes import c_int64
import numpy as np
from sssfit import _jit
from sssfit._jit.machine_code import Array, Entry
from sssfit.errors import SssfitError

_jit.__path__.append({folder!r})
picking = Entry("picking", (c_int64, Array(np.float64)))
try:
    assert picking(1, np.array([5.0, 6.0, 7.0])) == 6
    print("numba" in sys.modules)
except SssfitError as error:
    print(error)
"""


@pytest.mark.parametrize(
    "setting",
    [
        "NUMBA_BOUNDSCHECK=1",
        pytest.param("NUMBA_DEBUGINFO=1", marks=pytest.mark.slow),
        pytest.param("NUMBA_OPT=0", marks=pytest.mark.slow),
    ],
)
def test_settings_that_change_code_are_refused_and_leave_nothing_behind(tmp_path, setting):
    """Helpers with bounds checks were linked into the code of later runs without them."""
    own = dict([setting.split("=")])
    (tmp_path / "picking.py").write_text(PICKING, encoding="utf-8")
    loading, cache = LOADING.format(folder=str(tmp_path)), str(tmp_path / "cache")
    refused = python(loading, NUMBA_CACHE_DIR=cache, **own)
    assert " ".join(refused).startswith(f"with {setting} the code of walks and kernels would need")
    assert python(loading, NUMBA_CACHE_DIR=cache) == ["True"]  # compiled
    assert python(loading, NUMBA_CACHE_DIR=cache, **own) == ["False"]  # and read


def test_code_of_a_process_whose_numba_knows_less_is_kept_and_found(tripled, monkeypatch):
    """A host program may have used numba before, which then makes narrower vectors."""
    less = cpu_target.target_context.codegen().magic_tuple()[2]
    monkeypatch.setattr(machine_code, "processor_features", lambda: "+sse2")
    monkeypatch.setattr(machine_code, "own_features", lambda: less)
    assert result_of(tripled()) == 7
    assert tripled().is_ready()
    assert tripled().path(less).exists()
    assert not tripled().path().exists()


def test_threads_that_call_an_entry_at_once_load_it_once(tripled, monkeypatch):
    entry, links, real = tripled(), [], machine_code.Entry._link

    def counted(self, code):
        links.append(code)
        return real(self, code)

    monkeypatch.setattr(machine_code.Entry, "_link", counted)
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(lambda _: result_of(entry), range(32))) == [7] * 32
    assert len(links) == 1


def test_another_processor_has_a_file_of_its_own(tripled, monkeypatch):
    ours = tripled().path()
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "-avx")
    theirs = tripled().path()
    assert theirs.parent == ours.parent
    assert theirs != ours


def test_features_are_numbas_setting_or_the_processors_with_its_widest_vectors(monkeypatch):
    monkeypatch.delenv("NUMBA_CPU_FEATURES", raising=False)
    for found, expected in (
        ({"avx2": True, "avx512f": True, "prefer-256-bit": True}, {"-prefer-256-bit", "+avx512f"}),
        ({"avx2": True, "avx512f": False}, {"+avx2", "-avx512f"}),
    ):
        monkeypatch.setattr(llvm, "get_host_cpu_features", lambda found=found: FeatureMap(found))
        features = set(machine_code.processor_features().split(","))
        assert features >= expected
        assert ("-prefer-256-bit" in features) == found["avx512f"]

    def unknown():
        raise RuntimeError("LLVM reports no features of this processor")

    monkeypatch.setattr(llvm, "get_host_cpu_features", unknown)
    assert machine_code.processor_features() == ""
    monkeypatch.setenv("NUMBA_CPU_FEATURES", "+sse2")
    assert machine_code.processor_features() == "+sse2"


def test_a_flipped_bit_in_machine_code_is_compiled_again(tripled):
    assert result_of(tripled()) == 7
    (path,) = tripled().path().parent.iterdir()
    chance = random.Random(3)
    whole = path.read_bytes()
    damaged = [whole[:k] for k in (0, 1, 31, 32, 33, len(whole) - 1)]
    for _ in range(4):
        content = bytearray(whole)
        content[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        damaged.append(bytes(content))
    for content in damaged:
        path.write_bytes(content)
        entry = tripled()
        assert not entry.is_ready()
        assert result_of(entry) == 7
        assert tripled().is_ready()  # and mended


def test_code_that_could_ask_for_python_is_refused(tripled, monkeypatch):
    def fails(x, values, count):
        if x < 0:
            raise ValueError
        return x + int(np.zeros(count)[0])

    monkeypatch.setattr(sys.modules["sssfit._jit.tripled"], "enter", fails)
    with pytest.raises(TypeError, match=r"needs .*(Py|NRT_)"):
        tripled().load()


@pytest.mark.slow
def test_a_flipped_bit_in_the_cache_of_the_walk_changes_nothing(tmp_path):
    cache = tmp_path / "cache"
    expected = python(WALK, NUMBA_CACHE_DIR=str(cache))
    whole = {each: each.read_bytes() for each in cache.rglob("*.o")}
    chance = random.Random(2)
    for file in [*whole, *chance.choices(list(whole), k=20)]:
        content = bytearray(whole[file])
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        file.write_bytes(content)
        assert python(WALK, NUMBA_CACHE_DIR=str(cache)) == expected
        for each, bytes_of_it in whole.items():
            each.write_bytes(bytes_of_it)
