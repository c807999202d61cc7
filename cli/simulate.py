"""``sssfit simulate``: a material to its diffuse reflectance profile."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ._options import Common, Count, Length, common_options
from ._report import finish, say, table

if TYPE_CHECKING:
    from sssfit.material import Material
    from sssfit.profile import Profile


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
    help="Where the profile goes, - for stdout; with --all a folder."
    "  [default: MATERIAL.profile.npz]",
)
@click.option("--force", is_flag=True, help="Replace a file that is not a profile.")
@common_options
def simulate(
    material: str | None,
    every: bool,
    photons: int,
    dr: float | None,
    radius: float | str | None,
    output: str | None,
    force: bool,
    common: Common,
) -> None:
    """Trace photons through MATERIAL and write its diffuse reflectance profile.

    MATERIAL is a name (`sssfit materials` lists them), a path to your own TOML, or - for stdin.
    The profile is R_d(r) per channel as energy in annuli with standard errors, for a normally
    incident pencil beam, in mm. Ctrl-C saves what is done, with its true photon count.

    \b
      sssfit simulate skin1
      sssfit simulate skin1 --photons 1e8 --radius auto -o fine.profile.npz
      sssfit simulate ./wax.toml --json
    """
    if (material is None) != every:
        raise click.UsageError("name one MATERIAL, or give --all.")
    from sssfit.material import load_material, material_names

    names = material_names() if every else (material or "",)
    materials = [load_material(name) for name in names]
    targets = _targets(materials, output, every)
    settings = {"photons": photons, "dr_mm": dr, "radius_mm": radius}
    _run(materials, targets, settings, force=force, every=every, common=common)


def _targets(materials: list[Material], output: str | None, every: bool) -> list[Path | None]:
    """Where each profile goes; None is stdout."""
    if output == "-":
        if every:
            raise click.UsageError("--all writes several files; -o names a folder for them.")
        return [None]
    if every or output is None:
        folder = Path(output or ".")
        return [folder / f"{each.name}.profile.npz" for each in materials]
    return [Path(output)]


def _run(
    materials: list[Material],
    targets: list[Path | None],
    settings: dict[str, Any],
    *,
    force: bool,
    every: bool,
    common: Common,
) -> None:
    """Walk, write each profile as its walk ends, and report."""
    from contextlib import ExitStack

    from sssfit.files import check_output, locked
    from sssfit.profile import is_profile_file

    from ._interrupt import asked_to_stop

    rows: list[dict[str, Any]] = []
    interrupted = False
    with ExitStack() as held:
        for path in filter(None, targets):
            check_output(path, is_profile_file, force=force)
            held.enter_context(locked(path))
        stop = held.enter_context(asked_to_stop())
        for group in _by_eta(materials):
            if stop():
                break
            profiles, seconds = _walk([materials[k] for k in group], settings, stop, common)
            for k, profile in zip(group, profiles, strict=True):
                _write(profile, targets[k])
                rows.append(_figures(materials[k], profile, seconds, targets[k]))
        interrupted = stop()
    _report(rows, targets, every=every, common=common, interrupted=interrupted)
    if interrupted:
        sys.exit(130)


def _by_eta(materials: list[Material]) -> list[list[int]]:
    """Indices of the materials that can share a walk: those of one relative refractive index."""
    groups: dict[float, list[int]] = {}
    for k, material in enumerate(materials):
        groups.setdefault(material.layers[0].eta / material.eta_above, []).append(k)
    return list(groups.values())


def _walk(
    materials: list[Material], settings: dict[str, Any], stop: Any, common: Common
) -> tuple[list[Profile], float]:
    """One walk for all ``materials``, with a progress bar; the profiles and the wall time."""
    from time import perf_counter

    from sssfit._jit import compiled_before
    from sssfit.simulate import simulate_montecarlo_many

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


def _figures(
    material: Material, profile: Profile, seconds: float, path: Path | None
) -> dict[str, Any]:
    """The figures of one run, as ``--json`` prints them."""
    photons = profile.meta["photons"]
    return {
        "material": material.name,
        "method": "montecarlo",
        "channels": list(material.channels),
        "diffuse_reflectance": profile.diffuse_reflectance,
        "diffuse_reflectance_stderr": profile.diffuse_reflectance_stderr,
        "specular_reflectance": profile.specular_reflectance,
        "absorbed": profile.absorbed.sum(axis=0),
        "beyond_grid": profile.beyond_grid,
        "unfinished": profile.unfinished,
        "energy_balance": profile.energy_balance,
        "energy_balance_stderr": profile.meta["energy_balance_stderr"],
        "dr_mm": float(profile.r_edges_mm[1]),
        "annuli": profile.n_annuli,
        "photons": photons,
        "seed": profile.meta["seed"],
        "seconds": seconds,
        "photons_per_second": photons / seconds,
        "path": "-" if path is None else str(path),
    }


def _report(
    rows: list[dict[str, Any]],
    targets: list[Path | None],
    *,
    every: bool,
    common: Common,
    interrupted: bool,
) -> None:
    """Figures to stdout (to stderr where the profile itself went to stdout)."""
    output = [row.pop("path") for row in rows]
    figures = {"command": "simulate", "output": output}
    figures |= {"rows": rows} if every else (rows[0] if rows else {})
    if interrupted:
        figures["interrupted"] = True
        say(common, "Interrupted: what was done by then is saved, with its true photon count.")
    text = "\n\n".join(_text(row, path) for row, path in zip(rows, output, strict=True))
    finish(common, figures, text, to_stderr=targets == [None])


def _text(row: dict[str, Any], path: str) -> str:
    """One run for people."""
    heads = ("channel", "diffuse R", "+- stderr", "absorbed", "beyond grid", "unfinished", "sum - 1")
    lines = [
        (
            name,
            f"{row['diffuse_reflectance'][c]:.6f}",
            f"{row['diffuse_reflectance_stderr'][c]:.1e}",
            f"{row['absorbed'][c]:.6f}",
            f"{100.0 * row['beyond_grid'][c] / max(row['diffuse_reflectance'][c], 1e-300):.3f} %",
            f"{row['unfinished'][c]:.1e}",
            f"{row['energy_balance'][c]:+.0e} +- {row['energy_balance_stderr'][c]:.0e}",
        )
        for c, name in enumerate(row["channels"])
    ]
    return (
        f"{row['material']}: {row['photons']:,} photons in {row['seconds']:.1f} s "
        f"({row['photons_per_second'] / 1e6:.1f} million/s), seed {row['seed']}, "
        f"{row['annuli']} annuli of {row['dr_mm']:.4g} mm\n"
        + table(heads, lines)
        + f"\nspecular reflectance {row['specular_reflectance']:.6f}; sum = specular + diffuse "
        "+ absorbed + unfinished; beyond grid: share of diffuse R\n"
        f"Wrote {path}"
    )
