"""Errors and warnings, one line each: what arrived, what was expected, what to do."""


class SssfitError(ValueError):
    """Base class of all deliberate errors of the toolkit; its text is one line for the user."""


class ArgumentError(SssfitError):
    """Arguments that do not go together, or one that is missing."""


class MaterialError(SssfitError):
    """A material file or its values are invalid."""


class ProfileError(SssfitError):
    """A profile file or its values are invalid."""


class SimulationError(SssfitError):
    """A simulation cannot run with these inputs."""


class StoppedError(SimulationError):
    """A simulation was stopped before it had any result to keep."""


class KernelError(SssfitError):
    """A kernel file or its values are invalid."""


class FitError(SssfitError):
    """A profile cannot be fitted with these settings."""


class RenderError(SssfitError):
    """A picture cannot be rendered or compared with these settings."""


class PlanError(SssfitError):
    """A sweep's plan or its values are invalid."""


class SweepError(SssfitError):
    """A sweep cannot run, or not to its end; what is finished is kept."""


class FileError(SssfitError):
    """A file cannot be read, written or replaced."""


class SssfitWarning(UserWarning):
    """The result is valid, but the user should know something about it before using it."""
