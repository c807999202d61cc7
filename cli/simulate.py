"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._mci import is_mci, load_runs
from ._options import Common, Count, Length, common_options
from ._report import say
from ._simulate_report import figures_of, report

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile

    _Walk = tuple[list[int], dict[str, Any]]


class Radius(Length):
    """A length, or the word auto."""

    name = "radius"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Let ``auto`` through."""
        return value if value == "auto" else super().convert(value, param, ctx)


@click.command()
@click.argument("material", required=False)
@click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit.")
@click.option("--run", type=click.IntRange(1), metavar="N", help="Of an .mci, this run only.")
@click.option(
    "--photons",
    type=Count(2, 10**12),
    default="1e7",
    show_default=True,
    metavar="N",
    help="Photons to trace; every photon serves all channels.",
)
@click.option("--dr", type=Length(), metavar="MM", help="Annulus width.  [default: MFP_min / 20]")
@click.option(
    "--radius",
    type=Radius(),
    metavar="MM|auto",
    help="Grid radius; auto grows it until under 0.1 % of any channel lies beyond."
    "  [default: 32 MFP_max]",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the profile goes, - for stdout; a folder for several."
    "  [default: MATERIAL.profile.npz]",
)
@click.option("--force", is_flag=True, help="Replace a file that is not a profile.")
@common_options
def simulate(
    material: str | None,
    every: bool,
    run: int | None,
    photons: int,
    dr: float | None,
    radius: float | str | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Trace photons through MATERIAL and write its diffuse reflectance profile.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or - for stdin; or
    an MCML input file, .mci: a profile a run, with its photons and grid where options give none.
    The profile is R_d(r) per channel as energy in annuli with standard errors, for a normally
    incident pencil beam, in mm. Ctrl-C saves what is done, with its true photon count.

    \b
      sssfit simulate skin1
      sssfit simulate skin1 --photons 1e8 --radius auto -o fine.profile.npz
      sssfit simulate ./wax.toml --json
      sssfit simulate tissue.mci --run 2
    """
    if (material is None) != every:
        raise click.UsageError("name one MATERIAL, or give --all.")
    if run is not None and not is_mci(material):
        raise click.UsageError("--run chooses a run of an MCML input file, .mci.")
    settings = {"photons": photons, "dr_mm": dr, "radius_mm": radius}
    materials, walks = _walks(material, run, settings)
    several = every or len(materials) > 1
    targets = _targets(materials, output, several)
    _run(materials, targets, walks, force=force, every=several, common=common)


def _walks(
    material: str | None, run: int | None, settings: dict[str, Any]
) -> tuple[list[Material], list[_Walk]]:
    """Load what is asked for; each walk has the indices of its materials and its settings."""
    from sssfit.material import load_material, material_names

    if material is not None and is_mci(material):
        materials, each = load_runs(material, run, settings)
        return materials, [([k], own) for k, own in enumerate(each)]
    names = material_names() if material is None else (material,)
    materials = [load_material(name) for name in names]
    return materials, [(group, settings) for group in _by_eta(materials)]


def _targets(materials: list[Material], output: str | None, several: bool) -> list[Path | None]:
    """Where each profile goes; None is stdout."""
    if output == "-":
        if several:
            raise click.UsageError("there are several profiles; -o names a folder for them.")
        return [None]
    if several or output is None:
        folder = Path(output or ".")
        return [folder / f"{each.name}.profile.npz" for each in materials]
    return [Path(output)]


def _run(
    materials: list[Material],
    targets: list[Path | None],
    walks: list[_Walk],
    *,
    force: bool,
    every: bool,
    common: Common,
) -> None:
    """Walk, write each profile as its walk ends, and report."""
    from contextlib import ExitStack

    from sssfit.errors import StoppedError
    from sssfit.files import check_output, locked
    from sssfit.profile import is_profile_file

    from ._interrupt import asked_to_stop

    rows: dict[int, dict[str, Any]] = {}
    with ExitStack() as held:
        for path in filter(None, targets):
            check_output(path, is_profile_file, force=force)
            held.enter_context(locked(path))
        stop = held.enter_context(asked_to_stop())
        for group, settings in walks:
            try:
                profiles, seconds = _walk([materials[k] for k in group], settings, stop, common)
            except StoppedError:
                break
            for k, profile in zip(group, profiles, strict=True):
                _write(profile, targets[k])
                rows[k] = figures_of(profile, seconds) | {"path": str(targets[k] or "-")}
        interrupted = stop()
    if not rows:
        raise KeyboardInterrupt
    report([rows[k] for k in sorted(rows)], every=every, common=common, interrupted=interrupted)
    if interrupted:
        sys.exit(130)


def _by_eta(materials: list[Material]) -> list[list[int]]:
    """Return the indices of the materials that can share a walk: one relative index a group."""
    groups: dict[float, list[int]] = {}
    for k, material in enumerate(materials):
        groups.setdefault(material.layers[0].eta / material.eta_above, []).append(k)
    return list(groups.values())


def _walk(
    materials: list[Material], settings: dict[str, Any], stop: Any, common: Common
) -> tuple[list[Profile], float]:
    """One walk for all ``materials``, with a progress bar; the profiles and the wall time."""
    from time import perf_counter

    from sssfit.simulate import compiled_before, simulate_montecarlo_many

    from ._progress import walk_progress

    if not compiled_before():
        say(common, "First use: compiling the photon walk, some 10 s; it is kept for later runs.")
    label = materials[0].name if len(materials) == 1 else f"{len(materials)} materials"
    begun = perf_counter()
    with walk_progress(label, quiet=common.quiet) as progress:
        profiles = simulate_montecarlo_many(
            materials,
            seed=common.seed,
            threads=common.threads,
            progress=progress,
            stop=stop,
            **settings,
        )
    return profiles, perf_counter() - begun


def _write(profile: Profile, path: Path | None) -> None:
    """To the file, whole or not at all; to stdout where there is none."""
    if path is None:
        profile.write(sys.stdout.buffer)
        sys.stdout.buffer.flush()
    else:
        profile.save(path)
