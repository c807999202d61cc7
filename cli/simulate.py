"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ._mci import is_mci, load_runs
from ._methods import MAPPINGS, METHODS, method_for, method_lines, own_options
from ._options import (
    Common,
    Count,
    Length,
    LengthOr,
    NumberRange,
    Share,
    WholeRange,
    common_options,
)
from ._simulate_computed import run_computed
from ._simulate_outputs import profile_paths
from ._simulate_run import Request, Walk, run_walks

if TYPE_CHECKING:
    from sssfit.material import Material


@click.command(epilog=method_lines())
@click.argument("material", required=False)
@click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit.")
@click.option("--paper", is_flag=True, help="The eleven of them that the SSSS paper has.")
@click.option(
    "--method",
    type=click.Choice(list(METHODS)),
    default="montecarlo",
    show_default=True,
    metavar="METHOD",
    help="How; the methods are listed below.",
)
@click.option("--run", type=WholeRange(1), metavar="N", help="Of an .mci, this run only.")
@click.option(
    "--photons",
    type=Count(2, 10**12),
    metavar="N",
    help="montecarlo: photons to trace; every photon serves all channels."
    "  [default: 1e7; with --target-error no limit]",
)
@click.option(
    "--target-error",
    type=Share(),
    metavar="SHARE",
    help="montecarlo: end when no channel's F(r) has a standard error above this share of F at the "
    "last edge, such as 0.5%.",
)
@click.option(
    "--tolerance",
    type=Share(),
    default="0.01%",
    show_default=True,
    metavar="SHARE",
    help="exact: largest error of F(r), as a share of the total.",
)
@click.option(
    "--mapping",
    type=click.Choice(MAPPINGS),
    default=MAPPINGS[0],
    show_default=True,
    metavar="FIT",
    help="burley: which published fit gives s: perpendicular (light from straight above), diffuse "
    "(from everywhere), or diffuse-mfp (from the diffuse mean free path).",
)
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
@click.option(
    "--checkpoint-every",
    type=NumberRange(min=0),
    default=30.0,
    show_default=True,
    metavar="SECONDS",
    help="montecarlo: how often FILE.checkpoint is saved, from which --resume goes on.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="montecarlo: go on where a killed or interrupted run was saved.",
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
    run: int | None,
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
    if run is not None and not is_mci(material):
        raise click.UsageError("--run chooses a run of an MCML input file, .mci.")
    method = method_for(context, method, material)
    own = own_options(context, method, own)
    if radius == "auto" and method != "montecarlo":
        raise click.UsageError("--radius auto is for --method montecarlo; give a length.")
    walk = {key: own.pop(key) for key in ("checkpoint_every", "resume") if key in own}
    settings = {"dr_mm": dr, "radius_mm": radius, **own, **_of_common(method, common)}
    if METHODS[method].makes is not None:
        _make(method, settings, output, Request(force, several=False, common=common))
        return
    materials, jobs = _jobs(material, run, settings, shares=METHODS[method].shares, paper=paper)
    several = every or paper or len(materials) > 1
    targets = profile_paths(materials, method, output, several=several)
    if walk.get("resume") and targets == [None]:
        raise click.UsageError("--resume needs a file to go on beside; leave -o - out.")
    request = Request(force, several, common, inputs=(material,) if material else (), **walk)
    if method == "montecarlo":
        run_walks(materials, targets, jobs, request)
    else:
        run_computed(method, materials, targets, jobs, request)


def _make(method: str, settings: dict[str, Any], output: str | None, request: Request) -> None:
    """Run a method that takes no material."""
    from sssfit.simulate import DEON_SKIN

    targets = profile_paths([DEON_SKIN], method, output, several=False)
    run_computed(method, [DEON_SKIN], targets, [([0], settings)], request)


def _of_common(method: str, common: Common) -> dict[str, Any]:
    """Return the common options that the method's function takes; a walk's threads come later."""
    if method == "montecarlo":
        return {"seed": common.seed}
    return {"threads": common.threads} if METHODS[method].shares else {}


def _jobs(
    material: str | None, run: int | None, settings: dict[str, Any], *, shares: bool, paper: bool
) -> tuple[list[Material], list[Walk]]:
    """Load what is asked for; each job has the indices of its materials and its settings."""
    from sssfit.material import load_material, material_names
    from sssfit.simulate import shared_walks

    if material is not None and is_mci(material):
        materials, each = load_runs(material, run, settings)
        return materials, [([k], own) for k, own in enumerate(each)]
    names = material_names(paper=paper) if material is None else (material,)
    materials = [load_material(name) for name in names]
    groups = shared_walks(materials) if shares else [[k] for k in range(len(materials))]
    return materials, [(group, settings) for group in groups]
