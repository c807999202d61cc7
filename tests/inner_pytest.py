"""Pytest run by a test: without plugins that our settings do not need, which take 0.7 s to load."""

import os
import sys

COMMAND = [
    *(sys.executable, "-m", "pytest", "-p", "no:cacheprovider"),
    *("-p", "xdist.plugin", "-p", "pytest_timeout"),
]
ENVIRONMENT = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
