"""Kernels as text for other programs: source of shaders and of C, and documents."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from sssfit import kinds
from sssfit.arrays import FloatArray
from sssfit.errors import FileError, KernelError
from sssfit.export.dense import dense, taps_of_kernel
from sssfit.export.dense import energy_in_half as dense_in_half
from sssfit.export.dialects import DIALECTS
from sssfit.export.document import json_document, taps_document
from sssfit.export.lut import ENDINGS
from sssfit.export.shader import Style, source
from sssfit.export.shader import energy_in_half as taps_in_half
from sssfit.kernel import Kernel, SeparableKernel, Taps
from sssfit.messages import by_channel, note, of_material, printable, shown
from sssfit.methods import EXPORTS, settings_of
from sssfit.profile import Profile

__all__ = ["DIALECTS", "Style", "dense", "json_document", "kernel_text", "source", "taps_document"]

MOST_WEIGHTS = 65  # of a pass that is written as a loop of fetches without being asked twice
_FIGURES = ("channels", "rank", "pixels", "mm_per_pixel")
_TAPS_FIGURES = ("channels", "structure", "fetches", "passes", "mm_per_pixel")


class Exported(NamedTuple):
    """What a format makes of kernels or profiles."""

    content: bytes
    of: str  # "profile" or "kernel"
    what: str  # it is, with the article
    tag: str  # between the names of the input and the ending, or nothing
    ending: str
    figures: dict[str, Any]  # those of ``sssfit export --json``

    def __repr__(self) -> str:
        size = f"{len(self.content):,} bytes"
        return f"<Exported {self.what} ({self.tag}{self.ending}) of a {self.of}, {size}>"

    @property
    def stdout(self) -> str:
        """What goes to stdout, in words."""
        return self.what.replace("a ", "the ")


def exported(
    sources: Sequence[Profile | Kernel], form: str, *, ending: str = "", **settings: Any
) -> Exported:
    """Return kernels or a profile as a file of another program.

    Parameters
    ----------
    sources : sequence of Profile, SeparableKernel or Taps
        Several tables of taps with the same stages become one source, indexed by profile.
    form : str
        A name of ``sssfit.methods.EXPORTS``.
    ending : str
        Ending of the file's name; textures are written as it says, by default as ".exr".
    **settings
        Those of the form there.

    Raises
    ------
    KernelError
        The form is unknown or not for these records, there are none, several cannot be one, or a
        setting is invalid or not of this form.
    """
    if form not in EXPORTS:
        raise KernelError(
            f"no format {shown(form)} of a kernel; expected one of {', '.join(EXPORTS)}."
        )
    _check_sources(sources, form)
    settings = _own_settings(form, settings)
    entry = EXPORTS[form]
    write, what = entry.load(), entry.what
    of = "profile" if isinstance(sources[0], Profile) else "kernel"
    if form == "lut":
        ending = ending or ENDINGS[0]
        content, figures = write(sources, ending=ending, **settings)
        return Exported(content, of, what, f".{figures['table']}", ending, figures)
    made = write(sources, **({"form": form} if form in DIALECTS else {}), **settings)
    tag, dot, last = (entry.ending or f".{form}").rpartition(".")
    content = made.encode() if isinstance(made, str) else made
    return Exported(content, of, what, tag, dot + last, _figures(sources[0], entry.told))


def _check_sources(sources: Sequence[object], form: str) -> None:
    """Refuse records that a form is not made of, and none."""
    of_profiles = EXPORTS[form].of_profiles
    kinds = (Profile, SeparableKernel, Taps) if of_profiles else (SeparableKernel, Taps)
    wanted = "a profile or a kernel" if of_profiles else "a kernel"
    if not sources:
        raise KernelError(f"nothing to write as {form}; give {wanted}.")
    for each in sources:
        if isinstance(each, Profile) and not of_profiles:
            raise KernelError(
                f"{form} is written of kernels, and that of {of_material(each.material_name)} is a "
                "profile; fit a kernel to it."
            )
        if not isinstance(each, kinds):
            raise KernelError(f"{shown(each)} cannot be written as {form}; expected {wanted}.")


def _own_settings(form: str, given: dict[str, Any]) -> dict[str, Any]:
    """Return settings by the keywords of a form's function; refuse those of others that are on."""
    own = {each.name: each.keyword or each.name for each in EXPORTS[form].settings}
    own |= {each: each for each in own.values()}
    others = settings_of(EXPORTS).keys() - own.keys()
    for name, value in given.items():
        is_off = value is None or value is False
        if name not in own and not (name in others and is_off):
            known = ", ".join(dict.fromkeys(own.values())) or "none"
            raise KernelError(f"{name} is no setting of {form}; expected {known}.")
    return {own[name]: value for name, value in given.items() if name in own}


def read_exportable(source: str | Path | BinaryIO, origin: str | None = None) -> Profile | Kernel:
    """Read a profile, a kernel or a table of taps from a path or a binary stream.

    Raises
    ------
    SssfitError
        It is none of them; the one-line message names the origin.
    """
    found = kinds.load(source, origin)
    if not isinstance(found, Profile | SeparableKernel | Taps):
        name = printable(origin or str(source))
        raise FileError(f"{name} is neither a profile nor a kernel; simulate and fit make them.")
    return found


def kernel_text(
    kernels: Kernel | Sequence[Kernel], form: str, **settings: Any
) -> tuple[str, dict[str, Any]]:
    """Return kernels as text of a form other than "lut", and their figures; see `exported`."""
    every = [kernels] if isinstance(kernels, SeparableKernel | Taps) else list(kernels)
    found = exported(every, form, **settings)
    return found.content.decode(), found.figures


def _figures(source: Profile | Kernel, told: tuple[str, ...]) -> dict[str, Any]:
    """Return what ``--json`` tells of a record: attributes, by default those of its class."""
    if told:
        return {key: getattr(source, key) for key in told}
    if isinstance(source, Profile):
        return {"channels": source.channels, "annuli": source.n_annuli}
    keys = _TAPS_FIGURES if isinstance(source, Taps) else _FIGURES
    return {key: getattr(source, key) for key in keys}


def document_text(kernels: Sequence[Kernel]) -> str:
    """Return a kernel's JSON document, with a comment in words.

    Raises
    ------
    KernelError
        There are several.
    """
    if len(kernels) > 1:
        raise KernelError("a document holds one kernel; write the others one by one.")
    (kernel,) = kernels
    return taps_document(kernel) if isinstance(kernel, Taps) else json_document(kernel)


def source_text(
    kernels: Sequence[Kernel],
    form: str,
    *,
    prefix: str = "SSS",
    coverage: bool = False,
    depth: bool = False,
    jitter: bool = False,
    tilt: bool = False,
    transmittance: bool = False,
    compute: bool = False,
    keep_energy: bool = False,
    half: bool = False,
    without_shader: bool = False,
    with_shader: bool = False,
    dense: bool = False,
) -> str:
    """Return source of a language: constants, and of tables of taps the passes that use them.

    Parameters
    ----------
    kernels : sequence of SeparableKernel or Taps
    form : str
        A name of ``DIALECTS``.
    prefix : str
        Prefix of all names.
    coverage : bool
        Whether light stays within a mask unless the shader says otherwise.
    depth : bool
        Whether fetches lose weight by their depth difference, too.
    jitter : bool
        Whether each pixel moves the outer taps of its passes, differently in each frame.
    tilt : bool
        Whether passes take the mm of a pixel along either side apart, for tilted surfaces.
    transmittance : bool
        Whether there is a function for the light that comes through a thickness.
    compute : bool
        Whether compute shaders, one a level of a cascade, replace the passes.
    keep_energy : bool
        Whether the blend keeps the energy; otherwise it is a constant of its own.
    half : bool
        Whether numbers are rounded to half floats; what that costs is noted.
    without_shader : bool
        Whether the constants stand alone.
    with_shader : bool
        Whether a dense kernel gets passes too, up to 65 weights each.
    dense : bool
        Whether it gets them with up to 513 weights each.

    Raises
    ------
    KernelError
        The kernels cannot share a source, a setting is invalid or has no passes to act on, or a
        pass has too many weights.
    """
    tables = [each for each in kernels if isinstance(each, Taps)]
    asked = {
        "COVERAGE": coverage,
        "DEPTH": depth,
        "JITTER": jitter,
        "TRANSMITTANCE": transmittance,
    }
    switches = {**asked, "TILT": tilt, "COMPUTE": compute}
    if any(switches.values()) and (without_shader or not (tables or with_shader or dense)):
        given = ", ".join(name.lower() for name, each in switches.items() if each)
        remedy = "leave out `without_shader`" if without_shader else "give `with_shader`"
        raise KernelError(f"{given}: only passes have this, and they are not written; {remedy}.")
    if without_shader and (with_shader or dense):
        raise KernelError("source is written with its passes or without them; ask for one.")
    if tables and (with_shader or dense):
        raise KernelError(
            "`with_shader` and `dense` are for dense kernels, and a table of taps has its passes "
            "already; leave them out."
        )
    if not tables and len(kernels) == 1 and isinstance(kernels[0], SeparableKernel):
        if not (with_shader or dense):
            return _dense_text(kernels[0], form, prefix, half=half)
        tables = [taps_of_kernel(kernels[0], None if dense else MOST_WEIGHTS)]
    if len(tables) < len(kernels):
        raise KernelError("only tables of taps share one source; write dense kernels one by one.")
    style = Style(
        prefix,
        with_passes=not without_shader,
        normalized=not keep_energy,
        half=half,
        features=tuple(name for name, given in asked.items() if given),
        tilted=tilt,
        compute=compute,
    )
    text = source(tables, DIALECTS[form], style)
    for each in tables if half else ():
        _note_half(each, each.energy, taps_in_half(each, DIALECTS[form], style))
    return text


def _dense_text(kernel: SeparableKernel, form: str, prefix: str, *, half: bool) -> str:
    """Return the arrays of a dense kernel, and say what its passes would cost."""
    text = dense(kernel, DIALECTS[form], prefix, half=half)
    weights = 2 * kernel.rank * kernel.pixels
    if weights > MOST_WEIGHTS:
        note(
            f"This dense kernel has {weights} weights a pixel, and a shader would fetch for each; "
            "a cascade comes nearer for 24 fetches."
        )
    if half:
        _note_half(kernel, kernel.energy * kernel.scale, dense_in_half(kernel))
    return text


def _note_half(kernel: Kernel, energy: FloatArray, rounded: FloatArray) -> None:
    """Say by how much half floats change the energy (C,)."""
    change = np.where(energy != 0.0, rounded / np.where(energy != 0.0, energy, 1.0) - 1.0, 0.0)
    words = by_channel(kernel.channels, change.tolist(), "+.2g%|unknown")
    note(f"Half floats change the energy of {of_material(kernel.meta.get('material'))}: {words}.")


def is_ours(path: Path, form: str) -> bool:
    """Return whether a file is one that `exported` wrote in this form, a name of ``EXPORTS``."""
    return EXPORTS[form].is_ours(path)
