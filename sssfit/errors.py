"""Errors and warnings, one line each: what arrived, what was expected, what to do."""


class SssfitError(ValueError):
    """Base of every error the toolkit raises on purpose; its text is one line for the user."""


class ArgumentError(SssfitError):
    """Arguments that do not go together, or one that is missing."""


class MaterialError(SssfitError):
    """A material file or its values cannot be used."""


class ProfileError(SssfitError):
    """A profile file or its values cannot be used."""


class SimulationError(SssfitError):
    """A simulation cannot be run as asked."""


class StoppedError(SimulationError):
    """A simulation was stopped before anything was done that could be kept."""


class KernelError(SssfitError):
    """A kernel file or its values cannot be used."""


class FitError(SssfitError):
    """A profile cannot be fitted as asked."""


class RenderError(SssfitError):
    """A picture cannot be rendered or compared as asked."""


class FileError(SssfitError):
    """A file cannot be read, written or replaced."""


class SssfitWarning(UserWarning):
    """The result stands, but something about it should be known before it is used."""
