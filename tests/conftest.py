"""How long a test may take: ``timeout`` in pyproject.toml; four hours where it is marked slow."""

import pytest

SLOW_SECONDS = 4 * 3600.0  # the longest, a walk of 1e8 photons through layers, takes under one


def pytest_collection_modifyitems(items):
    """Give the tests marked slow a limit of their own."""
    for item in items:
        if item.get_closest_marker("slow") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(SLOW_SECONDS))
