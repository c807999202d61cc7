"""The group of all verbs; one is run, and every failure becomes one line.

Exit status: 0 done, 1 a clear error, 2 wrong usage, 130 interrupted with what was done saved,
141 nobody reads the output any more.
Nothing heavy is imported here or at the head of a verb's file, so ``--help`` answers at once; a
verb imports the library in its body.
"""

import errno
import logging
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

import click

from sssfit import __version__
from sssfit.errors import SssfitError, SssfitWarning
from sssfit.files import reason
from sssfit.messages import printable
from sssfit.process import is_out_of_memory, keep_memory

from ._options import in_options

# In the order of their help; each is a file here with a command of its name.
_VERBS = (
    *("materials", "simulate", "sweep", "fit", "render", "compare", "choose", "stability"),
    *("motion", "scene", "import_", "export", "chart", "report", "show"),
)
_LIBRARIES = (
    *("numpy", "scipy", "threadpoolctl", "nlopt", "numba", "llvmlite", "matplotlib"),
    *("colour-science", "OpenImageIO", "click", "rich", "jinja2", "markupsafe"),
)
_LONGEST_LINE = 1000  # a path may be 4096 characters, an option's value anything


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
      sssfit fit                            fit a cascade of 24 fetches to it
      sssfit render --irradiance head       see it on a lit head, with its error
      sssfit export --format hlsl           write it as shader source
      sssfit compare skin1                  error and cost of every kernel, and the causes
      sssfit report skin1                   one page with its kernels running in it
      sssfit choose skin1 --distance 0.6m   the cheapest kernel for a view

    Lengths are mm unless written with a unit (3cm, 0.6m). Every verb has --help.
    """
    if version:
        from importlib.metadata import version as of  # read, not imported

        found = [f"python {sys.version.split()[0]}", *(f"{each} {of(each)}" for each in _LIBRARIES)]
        click.echo("\n".join([f"sssfit {__version__}", *(found if verbose else [])]))
        ctx.exit(0)
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
        ctx.exit(2)


for _verb in _VERBS:
    cli.add_command(getattr(import_module(f".{_verb}", __package__), _verb))


def run(args: Sequence[str] | None) -> NoReturn:
    """Run the command line and exit."""
    _keep_matplotlib_quiet()
    # BLAS starts a thread a core with numpy, 70 ms of the processor, and waits for all of them at
    # each of the small products here. Zarr's, up to ten, take 75 MB of address space each.
    for name in ("OPENBLAS_NUM_THREADS", "ZARR_THREADING__MAX_WORKERS"):
        os.environ.setdefault(name, "1")
    keep_memory()
    with warnings.catch_warnings():
        warnings.simplefilter("always", SssfitWarning)
        warnings.showwarning = _show_warning
        try:
            status = cli.main(args, prog_name="sssfit", standalone_mode=False)
        except click.ClickException as error:
            _refuse(error)
        except SssfitError as error:
            _fail(in_options(str(error)))
        except (KeyboardInterrupt, click.Abort):
            click.echo("Interrupted.", err=True)
            sys.exit(130)
        except SystemExit as end:  # of a verb, of completion, or click's 1: the reader has gone
            is_gone = end.code == 1 and "_SSSFIT_COMPLETE" not in os.environ
            sys.exit(141 if is_gone else end.code)  # as other tools end (sssfit ... | head)
        except Exception as error:
            if is_out_of_memory(error):
                _fail("out of memory: use a smaller grid or picture, fewer channels or --threads.")
            if isinstance(error, OSError):
                full = error.errno in (errno.ENOSPC, errno.EFBIG)  # a file has its name told
                where = "stdout cannot be written" if full else "operating system"
                _fail(f"{error.filename or where}: {reason(error)}.")
            if os.environ.get("SSSFIT_TRACEBACK"):
                raise
            _fail(
                f"internal error, {type(error).__name__}: {' '.join(str(error).split())}. "
                "Please report it with the output of the same command under SSSFIT_TRACEBACK=1."
            )
    sys.exit(status if isinstance(status, int) else 0)


def _fail(line: str) -> NoReturn:
    """Print one line on stderr and exit 1."""
    click.echo(f"Error: {_one_line(line)}", err=True)
    sys.exit(1)


def _refuse(error: click.ClickException) -> NoReturn:
    """Print the usage, as click does, and then on one line what is wrong with it."""
    line, context = error.format_message(), getattr(error, "ctx", None)
    if context is not None:
        line = " ".join(line.split())  # click lists the choices of an option on lines of their own
        help_option = context.help_option_names[-1]
        click.echo(context.get_usage(), err=True)
        click.echo(f"Try '{context.command_path} {help_option}' for help.\n", err=True)
    click.echo(f"Error: {_one_line(line)}", err=True)
    sys.exit(error.exit_code)


def _one_line(text: str) -> str:
    """Escape what would move the cursor or the line, and cut the middle out of what is too long."""
    line, half = printable(text), _LONGEST_LINE // 2
    return line if len(line) <= _LONGEST_LINE else f"{line[:half]} ... {line[-half:]}"


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **_: Any) -> None:
    """Print a warning as one line; of others than ours what they begin with, and their kind."""
    if os.environ.get("SSSFIT_TRACEBACK"):
        click.echo(warnings.formatwarning(message, category, *where[:2]), err=True)
    elif issubclass(category, SssfitWarning):
        click.echo(f"Warning: {_one_line(in_options(str(message)))}", err=True)
    else:
        words = str(message).strip().partition("\n")[0]  # numba's go on with a traceback
        click.echo(f"Warning: {_one_line(words)} ({category.__name__})", err=True)


def _keep_matplotlib_quiet() -> None:
    """Leave stderr and the choice of a backend to us; colour-science imports matplotlib as well.

    It logs where it keeps its cache of fonts, and what it cannot read of a file of settings, and
    an unknown MPLBACKEND is an error on import. Charts are drawn by Agg, without a display.
    """
    logging.getLogger("matplotlib").addHandler(logging.NullHandler())
    os.environ["MPLBACKEND"] = "agg"
