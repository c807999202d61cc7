"""Run a verb and turn every failure into one line.

Exit status: 0 done, 1 a clear error, 2 wrong usage, 130 interrupted with what was done saved.
"""

import logging
import os
import re
import sys
import warnings
from collections.abc import Sequence
from typing import NoReturn, TextIO

import click

from sssfit.errors import SssfitError, SssfitWarning
from sssfit.messages import printable

from ._group import cli
from ._memory import is_out_of_memory

_LONGEST_LINE = 1000  # a path may be 4096 characters, an option's value anything
# The library's messages have arguments and calls of Python between backquotes.
_ARGUMENT = re.compile(r"(with )?`(\w+)(?: = ([^`]+))?`")
_COMMANDS = {
    "`material_names()`": "`sssfit materials`",
    "`simulate_montecarlo(material)`": "`sssfit simulate`",
    '`load_material("skin1").to_toml()`': "`sssfit materials skin1 --toml`",
}
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


def in_options(message: str) -> str:
    """Put options in place of the arguments that a message of the library names.

    ``rank = 3`` between backquotes becomes ``--rank 3``; an argument that is True becomes the
    option alone, and "with" one that is False becomes "without" it. Units at the end of an
    argument's name are not part of the option's.
    """
    options = {
        parameter.name: parameter.opts[-1]
        for verb in cli.commands.values()
        for parameter in verb.params
        if isinstance(parameter, click.Option)
    }

    def option(found: re.Match[str]) -> str:
        before, name, value = found[1] or "", found[2], found[3]
        named = options.get(name) or options.get(re.sub(r"_mm2?$", "", name))
        if named is None:
            return found[0]
        if value in (None, "True"):
            return before + named
        plain = value.strip('"')
        return f"without {named}" if plain == "False" else f"{before}{named} {plain}"

    for call, command in _COMMANDS.items():
        message = message.replace(call, command)
    return _ARGUMENT.sub(option, message)


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
