"""``python -m sssfit.cli``."""

from . import main

main()
