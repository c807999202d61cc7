"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._mci import is_mci, load_runs
from ._options import Common, Count, Length, Share, common_options
from ._simulate_run import Request, Walk, run_walks

if TYPE_CHECKING:
    from sssfit.material import Material


class Radius(Length):
    """A length, or the word auto."""

    name = "radius"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Let ``auto`` through."""
        return value if value == "auto" else super().convert(value, param, ctx)


@click.command()
@click.argument("material", required=False)
@click.option("--all", "every", is_flag=True, help="All materials that ship with sssfit.")
@click.option(
    "--method",
    type=click.Choice(["montecarlo"]),
    default="montecarlo",
    show_default=True,
    help="How; montecarlo walks photons, through layers where the material has them.",
)
@click.option("--run", type=click.IntRange(1), metavar="N", help="Of an .mci, this run only.")
@click.option(
    "--photons",
    type=Count(2, 10**12),
    metavar="N",
    help="Photons to trace; every photon serves all channels."
    "  [default: 1e7; with --target-error no limit]",
)
@click.option(
    "--target-error",
    type=Share(),
    metavar="SHARE",
    help="End when no channel's F(r) has a standard error above this share of F at the last edge, "
    "such as 0.5%.",
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
    help="Where the profile goes, - for stdout; with --all a folder."
    "  [default: MATERIAL.profile.npz]",
)
@click.option(
    "--checkpoint-every",
    type=click.FloatRange(min=0),
    default=30.0,
    show_default=True,
    metavar="SECONDS",
    help="How often FILE.checkpoint is saved, from which --resume goes on.",
)
@click.option("--resume", is_flag=True, help="Go on where a killed or interrupted run was saved.")
@click.option("--force", is_flag=True, help="Replace a file that is not a profile.")
@common_options
def simulate(
    material: str | None,
    every: bool,
    method: str,  # noqa: ARG001 (one so far; click has checked it)
    run: int | None,
    photons: int | None,
    target_error: float | None,
    dr: float | None,
    radius: float | str | None,
    output: str | None,
    checkpoint_every: float,
    resume: bool,
    force: bool,
    common: Common,
) -> None:
    """Trace photons through MATERIAL and write its diffuse reflectance profile.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or - for stdin; or
    an MCML input file, .mci: a profile a run, with its photons and grid where options give none.
    The profile is R_d(r) per channel as energy in annuli with standard errors, for a normally
    incident pencil beam, in mm. Ctrl-C saves what is done, with its true photon count; --resume
    goes on from there, or from the last checkpoint of a run that was killed, and ends in the same
    bits as a run that was left alone.

    \b
      sssfit simulate skin1
      sssfit simulate skin1 --photons 1e8 --radius auto -o fine.profile.npz
      sssfit simulate ./wax.toml --json
      sssfit simulate skin1 --target-error 0.1% --resume
      sssfit simulate tissue.mci --run 2
    """
    if (material is None) != every:
        raise click.UsageError("name one MATERIAL, or give --all.")
    if run is not None and not is_mci(material):
        raise click.UsageError("--run chooses a run of an MCML input file, .mci.")
    settings = {
        "photons": photons,
        "target_error": target_error,
        "dr_mm": dr,
        "radius_mm": radius,
        "seed": common.seed,
    }
    materials, walks = _walks(material, run, settings)
    several = every or len(materials) > 1
    targets = _targets(materials, output, several)
    if resume and targets == [None]:
        raise click.UsageError("--resume needs a file to go on beside; leave -o - out.")
    run_walks(materials, targets, walks, Request(checkpoint_every, resume, force, several, common))


def _walks(
    material: str | None, run: int | None, settings: dict[str, Any]
) -> tuple[list[Material], list[Walk]]:
    """Load what is asked for; each walk has the indices of its materials and its settings."""
    from sssfit.material import load_material, material_names
    from sssfit.simulate import shared_walks

    if material is not None and is_mci(material):
        materials, each = load_runs(material, run, settings)
        return materials, [([k], own) for k, own in enumerate(each)]
    names = material_names() if material is None else (material,)
    materials = [load_material(name) for name in names]
    return materials, [(group, settings) for group in shared_walks(materials)]


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
