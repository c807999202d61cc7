"""What tests have workers do; a worker imports it by name."""

import os
import signal
import time

from sssfit.errors import FitError


def scaled(times, shared, given):
    """Give what a worker has and was given, and which process it is."""
    return shared, times * given, os.getpid()


def refused(_shared, given):
    raise FitError(f"{given} is refused.")


def killed(_shared, _given):
    os.kill(os.getpid(), signal.SIGKILL)


def asleep(folder, given):
    (folder / str(given)).write_text(str(os.getpid()))
    time.sleep(600.0)


def large(_shared, given):
    """Give a result that takes a while to come through a pipe."""
    return bytes(given)
