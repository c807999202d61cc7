"""`sssfit.load` reads any file of ours by what it holds; each kind has figures and a page."""

import io

import cli_world as world
import pytest

import sssfit
from sssfit.errors import FileError, SssfitError
from sssfit.export.summary import figures_of, summary
from sssfit.fit import fit_taps
from sssfit.formats.mci import load_mci
from sssfit.kernel import SeparableKernel
from sssfit.kinds import KINDS, load
from sssfit.simulate import simulate_to_files
from sssfit.sweep import load_plan


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """One file of every kind, under a name that says nothing."""
    folder = tmp_path_factory.mktemp("kinds")
    world.profile().save(folder / "profile")
    world.kernel().save(folder / "kernel")
    fit_taps(world.profile(), stages="1", mm_per_pixel=0.6).kernel.save(folder / "taps")
    (folder / "material").write_text(world.WAX)
    asked = iter([False] * 6)
    settings = {"photons": 10**9, "threads": 1, "dr_mm": 0.4, "radius_mm": 8.0}
    stopped = lambda: next(asked, True)  # noqa: E731
    simulate_to_files([world.wax()], [folder / "walk.npz"], settings=settings, stop=stopped)
    (folder / "walk.npz.checkpoint").rename(folder / "checkpoint")
    return folder


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_kind_is_told_by_what_it_holds(files, kind):
    path = files / kind
    found = sssfit.load(path)
    assert type(found) is type(load(io.BytesIO(path.read_bytes())))
    assert figures_of(found) == figures_of(sssfit.load(str(path)))
    assert figures_of(found)["kind"] == kind
    assert len(summary(figures_of(found)).splitlines()) > 5


@pytest.mark.parametrize("kind", ["kernel", "taps"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_json_is_read_as_shells_and_editors_of_windows_pass_it_on(files, kind, encoding):
    text = (files / kind).read_text("utf-8")
    found = load(io.BytesIO(text.encode(encoding)))
    assert figures_of(found) == figures_of(sssfit.load(files / kind))


def test_a_stream_need_not_seek(files):
    class Pipe(io.RawIOBase):
        def __init__(self, content):
            self.rest = io.BytesIO(content)

        def readable(self):
            return True

        def readinto(self, buffer):
            return self.rest.readinto(buffer)

    found = load(io.BufferedReader(Pipe((files / "profile").read_bytes())))
    assert found.to_dict() == world.profile().to_dict()


def test_what_is_foreign_is_refused_by_its_name():
    with pytest.raises(FileError, match=r"the stream is not a sssfit file; expected a profile"):
        load(io.BytesIO(b"mine\n"))
    with pytest.raises(FileError, match=r"skin11 cannot be read: .*did you mean skin1\?"):
        load("skin11")
    assert load("skin1").name == "skin1"
    with pytest.raises(FileError, match="deon-skin has no coefficients and no file; simulate it"):
        load("deon-skin")
    for source in (3, None, b"art.toml"):
        with pytest.raises(FileError, match="is not a path; expected one, or a binary stream"):
            load(source)


def test_an_empty_name_is_called_one():
    for read in (load, load_mci, load_plan):
        with pytest.raises(SssfitError, match=r"the name '' is empty; name an? "):
            read("")


def test_a_path_stays_on_its_line():
    for read in (load, SeparableKernel.load):
        with pytest.raises(SssfitError, match=r"^a\\nb: no such file|^a\\nb cannot be read"):
            read("a\nb")
