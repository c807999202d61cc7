"""What holds for all tests: Ctrl-C arrives, no child process is left, and none runs for ever."""

import signal

import pytest
from processes import end_all

SLOW_SECONDS = 4 * 3600.0  # the longest, a walk of 1e8 photons through layers, takes under one

# A shell starts its background jobs with SIGINT ignored, and children inherit that: tests of Ctrl-C
# would wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Give slow tests a limit of their own; ``timeout`` in pyproject.toml holds for the rest."""
    for item in items:
        if item.get_closest_marker("slow") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(SLOW_SECONDS))


@pytest.fixture(autouse=True)
def no_child_outlives_its_test():
    """End what the test started and, having failed perhaps, did not end."""
    yield
    end_all()
