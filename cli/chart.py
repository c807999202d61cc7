"""``sssfit chart``."""

import click

from ._options import Common, common_options


@click.command()
@common_options
def chart(common: Common) -> None:
    """To be written."""
