"""The command line: ``main`` assembles the verbs and turns every failure into one line.

Nothing heavy is imported here or at the head of a verb's file, so ``--help`` answers at once; a
verb imports the library in its body. Exit status: 0 done, 1 a clear error, 2 wrong usage, 130
interrupted with what was done saved.
"""

import logging
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn, TextIO

import click

from sssfit import __version__
from sssfit.errors import SssfitError, SssfitWarning

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
    """Subsurface scattering kernels: from a material to what a real-time shader can afford.

    A first session:

    \b
      sssfit materials                      list the materials that ship with sssfit
      sssfit simulate skin1                 trace 1e7 photons: skin1.profile.npz
      sssfit simulate skin1 --method exact  the same without noise, in a second
      sssfit chart skin1.profile.npz        draw it: skin1.profile.png
      sssfit show skin1.profile.npz         its figures
      sssfit fit --method svd --rank 3      fit a separable kernel to it
      sssfit render --irradiance head       see it on a lit head, and what it loses
      sssfit export --format hlsl           write it as shader source
      sssfit compare skin1                  what every kernel of it loses and costs, and why
      sssfit choose skin1 --distance 0.6m   the cheapest that a view can do with

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


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; the console script's entry point."""
    _terminate_like_interrupt()
    _keep_matplotlib_quiet()
    with warnings.catch_warnings():
        warnings.simplefilter("always", SssfitWarning)
        warnings.showwarning = _show_warning
        try:
            status = cli.main(args, prog_name="sssfit", standalone_mode=False)
        except click.ClickException as error:
            error.show()
            sys.exit(error.exit_code)
        except SssfitError as error:
            _fail(str(error))
        except (KeyboardInterrupt, click.Abort):
            click.echo("Interrupted.", err=True)
            sys.exit(130)
        except BrokenPipeError:
            _leave_quietly()
        except MemoryError:
            _fail("out of memory: use a smaller grid, fewer channels or fewer --threads.")
        except OSError as error:
            _fail(
                f"{error.filename or 'operating system'}: {(error.strerror or str(error)).lower()}."
            )
        except Exception as error:
            if os.environ.get("SSSFIT_TRACEBACK"):
                raise
            _fail(
                f"internal error, {type(error).__name__}: {' '.join(str(error).split())}. "
                "Please report it with the output of the same command under SSSFIT_TRACEBACK=1."
            )
    sys.exit(status if isinstance(status, int) else 0)


def _fail(line: str) -> NoReturn:
    """Print one line on stderr and exit 1."""
    click.echo(f"Error: {line}", err=True)
    sys.exit(1)


def _leave_quietly() -> NoReturn:
    """End when the reader of our output has gone (``sssfit ... | head``), as other tools do."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(141)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,  # noqa: ARG001 (part of the protocol)
    line: str | None = None,
) -> None:
    """Print our own warnings as one line, others as Python would."""
    if issubclass(category, SssfitWarning):
        click.echo(f"Warning: {message}", err=True)
    else:
        click.echo(warnings.formatwarning(message, category, filename, lineno, line), err=True)


def _terminate_like_interrupt() -> None:
    """Make SIGTERM act as Ctrl-C (exit 130) wherever a verb does not handle it itself."""

    def interrupt(_signal: int, _frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)


def _keep_matplotlib_quiet() -> None:
    """Leave stderr and the choice of a backend to us; colour-science imports matplotlib as well.

    It logs where it keeps its cache of fonts, and what it cannot read of a file of settings, and
    an unknown MPLBACKEND is an error on import. Charts are drawn by Agg, without a display.
    """
    logging.getLogger("matplotlib").addHandler(logging.NullHandler())
    os.environ["MPLBACKEND"] = "agg"


def _print_version(*, with_libraries: bool) -> None:
    """Print our version, then what is installed underneath (read from metadata, not imported)."""
    click.echo(f"sssfit {__version__}")
    if with_libraries:
        from importlib.metadata import version

        click.echo(f"python {sys.version.split()[0]}")
        for library in _LIBRARIES:
            click.echo(f"{library} {version(library)}")
