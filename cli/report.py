"""``sssfit report``: one HTML page about a material, or an index of all of them."""

from __future__ import annotations

from typing import Any

import click

from ._input import load, load_source
from ._options import Common, common_options, options, refuse
from ._output import finish_one, held, stem_of, target, write
from ._progress import step_progress
from ._verb_options import REPORT

_OF_ONE = ("kernels", "irradiance", "mm_per_pixel", "only", "photons")


@click.command(short_help="Write one HTML page with kernels running in it.")
@click.argument("material", required=False)
@options(*REPORT)
@common_options
def report(material: str | None, common: Common, **given: Any) -> None:
    """Write one HTML page about MATERIAL, with its kernels running in the page.

    The page runs the exported GLSL by WebGL2 beside the true picture, on a head under three lights
    at three distances, a disk and an edge. It has charts, tables and exports, and needs no network.
    With --all it is an index of the materials that ship with sssfit.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or a .profile.npz
    file, - for one on stdin.

    \b
      sssfit report skin1 -o skin1.html
      sssfit report skin1 --kernel mine.taps.json --irradiance face.exr
      sssfit report --all -o materials.html
    """
    if (material is None) != given["every"]:
        raise click.UsageError("name one MATERIAL or profile, or give --all.")
    refuse(given, dict.fromkeys(_OF_ONE, "one MATERIAL") if given["every"] else {})
    from sssfit.kernel import Taps
    from sssfit.material import load_material, material_names
    from sssfit.report import finished_page, is_report_file, library_page

    name = "materials" if material is None else stem_of(material, "profile")
    path = target(given["output"], f"{name}.html")
    hold: dict[str, Any] = {"inputs": [material, given["irradiance"], *given["kernels"]]}
    hold |= {"force": given["force"], "named": ("a page", ".html")}
    with held([path], is_report_file, **hold), step_progress(name) as step:
        if material is None:
            every = [load_material(each) for each in material_names()]
            own: dict[str, Any] = {"threads": common.threads, "progress": step}
            text = library_page(every, beside=path and path.parent, **own)
            figures: dict[str, Any] = {"materials": [each.name for each in every]}
        else:
            own = {key: given[key] for key in _OF_ONE[1:] if given[key] is not None}
            named = [(stem_of(each), load(Taps.read, each)) for each in given["kernels"]]
            own |= {"origin": material, "kernels": list(given["kernels"])}
            own |= {"seed": common.seed, "threads": common.threads, "progress": step}
            made = finished_page(load_source(material), name=name, named=named, **own)
            text, figures = made["page"], {"material": material, **made["figures"]}
        write(text.encode(), path)
    finish_one(common, path, figures, made["words"] if material else "", "the page")
