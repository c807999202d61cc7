"""Options that verbs share, those of methods, made from their entries, and types of parameters."""

import contextlib
import functools
import logging
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import click
from click.core import ParameterSource

from sssfit import text
from sssfit.errors import ArgumentError, SssfitError
from sssfit.messages import did_you_mean, printable
from sssfit.methods import SIMULATIONS, Method, Setting, settings_of
from sssfit.process import check_memory, check_threads_of_numba

# The library's messages have arguments and calls of Python between backquotes.
_ARGUMENT = re.compile(r"(with )?`(\w+)(?: = ([^`]+))?`")
_OF_SWITCHES = "", "True", "False"
_COMMANDS = {
    "`simulate`": "`sssfit simulate`",
    '`simulate("deon-skin")`': "sssfit simulate deon-skin",
    "`material_names()`": "`sssfit materials`",
    "`simulate_montecarlo(material)`": "`sssfit simulate`",
    '`load_material("skin1").to_toml()`': "`sssfit materials skin1 --toml`",
}


@dataclass(frozen=True)
class Common:
    """What the options shared by all verbs said."""

    quiet: bool
    verbose: bool
    json: bool
    threads: int | None
    seed: int


def common_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add -q, -v, --json, --threads, --seed and hand them to the command as ``common``."""

    @options(
        flag("-q --quiet", "Print errors and warnings only."),
        flag("-v --verbose", "Print more."),
        flag("--json", "Print one JSON object on stdout."),
        option(
            "--threads",
            WholeRange(1, 1024),
            "N",
            "Threads to use; results do not depend on it.  [default: all cores]",
        ),
        option("--seed", WholeRange(0, 2**63 - 1), "N", "Random seed.", 1),
    )
    @functools.wraps(command)
    def wrapper(*args: Any, **given: Any) -> Any:
        common = Common(**{each.name: given.pop(each.name) for each in fields(Common)})
        try:
            check_threads_of_numba()
            check_memory(command.__name__.rstrip("_"), common.threads)
            with _notes_on_stderr(common.quiet):
                return command(*args, common=common, **given)
        except SssfitError as error:
            kind = click.UsageError if isinstance(error, ArgumentError) else click.ClickException
            raise kind(in_options(str(error))) from None

    return wrapper


class _Notes(logging.Handler):
    def __init__(self, context: click.Context) -> None:
        super().__init__()
        self.context = context  # threads, from which notes come too, have none of their own

    def emit(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(OSError), self.context.scope(cleanup=False):
            click.echo(printable(in_options(record.getMessage())), err=True)


@contextlib.contextmanager
def _notes_on_stderr(quiet: bool) -> Iterator[None]:
    """Print notes, the library's and ours, on stderr, unless ``quiet``; a lost one ends no run."""
    log, handler = logging.getLogger("sssfit"), _Notes(click.get_current_context())
    log.setLevel(logging.ERROR if quiet else logging.INFO)
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(logging.NOTSET)


def in_options(message: str) -> str:
    """Put options in place of the arguments that a message of the library names.

    ``rank = 3`` between backquotes becomes ``--rank 3``; an argument that is True becomes the
    option alone, and "with" one that is False becomes "without" it. Units at the end of an
    argument's name are not part of the option's. An option of another verb is named with it.
    """

    def option(found: re.Match[str]) -> str:
        before, name, value = found[1] or "", found[2], (found[3] or "").strip('"')
        verb, named = _named(name, value)
        before = "without " if value == "False" else before
        words = named if value in _OF_SWITCHES else f"{named} {value}"
        return before + (f"`sssfit {verb} {words}`" if verb else words) if named else found[0]

    for call, command in _COMMANDS.items():
        message = message.replace(call, command)
    return _ARGUMENT.sub(option, message)


def _named(name: str, value: str) -> tuple[str, str]:
    """Return the verb, if it is not the one that runs, and its option for an argument, or none."""
    from ._main import cli

    context = click.get_current_context(silent=True)
    own, names = context and context.command.name, (name, re.sub(r"_mm2?$", "", name))
    found = [
        ((not _takes(each, value), verb != own, verb != "simulate"), verb, each.opts[-1])
        for verb, command in cli.commands.items()
        for each in command.params
        if each.name in names and isinstance(each, click.Option)
    ]
    _, verb, option = min(found, key=lambda each: each[0], default=(None, "", ""))
    return "" if own in (None, verb) else verb, option


def _takes(option: click.Option, value: str) -> bool:
    """Return whether the option can have this value; "" is one that is not said."""
    among = option.type.choices if isinstance(option.type, click.Choice) else (value,)
    return not value or (option.is_flag == (value in _OF_SWITCHES) and value in among)


def option(
    names: str, kind: Any, metavar: str | None, text: str, default: Any = None, **more: Any
) -> Any:
    """Return an option, for tables of a row an option.

    ``names`` are "--radius", or "--radius radius_mm" with the name of the parameter; ``kind`` is a
    click type, a list of choices or None for text. A default is shown.
    """
    return click.option(
        *names.split(),
        type=Choice(kind) if isinstance(kind, list | tuple) else kind,
        metavar=metavar,
        help=text,
        **({} if default is None else {"default": default, "show_default": True}),
        **more,
    )


def flag(names: str, text: str) -> Any:
    """Return a switch."""
    return click.option(*names.split(), is_flag=True, help=text)


def options(*rows: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return what adds options to a command, in their order."""

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for each in reversed(rows):
            command = each(command)
        return command

    return add


def output(default: str, what: str, text: str = "Output file, - for stdout") -> tuple[Any, Any]:
    """Return the options of the file to write, and of replacing one that is not ``what``."""
    file = option("-o --output", None, "FILE", f"{text}.  [default: {default}]")
    return file, flag("--force", f"Replace an input, or a file that {what}.")


SHIPPED = (
    flag("--all every", "All materials without layers that ship with sssfit."),
    flag("--paper", "The eleven materials of the Separable Subsurface Scattering paper."),
)
STRICT = flag("--strict", "End with an error in place of a warning of an unsafe kernel.")


def refuse(given: Mapping[str, Any], whose: Mapping[str, str]) -> None:
    """Refuse options that would do nothing; ``whose`` says of each parameter what it is for."""
    context = click.get_current_context()
    named = {each.name: each.opts[-1] for each in context.command.params}
    for key, owner in whose.items():
        is_said = context.get_parameter_source(key) is ParameterSource.COMMANDLINE
        if is_said and given[key] not in (None, False, ()):
            raise click.UsageError(f"{named[key]} is for {owner}; leave it out.")


class Choice(click.Choice[str]):
    """One of some words; what is nearly one is answered by the word that was probably meant."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        """Name what arrived and all choices."""
        near = did_you_mean(str(value), self.choices)
        return f"{super().get_invalid_choice_message(value, ctx)} {near.capitalize()}".strip()


class WholeRange(click.IntRange):
    """A range of whole numbers, named as such in the line said about what is not one."""

    name = "whole number"


class Value(click.ParamType[Any]):
    """What a function of the library reads from a text; its ArgumentError is a usage error."""

    def __init__(self, name: str, read: Callable[..., Any], *how: Any) -> None:
        self.name, self.read, self.how = name, read, how

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read ``value``; a default that is no text stays as it is."""
        try:
            return self.read(value, *self.how) if isinstance(value, str) else value
        except ArgumentError as error:
            self.fail(str(error), param, ctx)


Number = functools.partial(Value, "number", text.number)
Numbers = functools.partial(Value, "list of numbers", text.numbers)
Length = functools.partial(Value, "length", text.length_mm)
Lengths = functools.partial(Value, "list of lengths", text.lengths_mm)
Count = functools.partial(Value, "count", text.whole_number)
Size = functools.partial(Value, "size", text.size)
Names = functools.partial(Value, "list of names", text.names)
Shift = functools.partial(Value, "shift", text.shift)
Share = functools.partial(Value, "share", text.share)
Part = functools.partial(Value, "share", text.part)
BaseColour = functools.partial(Value, "list of reflectances", text.base_colour)


class NumberRange(click.FloatRange):
    """A range of finite numbers; float("nan") compares as no limit expects."""

    name = "number"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Parse ``value``; a usage error (exit 2) names what was expected."""
        number: float = super().convert(Number().convert(value, param, ctx), param, ctx)
        return number


_KINDS: dict[str, Callable[[Setting], Any]] = {
    "number": lambda _: Number(),
    "numbers": lambda _: Numbers(),
    "length": lambda _: Length(),
    "share": lambda _: Share(),
    "part": lambda _: Part(),
    "parts": lambda _: Value("list of shares", text.parts),
    "seconds": lambda _: NumberRange(min=0),
    "count": lambda each: Count(*each.among),
    "whole": lambda each: WholeRange(*each.among),
    "text": lambda _: None,
    "choice": lambda each: Choice(each.among),
}


def method_options(methods: Mapping[str, Method]) -> Callable[..., Any]:
    """Return what adds the settings of all methods as options, in the order of the methods."""
    return options(*(_of_setting(*each) for each in settings_of(methods).values()))


def _of_setting(each: Setting, owners: tuple[str, ...]) -> Any:
    """Return the option that asks for a setting; its help begins with the methods that have it."""
    name, text = f"--{each.name.replace('_', '-')}", f"{', '.join(owners)}: {each.help}"
    if each.kind == "flag":
        return flag(name, text)
    words = f"  [default: {each.words}]" if each.words else ""
    return option(name, _KINDS[each.kind](each), each.metavar or None, text + words, each.default)


def own_settings(
    context: click.Context,
    methods: Mapping[str, Method],
    method: str,
    given: Mapping[str, Any],
    by: str = "--method",
) -> dict[str, Any]:
    """Keep the method's own settings that were given, by keyword; refuse those of others.

    ``by`` is the option that names the method.
    """
    known = settings_of(methods)
    for option in filter(known.__contains__, given):
        is_given = context.get_parameter_source(option) is ParameterSource.COMMANDLINE
        owners = known[option][1]
        if is_given and method not in owners:
            raise click.UsageError(
                f"--{option.replace('_', '-')} is for {by} {' or '.join(owners)}, and this is "
                f"{method}; leave it out."
            )
    settings = methods[method].settings if method in methods else ()
    own = {each.name: each.keyword or each.name for each in settings}
    return {
        own[key]: value
        for key, value in given.items()
        if key in own and value is not None and value is not False  # 0 is a value
    }


def method_for(context: click.Context, method: str, material: str | None) -> str:
    """Return the method that a name asks for; refuse a method and a name that do not go together.

    A name of a profile that a method makes has no coefficients, and no other method can use it.
    """
    made = SIMULATIONS[method].makes
    if made is not None and material != made:
        raise click.UsageError(
            f"--method {method} makes {made} only, and this is {material or '--all'}; for "
            "sums of Gaussians of a material's profile use sssfit fit --method gaussians."
        )
    owners = [name for name, each in SIMULATIONS.items() if each.makes == material]
    if material is None or not owners or method in owners:
        return method
    if context.get_parameter_source("method") is ParameterSource.COMMANDLINE:
        raise click.UsageError(
            f"{material} has no coefficients, and --method {method} needs them; use --method "
            f"{owners[0]} or leave it out."
        )
    return owners[0]
