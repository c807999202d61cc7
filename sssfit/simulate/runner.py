"""Computes profiles and writes them to files, with locked outputs and resumable walks.

This is the work of ``sssfit simulate``, for scripts that run for hours: `simulate_to_files` checks
before it begins that the outputs can be written, writes each profile when its run ends, and keeps a
checkpoint from which a killed run continues to the same bits. Next: ``sssfit.simulate.summary``.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sssfit.errors import FileError, ProfileError, SimulationError, StoppedError
from sssfit.files import check_output, held
from sssfit.formats.mci import is_mci, load_mci
from sssfit.grid import make_grid
from sssfit.material import Material, load_material, material_names
from sssfit.messages import counted, note
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile, is_profile_file
from sssfit.profile.beam import Beam, under_beam, wider_edges
from sssfit.simulate._checkpoint import EVERY_SECONDS, Checkpoint, is_checkpoint_file
from sssfit.simulate._elsewhere import Elsewhere
from sssfit.simulate._finished import is_complete, is_finished, run_figures
from sssfit.simulate._run import Progress
from sssfit.simulate.gaussians import DEON_SKIN
from sssfit.simulate.montecarlo import shared_walks
from sssfit.simulate.summary import summary

Stop = Callable[[], bool]
Watch = Callable[[str], AbstractContextManager[Callable[[Progress], None] | None]]
WALK = "montecarlo"  # the method that can be saved half done, and resumed


@dataclass(frozen=True, slots=True)
class Outcome:
    """One profile of a run.

    Parameters
    ----------
    profile : Profile
    path : Path or None
        Path of its file; None if it was not written.
    seconds : float, optional [s]
        Duration of its run; None if it was already finished.
    is_complete : bool
        Whether the run reached its end and was not stopped.
    is_resumable : bool
        Whether a checkpoint is kept.
    """

    profile: Profile
    path: Path | None
    seconds: float | None
    is_complete: bool = True
    is_resumable: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``sssfit simulate --json``; see `run_figures`."""
        return run_figures(self.profile, self.seconds)


@dataclass(frozen=True, slots=True)
class Results:
    """The profiles of `simulate_to_files`, in the order of the materials.

    Parameters
    ----------
    outcomes : tuple of Outcome
        Outcomes of the materials that were finished, or saved before their end.
    not_begun : tuple of str
        Names of the materials that had not begun when ``stop`` returned true.
    """

    outcomes: tuple[Outcome, ...]
    not_begun: tuple[str, ...] = ()

    @property
    def is_interrupted(self) -> bool:
        """Whether any requested profile is missing."""
        return bool(self.not_begun) or not all(each.is_complete for each in self.outcomes)

    @property
    def note(self) -> str:
        """State after an interruption, in one or two sentences; empty without one."""
        left = ", ".join(self.not_begun)
        if not self.is_interrupted:
            return ""
        if self.outcomes[0].profile.photons is None:
            return f"Interrupted. Not done: {left}."
        resumable = any(each.is_resumable for each in self.outcomes)
        how = "; `resume = True` continues from there" if resumable else ""
        return f"Interrupted: the photons traced so far are saved, with their true count{how}." + (
            f" Not begun: {left}." if left else ""
        )

    def to_dict(self, *, several: bool) -> dict[str, Any]:
        """Return what ``sssfit simulate --json`` prints; ``several`` asks for rows."""
        rows = [each.to_dict() for each in self.outcomes]
        return {
            "output": [str(each.path or "-") for each in self.outcomes],
            **({"rows": rows} if several else rows[0]),
            **({"interrupted": True} if self.is_interrupted else {}),
        }

    def summary(self, *, several: bool) -> str:
        """Return the printed report; see `sssfit.simulate.summary.summary`."""
        lines = [summary([each.to_dict() for each in self.outcomes], several=several)]
        for start, is_old in (("Wrote", False), ("Finished before, nothing to do:", True)):
            paths = [
                str(each.path)
                for each in self.outcomes
                if (each.seconds is None) is is_old and each.path
            ]
            lines += [f"{start} {', '.join(paths)}"] if paths else []
        return "\n".join(lines)


def runs_of(
    method: str,
    material: str | None,
    given: dict[str, Any],
    *,
    run: int | None = None,
    paper: bool = False,
) -> tuple[list[Any], dict[str, Any] | list[dict[str, Any]]]:
    """Return what `simulate_to_files` takes for a name: materials, and their settings.

    Parameters
    ----------
    method : str
    material : str, optional
        A name or a file; of an MCML input file every run, with settings of its own. By default all
        materials that ship with sssfit.
    given : dict
        Settings for all, which also replace those of a file.
    run : int, optional
        The only run of an MCML input file.
    paper : bool
        By default only the paper's eleven.
    """
    if SIMULATIONS[method].makes is not None:
        return [DEON_SKIN], given
    if material is None:
        return [load_material(name) for name in material_names(paper=paper)], given
    if not is_mci(material):
        return [load_material(material)], given
    runs = load_mci(material, run)
    # A target error alone decides when a walk ends; then the file's photons are no limit.
    photons = method == WALK and not {"photons", "target_error"} & given.keys()
    return [each.material for each in runs], [
        each.settings(given, photons=photons) for each in runs
    ]


def traced_by(
    elsewhere: Elsewhere, settings: dict[str, Any] | list[dict[str, Any]]
) -> dict[str, Any] | list[dict[str, Any]]:
    """Return the settings of walks whose batches other machines trace."""
    if isinstance(settings, list):
        return [each | {"elsewhere": elsewhere} for each in settings]
    return settings | {"elsewhere": elsewhere}


def paths_of(
    materials: Sequence[Any], method: str, output: str | None, *, several: bool
) -> list[Path | None]:
    """Return where each profile goes; None is a stream. Only the walk's files do not name it.

    ``output`` is the file, or the folder of several; by default this one.
    """
    if output == "-":
        return [None]
    if output is not None and not several:
        return [Path(output)]
    kind = "" if method == WALK else f".{method}"
    return [Path(output or ".", f"{each.name}{kind}.profile.npz") for each in materials]


def simulate_to_files(
    materials: Sequence[Any],
    paths: Sequence[str | Path | None],
    method: str = WALK,
    settings: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
    *,
    resume: bool = False,
    checkpoint_every: float = EVERY_SECONDS,
    force: bool = False,
    inputs: Iterable[str | Path] = (),
    beam: Beam | None = None,
    stop: Stop = lambda: False,
    watch: Watch = lambda label: nullcontext(),  # noqa: ARG005
) -> Results:
    """Compute the profile of each material and write it as soon as it is finished.

    Parameters
    ----------
    materials : sequence of Material or ProfileSource
        Materials that can share a run do so. For a method that makes one profile without a
        material, the source of that profile.
    paths : sequence of str, Path or None
        Path of each profile; None if the caller writes it.
    method : str
        A name of `sssfit.methods.SIMULATIONS`.
    settings : mapping or sequence of mappings, optional
        Keyword arguments of the method's function: for all, or for each material, which then has
        its own run.
    resume : bool
        Continue a walk from its checkpoint; finished profiles are not computed again.
    checkpoint_every : float [s]
        Time between two saves of a walk, which lie beside its first path.
    force : bool
        Also replace files that are not ours, and inputs.
    inputs : iterable of str or Path
        Files that are read and must not be overwritten.
    beam : Beam, optional
        The beam that the profiles are under, in place of a pencil beam.
    stop : callable
        When it returns true, a walk ends with the photons so far, and no other run begins.
    watch : callable
        Takes a label for each walk, and returns a context whose value is called with the progress.

    Returns
    -------
    Results

    Raises
    ------
    SimulationError, FileError
        Settings, outputs or checkpoints are invalid.
    ProfileError
        The beam reaches too many annuli.
    """
    files: list[Path | None] = [None if each is None else Path(each) for each in paths]
    if settings is None or isinstance(settings, Mapping):
        every, shares = [settings or {}] * len(files), SIMULATIONS[method].shares
    else:
        every, shares = list(settings), False
    if not len(materials) == len(every) == len(files):
        raise SimulationError(
            f"{counted(len(materials), 'material')}, {counted(len(files), 'path')} and settings of "
            f"{counted(len(every), 'run')}; expected as many of each."
        )
    for material, given in zip(materials, every, strict=True):
        _check_reach(beam, material, given)
    groups = shared_walks(materials) if shares else [[k] for k in range(len(files))]
    is_walk = method == WALK
    inputs = tuple(inputs)
    found: dict[int, Outcome] = {}
    with held(files, is_profile_file, inputs=inputs, force=force, named=("a profile", ".npz")):
        saves = [
            Checkpoint(_beside(path), checkpoint_every, resume=resume) if is_walk and path else None
            for path in (files[group[0]] for group in groups)
        ]
        for save in saves:
            if save and not resume:
                check_output(save.path, is_checkpoint_file, force=force, inputs=inputs)
        for group, save in zip(groups, saves, strict=True):
            own = [materials[k] for k in group], [files[k] for k in group]
            given = every[group[0]]
            try:
                if is_walk:
                    made = _walk(*own, given, beam, save, stop, watch)
                else:
                    made = _computed(*own, given, beam, method, stop)
            except StoppedError:
                break
            found |= zip(group, made, strict=True)
    missing = [each.name for k, each in enumerate(materials) if k not in found]
    return Results(tuple(found[k] for k in sorted(found)), tuple(missing))


def _check_reach(beam: Beam | None, material: Any, settings: Mapping[str, Any]) -> None:
    """Refuse a beam that reaches too many annuli, before what it is laid over is computed."""
    if beam is None or not isinstance(material, Material):
        return
    known = {key: settings.get(key) for key in ("dr_mm", "radius_mm")}
    wide = {key: None if isinstance(each, str) else each for key, each in known.items()}
    wider_edges(make_grid(material, **wide).r_edges_mm, beam.reach_mm)


def _beside(path: Path) -> Path:
    """Return the path of a walk's checkpoint: beside its first output, and so under its lock."""
    return path.with_name(f"{path.name}.checkpoint")


def _computed(
    materials: Sequence[Any],
    paths: Sequence[Path | None],
    settings: Mapping[str, Any],
    beam: Beam | None,
    method: str,
    stop: Stop,
) -> list[Outcome]:
    """Call the method's function once; methods that share work between materials can be stopped."""
    chosen, begun = SIMULATIONS[method], time.perf_counter()
    function = chosen.load()
    if chosen.shares:
        profiles = function(materials, stop=stop, **settings)
    elif stop():
        raise StoppedError("stopped between two materials.")
    else:
        profiles = [function(*([] if chosen.makes else [each]), **settings) for each in materials]
    profiles = _under(profiles, beam)
    seconds = time.perf_counter() - begun
    _write(profiles, paths)
    return [Outcome(*each, seconds) for each in zip(profiles, paths, strict=True)]


def _walk(
    materials: Sequence[Any],
    paths: Sequence[Path | None],
    settings: Mapping[str, Any],
    beam: Beam | None,
    save: Checkpoint | None,
    stop: Stop,
    watch: Watch,
) -> list[Outcome]:
    """Run one walk for all ``materials``, from its checkpoint if there is one to continue from."""
    resumes = save is not None and save.resume and save.path.exists()
    if save and save.resume and not resumes:
        if before := _finished(materials, paths, settings, beam):
            return [Outcome(*each, None) for each in zip(before, paths, strict=True)]
        note(f"No {save.path} to continue from: starting a new run.")
    last: list[Progress] = []
    label = materials[0].name if len(materials) == 1 else f"{len(materials)} materials"
    with watch(label) as show:

        def report(now: Progress) -> None:
            if save and resumes and not last:
                note(f"Continuing from {save.path}: {now.photons_done:,} photons done.")
            last[:] = [now]
            if show:
                show(now)

        profiles = SIMULATIONS[WALK].load()(
            materials, checkpoint=save, progress=report, stop=stop, **settings
        )
    profiles = _under(profiles, beam)
    try:
        _write(profiles, paths)
    except FileError as error:
        if save is None or not save.is_ours():
            raise
        raise FileError(
            f"{str(error).rstrip('.')}; {save.path} is kept: `resume = True` continues from it."
        ) from None
    complete = is_complete(profiles[0])
    if save and complete:
        save.remove()
    kept = save is not None and save.is_ours()
    seconds = last[-1].seconds
    return [Outcome(*each, seconds, complete, kept) for each in zip(profiles, paths, strict=True)]


def _finished(
    materials: Sequence[Material],
    paths: Sequence[Path | None],
    settings: Mapping[str, Any],
    beam: Beam | None,
) -> list[Profile]:
    """Return the profiles of this walk if all are complete; else none."""
    asked = {key: each for key, each in settings.items() if key not in ("threads", "elsewhere")}
    try:
        profiles = [Profile.load(path) for path in paths if path and path.exists()]
    except ProfileError:
        return []
    asked["beam"] = beam
    done = [is_finished(each, k, materials, **asked) for k, each in enumerate(profiles)]
    return profiles if len(done) == len(materials) and all(done) else []


def _under(profiles: Sequence[Profile], beam: Beam | None) -> list[Profile]:
    return list(profiles) if beam is None else [under_beam(each, beam) for each in profiles]


def _write(profiles: Sequence[Profile], paths: Sequence[Path | None]) -> None:
    for profile, path in zip(profiles, paths, strict=True):
        if path is not None:
            profile.save(path)
