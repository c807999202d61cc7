"""What every test leaves behind: no child process."""

import pytest
from processes import end_all


@pytest.fixture(autouse=True)
def no_child_outlives_its_test():
    """End what the test started and, having failed perhaps, did not end."""
    yield
    end_all()
