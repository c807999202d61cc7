"""``sssfit compare``: kernels of one material, held against one another."""

from __future__ import annotations

import click

from ._compare_sheet import chart_convergence, chart_editing, chart_sheet
from ._options import Common, Count, Length, common_options


@click.command()
@click.argument("material", default="skin1")
@click.option("--sheet", metavar="FILE", help="Draw a contact sheet of every kernel's pictures.")
@click.option(
    "--editing", metavar="FILE", help="Draw the 2012 model edited by hand; needs no MATERIAL."
)
@click.option(
    "--convergence", metavar="FILE", help="Draw the simulation's error over photons and seconds."
)
@click.option(
    "--mm-per-pixel",
    type=Length(),
    metavar="MM",
    help="Pixels of the pictures, with --sheet.  [default: 0.3]",
)
@click.option(
    "--photons",
    type=Count(2, 10**10),
    metavar="N",
    help="The most walked, with --convergence.  [default: 1e7]",
)
@click.option("--force", is_flag=True, help="Replace a file that is not a chart.")
@common_options
def compare(
    material: str,
    sheet: str | None,
    editing: str | None,
    convergence: str | None,
    mm_per_pixel: float | None,
    photons: int | None,
    force: bool,
    common: Common,
) -> None:
    """Hold kernels of MATERIAL against one another.

    \b
      sssfit compare skin1 --sheet skin1-sheet.png
      sssfit compare --editing editing.png
      sssfit compare skin1 --convergence skin1-convergence.png --photons 1e8
    """
    if not (sheet or editing or convergence):
        raise click.UsageError("name a chart: --sheet, --editing or --convergence.")
    for option, value, owner in (
        ("--mm-per-pixel", mm_per_pixel, sheet),
        ("--photons", photons, convergence),
    ):
        if value is not None and not owner:
            raise click.UsageError(f"{option} is for another chart; leave it out.")
    if sheet:
        from sssfit.material import load_material
        from sssfit.simulate import simulate_exact

        profile = simulate_exact(load_material(material), threads=common.threads)
        chart_sheet(profile, sheet, mm_per_pixel, common, force=force)
    if editing:
        chart_editing(editing, common, force=force)
    if convergence:
        chart_convergence(material, convergence, photons, common, force=force)
