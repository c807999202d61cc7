"""``sssfit show``."""

import click

from ._options import Common, common_options


@click.command()
@common_options
def show(common: Common) -> None:
    """To be written."""
