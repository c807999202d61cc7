"""Options of methods, made from their entries in ``sssfit.methods``; which a method takes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click
from click.core import ParameterSource

from sssfit.methods import SIMULATIONS, Method, Setting, settings_of

from ._options import Count, Length, ListOf, Number, NumberRange, Share, WholeRange

_KINDS: dict[str, Callable[[Setting], Any]] = {
    "number": lambda _: Number(),
    "numbers": lambda _: ListOf(Number()),
    "length": lambda _: Length(),
    "share": lambda _: Share(),
    "seconds": lambda _: NumberRange(min=0),
    "count": lambda each: Count(*each.among),
    "whole": lambda each: WholeRange(*each.among),
    "choice": lambda each: click.Choice(each.among),
}


def method_options(
    methods: Mapping[str, Method],
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return what adds the settings of all methods as options, in the order of the methods."""

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for each, owners in reversed(settings_of(methods).values()):
            command = _option(each, owners)(command)
        return command

    return add


def _option(each: Setting, owners: tuple[str, ...]) -> Callable[..., Any]:
    """Return the option that asks for a setting; its help begins with the methods that have it."""
    name, text = f"--{each.name.replace('_', '-')}", f"{', '.join(owners)}: {each.help}"
    if each.kind == "flag":
        return click.option(name, is_flag=True, help=text)
    return click.option(
        name,
        type=_KINDS[each.kind](each),
        metavar=each.metavar or None,
        default=each.default,
        show_default=each.default is not None,
        help=text + (f"  [default: {each.words}]" if each.words else ""),
    )


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
    for option in given:
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
        asked = "--all" if material is None else material
        raise click.UsageError(
            f"--method {method} makes {made} only, and this is {asked}; for sums of Gaussians of a "
            "material's profile use sssfit fit --method gaussians."
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
