"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sssfit.methods import SIMULATIONS, lines_of

from ._input import is_mci
from ._methods import method_for, method_options, own_settings
from ._options import Common, Length, LengthOr, WholeRange, common_options
from ._simulate_run import Job, Request, run

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.simulate import ProfileSource


@click.command(epilog="\b\nMethods:\n" + lines_of(SIMULATIONS))
@click.argument("material", required=False)
@click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit.")
@click.option("--paper", is_flag=True, help="The eleven of them that the SSSS paper has.")
@click.option(
    "--method",
    type=click.Choice(list(SIMULATIONS)),
    default="montecarlo",
    show_default=True,
    metavar="METHOD",
    help="How; the methods are listed below.",
)
@click.option("--run", "number", type=WholeRange(1), metavar="N", help="Of an .mci, this run only.")
@method_options(SIMULATIONS)
@click.option(
    "--dr",
    type=Length(),
    metavar="MM",
    help="Annulus width.  [default: MFP_min / 20; deon-skin: 0.008]",
)
@click.option(
    "--radius",
    type=LengthOr("auto"),
    metavar="MM|auto",
    help="Grid radius; auto (montecarlo) grows it until under 0.1 % of any channel lies beyond."
    "  [default: 32 MFP_max; deon-skin: 17.2]",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Where the profile goes, - for stdout; with --all a folder."
    "  [default: MATERIAL.profile.npz, MATERIAL.METHOD.profile.npz]",
)
@click.option("--force", is_flag=True, help="Replace an input, or a file that is not our profile.")
@common_options
@click.pass_context
def simulate(
    context: click.Context,
    /,
    material: str | None,
    every: bool,
    paper: bool,
    method: str,
    number: int | None,
    dr: float | None,
    radius: float | str | None,
    output: str | None,
    force: bool,
    common: Common,
    **own: Any,
) -> None:
    """Compute the diffuse reflectance profile of MATERIAL and write it.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or - for stdin; or
    an MCML input file, .mci: a profile a run, with its photons and grid where options give none.
    The profile is R_d(r) per channel as energy in annuli with errors, for a normally incident
    pencil beam, in mm. Ctrl-C saves what a photon walk has done, with its true photon count;
    --resume goes on from there, or from the last checkpoint of a run that was killed, and ends in
    the same bits as a run that was left alone.

    \b
      sssfit simulate skin1
      sssfit simulate skin1 --method exact
      sssfit simulate skin1 --photons 1e8 --radius auto -o fine.profile.npz
      sssfit simulate ./wax.toml --json
      sssfit simulate skin1 --target-error 0.1% --resume
      sssfit simulate tissue.mci --run 2
      sssfit simulate deon-skin
    """
    if [material is not None, every, paper].count(True) != 1:
        raise click.UsageError("name one MATERIAL, or give --all or --paper.")
    if number is not None and not is_mci(material):
        raise click.UsageError("--run chooses a run of an MCML input file, .mci.")
    method = method_for(context, method, material)
    own = own_settings(context, SIMULATIONS, method, own)
    if radius == "auto" and method != "montecarlo":
        raise click.UsageError("--radius auto is for --method montecarlo; give a length.")
    walk = {key: own.pop(key) for key in ("checkpoint_every", "resume") if key in own}
    settings = {"dr_mm": dr, "radius_mm": radius, **own, **_of_common(method, common)}
    materials, jobs = _jobs(method, material, number, settings, paper=paper)
    several = every or paper or len(materials) > 1
    targets = _targets(materials, method, output, several=several)
    if walk.get("resume") and targets == [None]:
        raise click.UsageError("--resume needs a file to go on beside; leave -o - out.")
    inputs = (material,) if material and SIMULATIONS[method].makes is None else ()
    run(materials, targets, jobs, Request(method, force, several, common, inputs, **walk))


def _of_common(method: str, common: Common) -> dict[str, Any]:
    """Return the common options that the method's function takes; a walk's threads come later."""
    if method == "montecarlo":
        return {"seed": common.seed}
    return {"threads": common.threads} if SIMULATIONS[method].shares else {}


def _jobs(
    method: str, material: str | None, number: int | None, settings: dict[str, Any], *, paper: bool
) -> tuple[Sequence[Material | ProfileSource], list[Job]]:
    """Load what is asked for; each job has the indices of its materials and its settings."""
    from sssfit.material import load_material, material_names
    from sssfit.simulate import DEON_SKIN, shared_walks

    if SIMULATIONS[method].makes is not None:
        return [DEON_SKIN], [([0], settings)]
    if material is not None and is_mci(material):
        materials, each = _runs_of(material, number, method, settings)
        return materials, [([k], own) for k, own in enumerate(each)]
    names = material_names(paper=paper) if material is None else (material,)
    materials = [load_material(name) for name in names]
    shares = SIMULATIONS[method].shares
    groups = shared_walks(materials) if shares else [[k] for k in range(len(materials))]
    return materials, [(group, settings) for group in groups]


def _runs_of(
    path: str, number: int | None, method: str, given: dict[str, Any]
) -> tuple[list[Material], list[dict[str, Any]]]:
    """Return the materials of the runs of a file, or of one, and what to simulate each with.

    ``given`` holds dr_mm and radius_mm, and photons or a target error if these were given; the
    file's own stand for those that were not.
    """
    from sssfit.errors import MaterialError
    from sssfit.formats.mci import load_mci

    runs = load_mci(path)
    if number is not None:
        if number > len(runs):
            raise MaterialError(f"{path} has no run {number}; give --run 1 to {len(runs)}.")
        runs = runs[number - 1 : number]
    settings = [
        given
        | {
            "dr_mm": given["dr_mm"] or run.grid.dr_mm,
            "radius_mm": given["radius_mm"] or run.grid.radius_mm,
        }
        for run in runs
    ]
    # A target error alone decides when a walk ends; then the file's photons are no limit either.
    if method == "montecarlo" and not {"photons", "target_error"} & given.keys():
        for run, own in zip(runs, settings, strict=True):
            own["photons"] = run.photons
    return [run.material for run in runs], settings


def _targets(
    materials: Sequence[Material | ProfileSource], method: str, output: str | None, *, several: bool
) -> list[Path | None]:
    """Where each profile goes; None is stdout. Methods but the first put their name into it."""
    if output == "-":
        if several:
            raise click.UsageError("there are several profiles; -o names a folder for them.")
        return [None]
    if several or output is None:
        folder, kind = Path(output or "."), "" if method == "montecarlo" else f".{method}"
        return [folder / f"{each.name}{kind}.profile.npz" for each in materials]
    return [Path(output)]
