"""Saves the sums of a walk at intervals, so that a killed run can be resumed.

A checkpoint is the result of a shorter run: the ledger summed over whole batches, its photons, and
a fingerprint of everything that determines the bits of these batches. The number of remaining
photons is not part of it, so a run may be resumed with more photons or a smaller target error, and
ends in the same bits as a run with those settings from the start. The materials are stored in full,
so that ``_so_far`` can make profiles from the file alone.

The lock on its output decides which run may write a checkpoint (see ``sssfit.files.locked``); this
module does not lock.
"""

import contextlib
import io
import json
import math
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from sssfit._jit import source_key
from sssfit.errors import FileError, SimulationError, SssfitWarning
from sssfit.files import has_mark, is_marked, reason, remove_leftovers, write_atomically
from sssfit.grid import RadialGrid
from sssfit.kinds import KINDS
from sssfit.material import Material
from sssfit.messages import printable, shown
from sssfit.profile.npz import read_npy
from sssfit.simulate._directions import Directions
from sssfit.simulate._walks import BATCH_PHOTONS, MAX_PHOTONS, Tally

FORMAT = "sssfit.checkpoint/1"
_MARKS = KINDS["checkpoint"].marks
# At most this much work is lost. skin1's checkpoint takes 1 ms to write, the largest (64 channels
# of 100 000 annuli, 100 MB) a quarter of a second.
EVERY_SECONDS = 30.0
_MAX_META_BYTES = 16_000_000  # numpy's text has 4 bytes a character
_HEADER_BYTES = 10_000  # numpy's own limit


@dataclass(slots=True)
class State:
    """State of a walk: its sums, the least error of any check so far, seconds of all runs together.

    The least error shows whether a run with a given target would have ended earlier.
    """

    tally: Tally
    least_error: float = math.inf
    seconds: float = 0.0


@dataclass(slots=True)
class Checkpoint:
    """Where and how often a walk saves its sums, and whether it continues from saved ones.

    Parameters
    ----------
    path : Path
        By convention the output's name followed by ``.checkpoint``.
    every_seconds : float [s]
        Time between two saves, 0 (after every batch) or more.
    resume : bool
        Continue from an existing checkpoint; otherwise start a new run, whose first save replaces
        it.

    Raises
    ------
    SimulationError
        The time is negative or not finite.

    Examples
    --------
    >>> from sssfit.material import load_material
    >>> from sssfit.simulate import Checkpoint, simulate_montecarlo
    >>> checkpoint = Checkpoint(Path("skin1.checkpoint"))
    >>> profile = simulate_montecarlo(
    ...     load_material("skin1"), photons=100_000, checkpoint=checkpoint
    ... )
    >>> profile.save("skin1.profile.npz")
    >>> checkpoint.remove()
    """

    path: Path
    every_seconds: float = EVERY_SECONDS
    resume: bool = True
    _settings: Mapping[str, str] = field(init=False, default_factory=dict)
    _materials: Sequence[Material] = field(init=False, default=())
    _is_ours: bool = field(init=False, default=False)
    _has_failed: bool = field(init=False, default=False)
    _saved_at: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        self.path = Path(self.path)
        if not 0.0 <= self.every_seconds < math.inf:
            raise SimulationError(
                f"a checkpoint every {self.every_seconds} s; give a time from 0 s up."
            )

    def start_state(
        self, empty: Tally, settings: Mapping[str, str], materials: Sequence[Material]
    ) -> State:
        """Return the state to start from: the one saved with the same ``settings``, or ``empty``.

        Raises
        ------
        FileError
            The file cannot be read, is damaged, or is not a checkpoint.
        SimulationError
            It was made with other settings, which the message names.
        """
        remove_leftovers(self.path)
        self._settings, self._materials = settings, materials
        self._saved_at = perf_counter()
        self._is_ours = self.resume and self.path.exists()
        if self._is_ours:
            return _load(self.path, empty, settings)
        if self.path.exists():
            warnings.warn(
                f"starting a new run beside {self.path}, which an earlier run left; it is kept "
                "until this run's own first checkpoint (`resume = True` would continue from it).",
                SssfitWarning,
                stacklevel=6,
            )
        return State(empty)

    def save_if_due(self, state: State) -> None:
        """Save at intervals. A failure causes one warning, and only the checkpoint is lost."""
        if perf_counter() - self._saved_at >= self.every_seconds:
            self._save(state)

    def save_at_stop(self, state: State) -> None:
        """Save the work of a stopped run, but not over that of another, longer one."""
        if self._is_ours or not self.path.exists():
            self._save(state)

    def is_ours(self) -> bool:
        """Whether the file is this run's: saved or resumed by it."""
        return self._is_ours

    def remove(self) -> None:
        """Delete the checkpoint that this run saved or resumed, once its result is safe."""
        if self._is_ours:
            # The folder has become read-only; the file does no harm there.
            with contextlib.suppress(OSError):
                self.path.unlink()
            self._is_ours = False

    def _save(self, state: State) -> None:
        try:
            _write(self.path, state, self._settings, self._materials)
        except FileError as error:
            if not self._has_failed:
                warnings.warn(
                    f"{str(error).rstrip('.')}: the run goes on, and the last good checkpoint, "
                    "if there is one, is kept.",
                    SssfitWarning,
                    stacklevel=6,
                )
            self._has_failed = True
        else:
            self._is_ours = True
        self._saved_at = perf_counter()


def is_checkpoint_file(path: Path) -> bool:
    """Tell whether a file is a checkpoint of any version, or what damage has left of one."""
    return has_mark(path, {b"PK": _MARKS[1]})


def settings_of(
    materials: Sequence[Material],
    grids: Sequence[RadialGrid],
    seed: int,
    directions: Directions,
) -> dict[str, str]:
    """Return everything that determines the bits of a walk's batches, as printable text."""
    return {
        "seed": str(seed),
        "material": ", ".join(f"{each.name} (sha256 {each.sha256[:16]})" for each in materials),
        "dr_mm": ", ".join(repr(grid.dr_mm) for grid in grids),
        "annuli": ", ".join(str(grid.annuli) for grid in grids),
        "version": source_key(),
        "photons in a batch": str(BATCH_PHOTONS),
        **{key: repr(value) for key, value in directions.given().items()},
    }


def _write(
    path: Path, state: State, settings: Mapping[str, str], materials: Sequence[Material]
) -> None:
    """Write the whole file or nothing."""
    meta = {
        "format": FORMAT,
        "settings": dict(settings),
        "materials": [each.to_dict() for each in materials],
        "photons": state.tally.photons,
        "flights": state.tally.flights,
        "least_error": state.least_error,
        "seconds": state.seconds,
    }
    arrays = {f"ledger_{name}": each for name, each in state.tally.ledger._asdict().items()}
    # In memory first, because zipfile's own clean-up would fail again on a full disk.
    buffer = io.BytesIO()
    np.savez(buffer, meta=np.array(json.dumps(meta)), **arrays)
    write_atomically(path, lambda stream: stream.write(buffer.getbuffer()))


def _load(path: Path, empty: Tally, settings: Mapping[str, str]) -> State:
    """Fill ``empty`` with the contents of a file that was made with the same settings."""
    with open_checkpoint(path, str(path)) as archive:
        meta = read_meta(archive)
        _check_settings(path, meta["settings"], settings)
        return read_state(archive, meta, empty)


@contextlib.contextmanager
def open_checkpoint(source: Path | BinaryIO, origin: str) -> Iterator[zipfile.ZipFile]:
    """Open a checkpoint; errors are one line that begins with ``origin``."""
    try:
        with zipfile.ZipFile(source) as archive:
            yield archive
    except OSError as error:
        raise FileError(f"{origin} cannot be read: {reason(error)}.") from error
    except CheckpointError as fault:
        raise FileError(f"{origin} {fault}; {_REMEDY}.") from None
    except SimulationError:
        raise
    except Exception as error:
        # zipfile, zlib, numpy's header parser and json raise a dozen unrelated types for damaged
        # files.
        is_ours = True
        with contextlib.suppress(OSError), _rewound(source) as stream:
            is_ours = is_marked(stream, _MARKS)
        what = "is a damaged checkpoint" if is_ours else "is not a checkpoint"
        raise FileError(f"{origin} {what}; {_REMEDY}.") from error


def read_meta(archive: zipfile.ZipFile) -> dict[str, Any]:
    """Read the metadata of a checkpoint; raises CheckpointError, or other errors if damaged."""
    meta = dict(json.loads(str(read_npy(archive, "meta", "U", _MAX_META_BYTES))))
    if meta.get("format") != FORMAT:
        raise CheckpointError(f"has format {shown(meta.get('format'))}, not {FORMAT!r}")
    settings = meta.get("settings")
    if not (isinstance(settings, dict) and all(isinstance(x, str) for x in settings.values())):
        raise CheckpointError("is a damaged checkpoint")
    return meta


def read_state(archive: zipfile.ZipFile, meta: Mapping[str, Any], empty: Tally) -> State:
    """Fill ``empty`` with the sums of a checkpoint; raises CheckpointError, or others."""
    mine = {f"ledger_{name}": each for name, each in empty.ledger._asdict().items()}
    if {*archive.namelist()} != {f"{name}.npy" for name in [*mine, "meta"]}:
        raise CheckpointError("is a damaged checkpoint")
    arrays = {
        name: read_npy(archive, name, "f", each.nbytes + _HEADER_BYTES)
        for name, each in mine.items()
    }
    state = _checked_state(empty, meta)
    for name, each in mine.items():
        _check_sums(name, arrays[name], each, state.tally.photons)
        each[...] = arrays[name]
    return state


class CheckpointError(Exception):
    """A fault of a checkpoint, as text that follows its name in a message."""

    @classmethod
    def of(cls, detail: str) -> "CheckpointError":
        """Return the error for a value that no run writes."""
        return cls(f"is damaged or was edited: {detail}")


@contextlib.contextmanager
def _rewound(source: Path | BinaryIO) -> Iterator[BinaryIO]:
    """Yield a file or stream at its beginning."""
    if isinstance(source, Path):
        with source.open("rb") as stream:
            yield stream
    else:
        source.seek(0)
        yield source


def _checked_state(empty: Tally, meta: Mapping[str, Any]) -> State:
    """Copy the counts and figures of a checkpoint into a state; raises an error if invalid."""
    photons, flights = meta.get("photons"), meta.get("flights")
    if type(photons) is not int or photons % BATCH_PHOTONS or not 0 < photons <= MAX_PHOTONS:
        raise CheckpointError.of(
            f"photons = {shown(photons)}, expected whole batches of {BATCH_PHOTONS}"
        )
    if type(flights) is not int or not 0 <= flights < 2**63:
        raise CheckpointError.of(f"flights = {shown(flights)}, expected a whole number from 0 up")
    least_error, seconds = meta.get("least_error"), meta.get("seconds")
    if type(least_error) is not float or not least_error >= 0.0:
        raise CheckpointError.of(f"least_error = {shown(least_error)}, expected a number from 0 up")
    if type(seconds) is not float or not 0.0 <= seconds < math.inf:
        raise CheckpointError.of(f"seconds = {shown(seconds)}, expected a finite number from 0 up")
    empty.photons, empty.flights = photons, flights
    return State(empty, least_error, seconds)


def _check_sums(name: str, sums: npt.NDArray[Any], mine: npt.NDArray[Any], photons: int) -> None:
    """Check for sums that no walk can have: a photon weighs 1, and roulette adds at most 1e-3.

    Only the weight added by roulette may be below 0.
    """
    if sums.shape != mine.shape:
        raise CheckpointError.of(f"{name} has shape {sums.shape}, expected {mine.shape}")
    most = 2.0 * photons
    least = -most if name == "ledger_roulette" else 0.0
    if (bad := ~((sums >= least) & (sums <= most))).any():
        at = np.argwhere(bad)[0].tolist()
        raise CheckpointError.of(
            f"{name} holds {sums[bad].flat[0]} at {at}, expected {least:g} to {most:g}"
        )


def _check_settings(path: Path, there: Mapping[str, str], here: Mapping[str, str]) -> None:
    """Raise an error that names every setting in which a checkpoint differs from the run."""
    differing = [
        f"{_shortened(name)} = {_shortened(there.get(name))} (now {_shortened(here.get(name))})"
        for name in {**here, **there}
        if there.get(name) != here.get(name)
    ]
    if differing:
        raise SimulationError(
            f"{path} was made with other settings: {'; '.join(differing)}. Give the same, or "
            "start a new run with `resume = False`."
        )


def _shortened(text: str | None) -> str:
    """Shorten a value to one line: many materials in a walk would fill a page."""
    return printable(str(text))[:200]


_REMEDY = "delete it, or start a new run with `resume = False`"
