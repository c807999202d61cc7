"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import click

from sssfit.messages import note
from sssfit.methods import SIMULATIONS, lines_of

from ._options import (
    SHIPPED,
    Common,
    Length,
    WholeRange,
    common_options,
    method_for,
    method_options,
    option,
    options,
    output,
    own_settings,
)
from ._output import binary_stdout, finish, write
from ._progress import walk_progress

_FIRST = "montecarlo"  # the only walk of photons
# fmt: off
_OPTIONS = (
    *SHIPPED,
    option("--method", [*SIMULATIONS], "METHOD", "Simulation method, as listed below.", _FIRST),
    option("--run number", WholeRange(1), "N", "Simulate only this run of an .mci file."),
    method_options(SIMULATIONS),
    option("--dr", Length(), "MM", "Annulus width.  [default: MFP_min / 20; deon-skin: 0.008]"),
    option("--beam", None, "KIND:RADIUS", "Beam in place of a pencil: gaussian, to 1/e^2, or flat, "
           "such as gaussian:500um."),
    option("--radius", Length("auto"), "MM|auto", "Grid radius; auto (montecarlo) enlarges it "
           "until under 0.1 % of any channel lies beyond.  [default: 32 MFP_max; deon-skin: 17.2]"),
    option("--scheduler", None, "ADDRESS", "montecarlo: Dask cluster that traces the photons: "
           "tcp://HOST:PORT, or local:N for N new workers.  [default: --threads of this process]"),
    *output("MATERIAL.profile.npz, MATERIAL.METHOD.profile.npz", "is not our profile",
            "Output file, - for stdout; a folder with --all"),
)
# fmt: on


@click.command(epilog="\b\nMethods:\n" + lines_of(SIMULATIONS))
@click.argument("material", required=False)
@options(*_OPTIONS)
@common_options
@click.pass_context
def simulate(
    context: click.Context, /, material: str | None, method: str, common: Common, **given: Any
) -> None:
    """Compute the diffuse reflectance profile of MATERIAL.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or - for stdin; or
    an MCML input file (.mci), which gives one profile per run, with the file's photons and grid
    unless options set them. The profile is R_d(r) per channel as energy in annuli with errors, for
    a normally incident pencil beam, in mm. Ctrl-C saves the photons traced so far and records their
    number. --resume continues from there, or from the last checkpoint of a killed run, and ends in
    the same bits as an undisturbed run.

    \b
      sssfit simulate skin1
      sssfit simulate skin1 --method exact
      sssfit simulate skin1 --method exact --beam gaussian:0.5 -o beam.profile.npz
      sssfit simulate skin1 --photons 1e8 --radius auto -o fine.profile.npz
      sssfit simulate ./wax.toml --json
      sssfit simulate skin1 --target-error 0.1% --resume
      sssfit simulate tissue.mci --run 2
      sssfit simulate deon-skin
      sssfit simulate skin1 --photons 1e9 --scheduler tcp://10.0.0.5:8786
    """
    scheduler = given.pop("scheduler")
    every, paper, number, dr, radius, output, force, beam = (
        given.pop(key)
        for key in ("every", "paper", "number", "dr", "radius", "output", "force", "beam")
    )
    if [material is not None, every, paper].count(True) != 1:
        raise click.UsageError("name one MATERIAL, or give --all or --paper.")
    from sssfit.formats.mci import is_mci
    from sssfit.process import asked_to_stop
    from sssfit.profile.beam import parse_beam
    from sssfit.simulate import runner

    if number is not None and not is_mci(material):
        raise click.UsageError("--run chooses a run of an MCML input file, .mci.")
    method = method_for(context, method, material)
    if scheduler is not None and method != _FIRST:
        raise click.UsageError("--scheduler is for --method montecarlo; leave it out.")
    own = own_settings(context, SIMULATIONS, method, given) | {"dr_mm": dr, "radius_mm": radius}
    if radius == "auto" and method != _FIRST:
        raise click.UsageError("--radius auto is for --method montecarlo; give a length.")
    how = {key: own.pop(key) for key in own.keys() & {"checkpoint_every", "resume"}}
    how |= {} if beam is None else {"beam": parse_beam(beam)}
    own |= {"threads": common.threads} if SIMULATIONS[method].shares else {}
    own |= {"seed": common.seed} if method == _FIRST else {}
    materials, settings = runner.runs_of(method, material, own, run=number, paper=paper)
    several, to_stdout = every or paper or len(materials) > 1, output == "-"
    if to_stdout and several:
        raise click.UsageError("there are several profiles; -o names a folder for them.")
    if to_stdout and how.get("resume"):
        raise click.UsageError("--resume needs a file to go on beside; leave -o - out.")
    if to_stdout:
        binary_stdout()
    paths = runner.paths_of(materials, method, output, several=several)
    how["inputs"] = [material] if material and SIMULATIONS[method].makes is None else []
    # What was done when it is stopped stays.
    with asked_to_stop() as stop, contextlib.ExitStack() as stack:
        if scheduler is not None:
            from sssfit.sweep.cluster import Batches

            settings = runner.traced_by(stack.enter_context(Batches(scheduler)), settings)
        asked = (materials, paths, method, settings)
        found = runner.simulate_to_files(*asked, force=force, stop=stop, watch=walk_progress, **how)
        if not found.outcomes:
            raise KeyboardInterrupt
        if to_stdout:
            write(found.outcomes[0].profile.write, None)
    if found.note:
        note(found.note)
    text = found.summary(several=several) + "\nWrote the profile to stdout" * to_stdout
    finish(common, found.to_dict(several=several), text)
    if found.is_interrupted:
        sys.exit(130)
