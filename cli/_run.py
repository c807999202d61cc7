"""Run a verb and turn every failure into one line.

Exit status: 0 done, 1 a clear error, 2 wrong usage, 130 interrupted with what was done saved.
"""

import logging
import os
import sys
import warnings
from collections.abc import Sequence
from typing import NoReturn, TextIO

import click

from sssfit.errors import SssfitError, SssfitWarning
from sssfit.messages import printable
from sssfit.process import is_out_of_memory

from ._group import cli
from ._output import in_options

_LONGEST_LINE = 1000  # a path may be 4096 characters, an option's value anything
_OUT_OF_MEMORY = "out of memory: use a smaller grid or picture, fewer channels or --threads."


def run(args: Sequence[str] | None) -> NoReturn:
    """Run the command line and exit."""
    _keep_matplotlib_quiet()
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
        except BrokenPipeError:
            _leave_quietly()
        except OSError as error:
            if is_out_of_memory(error):
                _fail(_OUT_OF_MEMORY)
            _fail(
                f"{error.filename or 'operating system'}: {(error.strerror or str(error)).lower()}."
            )
        except Exception as error:
            if is_out_of_memory(error):
                _fail(_OUT_OF_MEMORY)
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
    context = getattr(error, "ctx", None)
    if context is not None:
        help_option = context.help_option_names[-1]
        click.echo(context.get_usage(), err=True)
        click.echo(f"Try '{context.command_path} {help_option}' for help.\n", err=True)
    # click lists the choices of an option on lines of their own.
    click.echo(f"Error: {_one_line(' '.join(error.format_message().split()))}", err=True)
    sys.exit(error.exit_code)


def _one_line(text: str) -> str:
    """Escape what would move the cursor or the line, and cut the middle out of what is too long."""
    line = printable(text)
    half = _LONGEST_LINE // 2
    return line if len(line) <= _LONGEST_LINE else f"{line[:half]} ... {line[-half:]}"


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
    """Print a warning as one line; of others than ours what they begin with, and their kind."""
    if os.environ.get("SSSFIT_TRACEBACK"):
        click.echo(warnings.formatwarning(message, category, filename, lineno, line), err=True)
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
