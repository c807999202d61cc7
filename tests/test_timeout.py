"""A test that hangs fails, in compiled code too."""

import subprocess
from pathlib import Path

import inner_pytest
import pytest

ROOT = Path(__file__).parents[1]
HANGS = {
    "python": "def test_it():\n    while True:\n        pass\n",
    # Signals wait for compiled code to come back; the limit must not.
    "compiled": (
        # With its signature given, it is compiled as it is read, which the limit does not count.
        'from numba import njit\n\n\n@njit("int64()", nogil=True)\ndef spin():\n'
        "    k = 0\n    while k >= 0:\n"
        "        k = (k + 1) % 1000\n    return k\n\n\ndef test_it():\n    spin()\n"
    ),
}


@pytest.mark.parametrize("kind", list(HANGS))
def test_a_test_that_hangs_fails(tmp_path, kind):
    (tmp_path / "test_hang.py").write_text(HANGS[kind])
    ended = subprocess.run(
        [
            *inner_pytest.COMMAND,
            *("-c", ROOT / "pyproject.toml", "-o", "timeout=0.2", tmp_path / "test_hang.py"),
        ],
        env=inner_pytest.ENVIRONMENT,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert ended.returncode == 1
    assert "Timeout" in ended.stderr + ended.stdout


def test_every_test_has_a_limit(request):
    assert 0.0 < float(request.config.getini("timeout")) <= 600.0


@pytest.mark.slow
def test_slow_tests_have_a_longer_one(request):
    assert request.node.get_closest_marker("timeout").args[0] > 3600.0
