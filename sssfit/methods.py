"""The methods of ``sssfit simulate`` and ``sssfit fit``, with summary, function and settings.

A new method is one file with its function and one entry here: help, ``--method`` and docs/cli.md
are made from the entries. Each setting takes a row in tests/option_rows.py, and a test asks for it.
Nothing of the library is imported before a function is asked for, so that help answers at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any


def imported(where: str) -> Callable[..., Any]:
    """Import a function or a method of a class: "module:name" or "module:class.name"."""
    module, colon, names = where.partition(":")
    if not colon:
        raise ValueError(f'{where!r} names no function; expected "module:name".')
    found: Callable[..., Any] = attrgetter(names)(import_module(module))
    return found


def named(package: str, name: str, homes: Mapping[str, str]) -> Any:
    """Import a package's public name from its home, a module given without ``sssfit.``.

    For a package's ``__getattr__`` (PEP 562).

    Raises
    ------
    AttributeError
        It is no public name.
    """
    if name not in homes:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    return getattr(import_module(f"sssfit.{homes[name]}"), name)


@dataclass(frozen=True, slots=True)
class Setting:
    """A keyword of a method's function, and its option.

    Parameters
    ----------
    name : str
        Name of the option, with underscores.
    kind : str
        "number", "numbers" (one, or one per channel), "length", "share" (between 0 and 1, or in
        per cent), "part" (the same, with 0 and 1), "parts" (one, or one per channel), "seconds",
        "whole", "count" (a whole number, 1e7 is understood), "text", "choice" or "flag".
    help : str
        Help text; the names of its methods are put before it.
    metavar : str
        Placeholder of the value in the help.
    among : tuple
        The choices, or the smallest and the largest whole number.
    default : str or float, optional
        Value if the option is not given; shown in the help.
    words : str
        Description of a default that the function has itself.
    keyword : str
        Keyword of the function if it differs from the option's name, as with a unit.
    """

    name: str
    kind: str
    help: str
    metavar: str = ""
    among: tuple[Any, ...] = ()
    default: str | float | None = None
    words: str = ""
    keyword: str = ""


@dataclass(frozen=True, slots=True)
class Method:
    """A method from a material to a profile, from a profile to a kernel, or to a made picture.

    Parameters
    ----------
    function : str
        "module:name"; `load` imports it.
    summary : str
        Help text on one line.
    settings : tuple of Setting
    counted : tuple of str
        Settings of which the first that is given becomes part of the kernel's file name (svd3); if
        none is, the ``words`` of the last.
    shares : bool
        Whether the function takes a list of materials, shares their common work, and takes
        ``threads`` and ``stop``; the others take one material.
    makes_taps : bool
        Whether a fit makes a table of taps; the others make separable kernels, which `taps` thins.
    is_seeded : bool
        Whether a fit starts at random places, and takes a ``seed``.
    makes : str, optional
        Name of the only profile it makes, without a material; that name needs no ``--method``.
    solves : str
        Of a simulation "transport", or "half spaces" or "layers" for a diffusion model of such,
        which is then compared with the exact solution wherever models are.
    label : str
        Name of a simulation in charts and reports.
    """

    function: str
    summary: str
    settings: tuple[Setting, ...] = ()
    counted: tuple[str, ...] = ()
    shares: bool = False
    makes_taps: bool = False
    is_seeded: bool = False
    makes: str | None = None
    solves: str = ""
    label: str = ""

    def load(self) -> Callable[..., Any]:
        """Import the method's function."""
        return imported(self.function)

    def count_of(self, given: Mapping[str, Any]) -> str:
        """Return what becomes part of the kernel's file name."""
        known = {each.name: each.words for each in self.settings}
        words = [known[name] for name in self.counted[-1:]]
        value = [given[name] for name in self.counted if name in given] + [*words, ""]
        text = f"{value[0]:g}" if isinstance(value[0], float) else str(value[0])
        if "taps" in given and "taps" not in self.counted:
            text += f".taps{given['taps']}"
        return text.replace("|", "_").replace("*", "x")  # as file names of Windows may have it

    def shared(self, *, seed: int, normalize: bool) -> dict[str, Any]:
        """Return those of the options of all fits that this one takes."""
        found = {} if self.makes_taps else {"normalize": normalize}
        return found | ({"seed": seed} if self.is_seeded else {})


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Method):
    """What kernels or a profile are written as; its function takes them and returns text or bytes.

    Parameters
    ----------
    what : str
        What is written, with its article if it has one: "a table".
    knows : str
        "module:name" of a function from a path to whether the file is one that we wrote in this
        form. Only such a file is replaced without being asked to.
    of_profiles : bool
        Whether it takes profiles as well as kernels; by default it is then given the newest.
    ending : str
        Ending of the file's name; by default a dot and the name of the form.
    told : tuple of str
        Attributes of the record that ``--json`` tells; by default those of its class.
    """

    what: str
    knows: str
    of_profiles: bool = False
    ending: str = ""
    told: tuple[str, ...] = ()

    def is_ours(self, path: Path) -> bool:
        """Return whether a file is one that we wrote in this form."""
        return bool(imported(self.knows)(path))


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """A chart that ``sssfit chart`` draws: of a file as it is, or computed from it with a flag.

    Parameters
    ----------
    of : tuple of str
        Classes of the records in the files that it is for.
    record : str
        Class of the record that is drawn.
    figure : str
        "module:name" of the function that draws the record.
    flag : str
        Help of its option; without one it is what is drawn of such a file without a flag.
    function : str
        "module:name" of the function that computes the record; without one the file's is drawn.
    takes : tuple of str
        Keywords of the function: options of the verb, "profile" (to which a kernel was fitted),
        "seed", "threads" and "walk" (what shows the progress of a walk).
    page : str
        "module:name" of the function from the record's ``to_dict`` to what is printed; without one
        only the file is named.
    memory : str
        What it takes, a key of `sssfit.process.check_memory`.

    Raises
    ------
    ValueError
        A view with a flag has no function, or one with a function has no page.
    """

    of: tuple[str, ...]
    record: str
    figure: str
    flag: str = ""
    function: str = ""
    takes: tuple[str, ...] = ()
    page: str = ""
    memory: str = "figures"

    def __post_init__(self) -> None:
        """Refuse an entry that lacks what would be missed after the chart is drawn."""
        if self.flag and not self.function:
            raise ValueError(f"the view of {self.record} has a flag; give its function, too.")
        if self.function and not self.page:
            raise ValueError(f"the view of {self.record} is computed; give its page, too.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure(Method):
    """A figure of a picture beside the true one; its ``summary`` is its name in reports.

    Its function takes (image, truth, exposure, mask=...), as `sssfit.measure.structure.ssim`.

    Parameters
    ----------
    of_colours : bool
        Whether it is of grey and of three channels alone; of others it is then NaN.
    """

    of_colours: bool = False


_ANGLES = Setting(
    "angles",
    "whole",
    "bins of the exit angle, 0 to 90 degrees; the profile then has R_d(angle), and of a walk "
    "R_d(r, angle), too.",
    "N",
    (1, 180),
)
DEON_SKIN = "deon-skin"  # a profile that is made without a material

SIMULATIONS: Mapping[str, Method] = {
    "montecarlo": Method(
        "sssfit.simulate:simulate_montecarlo_many",
        "photon walk, also through layers and slabs; with standard errors",
        (
            Setting(
                "photons",
                "count",
                "photons to trace; each photon counts for all channels.",
                "N",
                (2, 10**12),
                words="1e7; with --target-error no limit",
            ),
            Setting(
                "target_error",
                "share",
                "stop when every channel's F(r) has a standard error below this share of F at the "
                "last edge, such as 0.5%.",
                "SHARE",
            ),
            _ANGLES,
            Setting(
                "numerical_aperture",
                "number",
                "aperture of a detector that sees only light within asin(NA / n_above) of the "
                "normal.",
                "NA",
            ),
            Setting(
                "checkpoint_every",
                "seconds",
                "time between saves of FILE.checkpoint, from which --resume continues.",
                "SECONDS",
                default=30.0,
            ),
            Setting("resume", "flag", "continue a killed or interrupted run from its checkpoint."),
        ),
        shares=True,
        solves="transport",
        label="Monte Carlo",
    ),
    "exact": Method(
        "sssfit.simulate:simulate_exact_many",
        "solution of the transport equation, without noise; also for layers and slabs",
        (
            Setting(
                "tolerance",
                "share",
                "largest error of F(r), as a share of the light that leaves.",
                "SHARE",
                default="0.01%",
            ),
            Setting(
                "similarity",
                "flag",
                "take forward scattering for isotropic with sigma_s' = (1 - g) sigma_s, which is "
                "faster and an approximation.",
            ),
            _ANGLES,
        ),
        shares=True,
        solves="transport",
        label="Exact solution",
    ),
    "dipole": Method(
        "sssfit.simulate:simulate_dipole",
        "diffusion, Jensen et al. 2001; half spaces only",
        solves="half spaces",
        label="Dipole",
    ),
    "dipole-grosjean": Method(
        "sssfit.simulate:simulate_dipole_grosjean",
        "the same with Grosjean's diffusion coefficient",
        solves="half spaces",
        label="Dipole, Grosjean's D",
    ),
    "multipole": Method(
        "sssfit.simulate:simulate_multipole",
        "diffusion, Donner and Jensen 2005; also for slabs and layers",
        solves="layers",
        label="Multipole",
    ),
    "burley": Method(
        "sssfit.simulate:simulate_burley",
        "normalised diffusion, Christensen and Burley 2015; half spaces only",
        (
            Setting(
                "mapping",
                "choice",
                "published fit of s: perpendicular (beam along the normal), diffuse (light from "
                "all directions), or diffuse-mfp (scaled by the diffuse mean free path).",
                "FIT",
                ("perpendicular", "diffuse", "diffuse-mfp"),
                default="perpendicular",
            ),
        ),
        solves="half spaces",
        label="Normalised diffusion",
    ),
    "gaussians": Method(
        "sssfit.simulate:simulate_deon_skin",
        "skin as the six Gaussians of d'Eon et al. 2007; deon-skin only",
        makes=DEON_SKIN,
        label="Sum of Gaussians",
    ),
}


def _that_solve(what: str) -> tuple[str, ...]:
    return tuple(name for name, each in SIMULATIONS.items() if each.solves == what)


# What follows all scattering, and the diffusion models that are compared with it.
TRANSPORT = _that_solve("transport")
OF_HALF_SPACES, OF_LAYERS = _that_solve("half spaces"), _that_solve("layers")

_ENERGY = Setting(
    "energy",
    "choice",
    "scale the kernel to the diffuse reflectance, or keep the energy within the support (svd: the "
    "least error).",
    among=("rescale", "keep"),
    words="rescale",
)

_SPECTRUM = Setting(
    "spectrum",
    "choice",
    "pictures that the kernel is for: natural ones, or white noise.",
    among=("natural", "white"),
    words="natural",
)
_IRRADIANCE = Setting(
    "irradiance",
    "text",
    "the picture that the kernel is for, in place of a spectrum: a made one, as of sssfit render, "
    "or your own file.",
    "NAME|FILE",
)

_STAGES = Setting(
    "stages",
    "text",
    "tap pairs a pass of each stage, or * for nine fetches in one pass, such as 1-1|2-2|2-2; | "
    "halves the picture.",
    "STAGES",
)

# Of separable kernels: the fetches that a shader can afford.
_TAPS = (
    Setting(
        "taps",
        "whole",
        "bilinear fetches a pass to which a kernel is thinned, an odd number up to 129; for disk, "
        "all of its fetches, at least 4.",
        "N",
        (3, 256),
    ),
    Setting(
        "place",
        "choice",
        "where the taps lie: by the cube root of the weights, at distances that grow as i^2, or "
        "fitted with their weights as pictures see them.",
        among=("cumulative", "quadratic", "fitted"),
        words="cumulative",
    ),
)

FITS: Mapping[str, Method] = {
    "cascade": Method(
        "sssfit.fit.cascade:fit_cascade",
        "few fetches: a chain of small blurs, whose stages are all added up",
        (
            Setting("fetches", "number", "most texture fetches a pixel.", "N", words="24"),
            _STAGES,
            Setting("passes", "whole", "most passes of the stages.", "N", (1, 1000)),
            Setting("full_resolution", "flag", "do not halve the picture."),
            Setting(
                "still",
                "flag",
                "give three times the weight to what changes as light moves by a pixel.",
            ),
            _SPECTRUM,
            _IRRADIANCE,
        ),
        counted=("stages", "fetches"),
        makes_taps=True,
        is_seeded=True,
    ),
    "disk": Method(
        "sssfit.fit.disk:fit_disk",
        "single fetches on a spiral, turned at each pixel and frame, as engines sample",
        (replace(_TAPS[0], words="24"),),
        counted=("taps",),
        makes_taps=True,
    ),
    "svd": Method(
        "sssfit.fit.svd:fit_svd",
        "rank N: the largest terms of the singular value decomposition; the smallest error",
        (Setting("rank", "whole", "number of terms.", "N", (1, 1000), words="3"), _ENERGY, *_TAPS),
        counted=("rank",),
    ),
    "gaussians": Method(
        "sssfit.fit.gaussians:fit_gaussians",
        "1 to 10 terms: a sum of Gaussians, r-weighted least squares of the profile",
        (
            Setting("terms", "whole", "number of Gaussians.", "N", (1, 10), words="4"),
            Setting("signed", "flag", "allow negative weights."),
            Setting("free_energy", "flag", "do not constrain the sum of the weights."),
            _ENERGY,
            *_TAPS,
        ),
        counted=("terms",),
    ),
    "preintegrated": Method(
        "sssfit.fit.preintegrated:fit_preintegrated",
        "one term: the profile integrated along lines; exact for edges along the axes",
        (_ENERGY, *_TAPS),
    ),
    "guided": Method(
        "sssfit.fit.guided:fit_guided",
        "one term, weighted by a guide function: near (k = 0) to far (k = 4) scattering",
        (
            Setting("k", "number", "0 for near, 4 for far scattering.", "0..4", words="1.55"),
            Setting(
                "b",
                "number",
                "how close to the axes the guide function vanishes: within about 1/sqrt(b) of the "
                "extent.",
                "NUMBER",
                words="50",
            ),
            Setting(
                "centre_bound",
                "part",
                "largest share of the pass in its middle pixel, such as 5%.",
                "SHARE",
                words="none",
            ),
            *_TAPS,
        ),
    ),
    "artist": Method(
        "sssfit.fit.artist:fit_artist",
        "one term of two Gaussians per channel, fitted or set by hand",
        (
            Setting(
                "target",
                "choice",
                "fit the line integral, the 2D kernel, or pictures of a disk, an edge and a head "
                "(about 5 s).",
                among=("line", "kernel", "picture"),
                words="line",
            ),
            Setting(
                "near",
                "numbers",
                "variance of the narrow Gaussian, one or one per channel.",
                "MM2,...",
                keyword="near_mm2",
            ),
            Setting(
                "far",
                "numbers",
                "variance of the wide Gaussian, one or one per channel.",
                "MM2,...",
                keyword="far_mm2",
            ),
            Setting(
                "weight",
                "parts",
                "share of the narrow Gaussian, such as 0.2 or 20%, one or one per channel.",
                "SHARE,...",
            ),
            *_TAPS,
        ),
    ),
    "falloff": Method(
        "sssfit.fit.falloff:fit_falloff",
        "one term, the 2012 model: stretched red skin with width, strength and falloff",
        (
            Setting("width", "number", "width, the same for all channels.", "W"),
            Setting(
                "strength",
                "parts",
                "share of the light that scatters, such as 0.78 or 78%, one or one per channel.",
                "SHARE,...",
            ),
            Setting(
                "falloff",
                "numbers",
                "relative width of a channel, one or one per channel.",
                "F,...",
            ),
            *_TAPS,
        ),
    ),
    "weighted": Method(
        "sssfit.fit.weighted:fit_weighted",
        "1 to 8 terms, fitted as pictures see them; two do what five of svd do",
        (
            Setting("rank", "whole", "number of terms.", "N", (1, 1000), words="2"),
            _SPECTRUM,
            _IRRADIANCE,
            *_TAPS,
        ),
        counted=("rank",),
    ),
    "burley": Method(
        "sssfit.fit.burley:fit_burley",
        "one term: normalised diffusion with one shape per channel, as engines use it",
        (_ENERGY, *_TAPS),
    ),
    "gaussian-chain": Method(
        "sssfit.fit.gaussian_chain:fit_gaussian_chain",
        "six Gaussians, each a blur of the one before, after d'Eon and Luebke 2007",
        (
            replace(_STAGES, words="3-3-3-3-3-3"),
            Setting(
                "blur",
                "choice",
                "what is fitted as pictures see it: the widths of the stages and their one shape, "
                "the widths, or nothing, where they are Gaussians of the profile as published.",
                among=("shape", "widths", "published"),
                words="shape",
            ),
        ),
        counted=("stages",),
        makes_taps=True,
        is_seeded=True,
    ),
    "rotated": Method(
        "sssfit.fit.rotated:fit_rotated",
        "a chain of passes in three or four directions; beside the single pair",
        (
            Setting(
                "directions",
                "whole",
                "passes: 4 at 0, 45, 90, 135 degrees, 3 at 0, 60, 120, or 2.",
                "N",
                (2, 4),
                words="4",
            ),
            replace(_TAPS[0], words="9"),
        ),
        counted=("directions",),
        makes_taps=True,
        is_seeded=True,
    ),
    "pyramid": Method(
        "sssfit.fit.pyramid:fit_pyramid",
        "a convolution pyramid, one small filter on all levels, after Farbman et al. 2011",
        (replace(_STAGES, words="1|1|1|1|1"), _SPECTRUM),
        counted=("stages",),
        makes_taps=True,
        is_seeded=True,
    ),
}

# Fits of separable kernels, and those whose result is a table of taps, as a shader runs it.
SEPARABLE: Mapping[str, Method] = {k: each for k, each in FITS.items() if not each.makes_taps}
TAPS: Mapping[str, Method] = {k: each for k, each in FITS.items() if each.makes_taps}

_SOURCE = (
    Setting("prefix", "text", "what all names begin with.", "NAME", words="SSS"),
    Setting("coverage", "flag", "keep light within a mask, the fourth channel of the pictures."),
    Setting("depth", "flag", "follow depth: a fetch loses weight by its depth difference."),
    Setting("jitter", "flag", "move the outer taps of a pass by pixel and frame, against bands."),
    Setting(
        "tilt", "flag", "take mm per pixel separately for right and down, for tilted surfaces."
    ),
    Setting("transmittance", "flag", "add a function for the light through a thickness."),
    Setting("compute", "flag", "write compute shaders, one a level, that work in group memory."),
    Setting("keep_energy", "flag", "leave the energy in the blend, not in a constant of its own."),
    Setting("half", "flag", "round to half floats, and say what that costs."),
    Setting("without_shader", "flag", "write the constants alone, without the passes."),
    Setting(
        "with_shader", "flag", "write the passes of a dense kernel too, up to 65 weights each."
    ),
    Setting("dense", "flag", "write the passes of a dense kernel with up to 513 weights each."),
)
_OF_C = tuple(each for each in _SOURCE if each.name in ("prefix", "keep_energy", "half"))


def _source(dialect: str, summary: str, settings: tuple[Setting, ...] = _SOURCE) -> Format:
    """Return the entry of a language."""
    knows = f"sssfit.export.dialects:{dialect}.is_ours"
    return Format("sssfit.export:source_text", summary, settings, what="source", knows=knows)


EXPORTS: Mapping[str, Format] = {
    "hlsl": _source("HLSL", "shader source of Direct3D"),
    "glsl": _source("GLSL", "shader source of OpenGL and Vulkan"),
    "wgsl": _source("WGSL", "shader source of WebGPU"),
    "c": _source("C", "constants for C and C++", _OF_C),
    "json": Format(
        "sssfit.export:document_text",
        "a kernel as a document",
        what="a kernel",
        knows="sssfit.export.document:is_our_document",
    ),
    "csv": Format(
        "sssfit.export.table:table_text",
        "a profile or a kernel as a table",
        what="a table",
        knows="sssfit.export.table:is_our_table",
        of_profiles=True,
    ),
    "angles": Format(
        "sssfit.export.angles:angles_text",
        "a profile's R_d by exit angle beside Lambert's law, as a table: NAME.angles.csv",
        what="a table",
        knows="sssfit.export.angles:is_our_angles",
        of_profiles=True,
        ending=".angles.csv",
        told=("channels",),
    ),
    "frequency": Format(
        "sssfit.export.frequency:frequency_text",
        "a profile's response to sinusoids of light, R(k), as a table: NAME.frequency.csv",
        what="a table",
        knows="sssfit.export.frequency:is_our_frequencies",
        of_profiles=True,
        ending=".frequency.csv",
        told=("channels",),
    ),
    "lut": Format(
        "sssfit.export.lut:lut_bytes",
        "a profile or a kernel as a texture: NAME.exr, .dds, or .png to look at",
        (
            Setting(
                "table",
                "choice",
                "R_d over the radius, energy in strips one pixel wide, or in pixels.",
                among=("radial", "line", "kernel"),
                words="radial",
            ),
            Setting("texels", "whole", "texels of the radial table.", "N", (2, 16384), words="256"),
            Setting(
                "radius",
                "length",
                "how far a profile's table reaches.",
                "MM",
                words="99.9 % of the light",
                keyword="radius_mm",
            ),
            Setting(
                "mm_per_pixel",
                "length",
                "pixel size of a profile's line or kernel.",
                "MM",
                words="0.3",
            ),
        ),
        what="a texture",
        knows="sssfit.export.lut:is_our_texture",
        of_profiles=True,
    ),
}

_PROFILES = ("Profile",)
_PRINTED = "sssfit.export.reports"

# What ``sssfit chart`` draws; the name is that of the flag and in the name of the file.
VIEWS: Mapping[str, View] = {
    "profile": View(
        of=_PROFILES,
        record="Profile",
        figure="sssfit.chart.profile:profile_figure",
        memory="chart",
    ),
    "kernel": View(
        of=("SeparableKernel",),
        record="KernelView",
        figure="sssfit.chart.kernel:kernel_figure",
        function="sssfit.compare.drawing:kernel_of",
        takes=("profile", "channel"),
        page=f"{_PRINTED}:kernel_page",
        memory="kernel chart",
    ),
    "taps": View(
        of=("Taps",),
        record="TapsView",
        figure="sssfit.chart.taps:taps_figure",
        function="sssfit.compare.taps_view:view_taps",
        takes=("profile",),
        page=f"{_PRINTED}:taps_page",
        memory="kernel chart",
    ),
    "material": View(
        of=("Material",),
        record="Material",
        figure="sssfit.chart.material:material_figure",
        memory="chart",
    ),
    "checkpoint": View(
        of=("SoFar",),
        record="Profile",
        figure="sssfit.chart.profile:profile_figure",
        memory="chart",
    ),
    "models": View(
        of=("Profile", "Material"),
        record="ModelComparison",
        figure="sssfit.chart.models:models_figure",
        flag="Draw a material by every method, and the methods' errors.",
        function="sssfit.compare.drawing:models_of",
        takes=("photons", "seed", "threads", "walk"),
        page=f"{_PRINTED}:models_page",
    ),
    "spectrum": View(
        of=_PROFILES,
        record="Spectrum",
        figure="sssfit.chart.spectrum:spectrum_figure",
        flag="Draw the energy of the kernel's singular values.",
        function="sssfit.compare.spectrum:compute_spectrum",
        takes=("mm_per_pixel",),
        page=f"{_PRINTED}:spectrum_page",
    ),
    "guide": View(
        of=_PROFILES,
        record="Guide",
        figure="sssfit.chart.guide:guide_figure",
        flag="Draw the guide function beside the residual of the guided fit.",
        function="sssfit.compare.guide:compute_guide",
        takes=("mm_per_pixel", "ks", "channel"),
        page=f"{_PRINTED}:guide_page",
    ),
    "frequency": View(
        of=_PROFILES,
        record="FrequencyResponse",
        figure="sssfit.chart.frequency:frequency_figure",
        flag="Draw the response to sinusoids of light, R(k).",
        function="sssfit.profile.frequency:frequency_response",
        page=f"{_PRINTED}:frequency_page",
    ),
    "angles": View(
        of=_PROFILES,
        record="AngularReflectance",
        figure="sssfit.chart.angles:angles_figure",
        flag="Draw R_d by exit angle, beside a Lambertian medium's.",
        function="sssfit.profile.directions:angular_reflectance",
        page=f"{_PRINTED}:angles_page",
    ),
    "swatches": View(
        of=("Swatches",),
        record="Swatches",
        figure="sssfit.chart.swatches:swatches_figure",
        page=f"{_PRINTED}:swatches_page",
        memory="chart",
    ),
}

STRESSES: Mapping[str, Method] = {
    "noise": Method("sssfit.stability.noise:stress", "walks of 1e3 to 1e7 photons"),
    "pixel-size": Method(
        "sssfit.stability.pixel_size:stress", "pixels of .001 to 10 mean free paths"
    ),
    "optics": Method(
        "sssfit.stability.optics:stress", "albedos of .01 to .99999, indices of 1 to 2"
    ),
    "gaussians": Method("sssfit.stability.gaussians:stress", "1 to 10 Gaussians, random starts"),
    "guided": Method("sssfit.stability.guided:stress", "k, b and pixels of the guided fit"),
    "hard-light": Method(
        "sssfit.stability.hard_light:stress", "decompositions beside a highlight of 1000"
    ),
    "taps": Method("sssfit.stability.taps:stress", "few fetches, jitter, short numbers, a firefly"),
    "distance": Method(
        "sssfit.stability.distance:stress", "near by and far away, slopes, pixels that grow"
    ),
    "motion": Method("sssfit.stability.motion:stress", "a point that moves, a camera that nears"),
    "grid": Method("sssfit.stability.grid:stress", "wide annuli, a short radius"),
    "imports": Method(
        "sssfit.stability.imports:stress", "gaps, coarse annuli, saturation, a camera's noise"
    ),
}


LIGHTS: Mapping[str, Method] = {
    "still": Method("sssfit.motion.lights:still", "does not change"),
    "sinusoidal": Method("sssfit.motion.lights:sinusoidal", "swells and fades, from 0.1 to 1.9"),
    "strobe": Method("sssfit.motion.lights:strobe", "four frames lit, four nearly dark"),
    "gunshot": Method("sssfit.motion.lights:gunshot", "bursts of three flashes that fade quickly"),
}

# What renders frames under a light that changes, in the order of its running.
RENDERERS: Mapping[str, Method] = {
    "without": Method("sssfit.motion.ways:without", "adaptive, no control variates"),
    "variates": Method("sssfit.motion.ways:variates", "adaptive, control variates"),
    "ahead": Method("sssfit.motion.ways:ahead", "adaptive, next frame's light"),
    "fixed": Method("sssfit.motion.ways:fixed", "fixed sampling"),
    "separable": Method("sssfit.motion.ways:separable", "separable kernel"),
    "cascade": Method("sssfit.motion.ways:cascade", "cascade of taps"),
}

# What ``sssfit render --structure`` measures beside Delta E 2000.
MEASURES: Mapping[str, Measure] = {
    "ssim": Measure("sssfit.measure.structure:ssim", "SSIM"),
    "flip": Measure("sssfit.measure.structure:flip", "FLIP", of_colours=True),
}

# What diffusion in texture space may leave out.
SAVINGS = ("culled", "depth", "clipped")

# Engines that take a few parameters in place of a table: files of `sssfit.export.presets`.
_IN = "sssfit.export.presets"
PRESETS: Mapping[str, Method] = {
    "iryoku": Method(f"{_IN}.iryoku:IRYOKU", "separable-sss: 11, 17 or 25 taps and a width"),
    "unreal": Method(f"{_IN}.unreal:UNREAL", "Unreal Engine: subsurface profile"),
    "hdrp": Method(f"{_IN}.hdrp:HDRP", "Unity HDRP: diffusion profile"),
    "blender": Method(f"{_IN}.blender:BLENDER", "Blender: Principled BSDF, Cycles and EEVEE"),
    "godot": Method(f"{_IN}.godot:GODOT", "Godot: constants of its shader"),
    "babylon": Method(f"{_IN}.babylon:BABYLON", "Babylon.js: diffusion profile"),
    "openpbr": Method(f"{_IN}.openpbr:OPENPBR", "OpenPBR Surface: a MaterialX document"),
    "materialx": Method(f"{_IN}.materialx:MATERIALX", "MaterialX: its standard surface"),
    "pbrt": Method(f"{_IN}.pbrt:PBRT", "pbrt-v4: homogeneous medium"),
    "mitsuba": Method(f"{_IN}.mitsuba:MITSUBA", "Mitsuba: homogeneous medium"),
    "gltf": Method(f"{_IN}.gltf:GLTF", "glTF: KHR_materials_volume_scatter"),
    "stride": Method(f"{_IN}.stride:STRIDE", "Stride: subsurface scattering feature"),
    "o3de": Method(f"{_IN}.o3de:O3DE", "Open 3D Engine: EnhancedPBR material"),
    "community-shaders": Method(
        f"{_IN}.community_shaders:COMMUNITY_SHADERS", "Community Shaders: both methods"
    ),
}


def settings_of(methods: Mapping[str, Method]) -> dict[str, tuple[Setting, tuple[str, ...]]]:
    """Return every setting once by its name, with the names of the methods that have it.

    Where methods describe a default differently, all say theirs: "3 for svd, 2 for weighted".
    """
    owned: dict[str, dict[str, Setting]] = {}
    for name, method in methods.items():
        for each in method.settings:
            owned.setdefault(each.name, {})[name] = each
    found = {}
    for key, owners in owned.items():
        first, words = next(iter(owners.values())), {each.words for each in owners.values()}
        if len(words) > 1:
            given = {name: each.words for name, each in owners.items() if each.words}
            said = ", ".join(f"{words} for {name}" for name, words in given.items())
            first = replace(first, words=said)
        found[key] = first, tuple(owners)
    return found


def lines_of(methods: Mapping[str, Method]) -> str:
    """Return a line of name and summary for each; the longest name sets the column."""
    width = max(map(len, methods)) + 2
    return "\n".join(f"  {name.ljust(width)}{each.summary}" for name, each in methods.items())
