"""The group of all verbs, and what is printed without one.

Nothing heavy is imported here or at the head of a verb's file, so ``--help`` answers at once; a
verb imports the library in its body.
"""

import sys

import click

from sssfit import __version__

from .chart import chart
from .choose import choose
from .compare import compare
from .export import export
from .fit import fit
from .import_ import import_
from .materials import materials
from .render import render
from .show import show
from .simulate import simulate

_LIBRARIES = (
    *("numpy", "scipy", "threadpoolctl", "nlopt", "numba", "llvmlite", "matplotlib"),
    *("colour-science", "OpenImageIO", "click", "rich"),
)


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, help="Print the version; with -v the libraries' too.")
@click.option("-v", "--verbose", is_flag=True, help="With --version: the libraries underneath.")
@click.pass_context
def cli(ctx: click.Context, version: bool, verbose: bool) -> None:
    """Subsurface scattering kernels for real-time shaders, from a material's coefficients.

    A first session:

    \b
      sssfit materials                      list the materials that ship with sssfit
      sssfit simulate skin1                 trace 1e7 photons: skin1.profile.npz
      sssfit simulate skin1 --method exact  the same without noise, in a second
      sssfit chart skin1.profile.npz        draw it: skin1.profile.png
      sssfit show skin1.profile.npz         its figures
      sssfit fit --method svd --rank 3      fit a separable kernel to it
      sssfit render --irradiance head       see it on a lit head, with its error
      sssfit export --format hlsl           write it as shader source
      sssfit compare skin1                  error and cost of every kernel, and the causes
      sssfit choose skin1 --distance 0.6m   the cheapest kernel for a view

    Lengths are mm unless written with a unit (3cm, 0.6m). Every verb explains itself with --help.
    """
    if version:
        _print_version(with_libraries=verbose)
        ctx.exit(0)
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
        ctx.exit(2)


for _verb in (*(materials, simulate, fit, render, compare, choose, import_, export, chart, show),):
    cli.add_command(_verb)


def _print_version(*, with_libraries: bool) -> None:
    """Print our version, then what is installed underneath (read from metadata, not imported)."""
    click.echo(f"sssfit {__version__}")
    if with_libraries:
        from importlib.metadata import version

        click.echo(f"python {sys.version.split()[0]}")
        for library in _LIBRARIES:
            click.echo(f"{library} {version(library)}")
