"""The options of verbs, a row an option: name, type, what stands for the value, help, default.

Those of methods and of made pictures are made from their entries, in ``_options``.
"""

from sssfit import methods
from sssfit.formats._picture_files import ENDINGS, READ
from sssfit.messages import one_of
from sssfit.methods import EXPORTS, FITS, LIGHTS, PRESETS, RENDERERS, SAVINGS, SEPARABLE, STRESSES
from sssfit.scene.made import COMPARED, EDGE_DEGREES, MADE

from ._options import (
    SHIPPED,
    STRICT,
    Count,
    Length,
    Lengths,
    Names,
    Number,
    NumberRange,
    Numbers,
    Part,
    Shift,
    Size,
    WholeRange,
    flag,
    option,
    output,
)

MAPS = ("signed", "absolute")
_FACTOR = NumberRange(min=0.0, min_open=True)
_ANGLE = NumberRange(0.0, 180.0, min_open=True, max_open=True)
_FILE = f"{', '.join(MADE)}, or your own {READ}"


def _views_with(setting: str) -> str:
    """Return the flags of the charts that take a setting: "--spectrum or --guide"."""
    flagged = {name: each for name, each in methods.VIEWS.items() if each.flag}
    return one_of([f"--{name}" for name, each in flagged.items() if setting in each.takes])


# fmt: off
_FIGURE = option("--chart", None, "FILE", "Figure: PNG, SVG or PDF by its ending; - for PNG on "
                 "stdout.")
_OF_FILES = (
    option("--layer", None, "NAME", "Your own EXR: the layer to read, such as ViewLayer.Combined.  "
           "[default: R, G, B without a layer, or the only layer with them]"),
    option("--mask", ["alpha"], None, "Your own file: the object is the part that its alpha "
           "covers by half or more; only it is lit and judged.  [default: all of it]"),
)

RENDER_PICTURE = (
    option("--irradiance", None, "NAME|FILE", f"Irradiance picture: {_FILE} file.",
           next(iter(MADE))),
    option("--size", Size(), "WxH", "Made pictures: columns and rows.  [default: 512x512; head: "
           "the whole face, up to 1080x1080]"),
    option("--mm-per-pixel", Length(), "MM", "Pixel size of your own file, if its header does not "
           "say, and of the made head with --screen.  [default: 0.3 with --screen, else the "
           "kernel's]"),
    *_OF_FILES,
)
RENDER = (
    option("--border", ["mirror", "clamp", "zero"], None, "Continuation of the picture beyond its "
           "border.", "mirror"),
    flag("--screen", "Render like a shader: in perspective, by depth, within the mask; head only."),
    option("--follow", ["gaussian", "lerp", "none"], None, "With --screen: how a depth difference "
           "weights a sample.  [default: gaussian]"),
    option("--intermediate", ["float32", "half", "half-truncated", "r11g11b10", "rgba8", "srgb8"],
           None, "Table of taps: format of the pictures between its passes.  [default: they are "
           "not rounded]"),
    option("--profile", None, "FILE", "Reference profile.  [default: the profile in this folder "
           "that the kernel was fitted to]"),
    option("--exposure", _FACTOR, "FACTOR", "Exposure for Delta E and PNG files.  [default: from "
           "the true picture]"),
    flag("--structure", f"Also {' and '.join(each.summary for each in methods.MEASURES.values())} "
         '(needs "sssfit[metrics]").'),
    option("-o --output", None, "FILE", f"Output file, {ENDINGS} (16 bits, sRGB); - for "
           "EXR on stdout.  [default: KERNEL.PICTURE.exr]"),
    option("--truth", None, "FILE", "Write the true picture as well."),
    option("--difference", None, "FILE", "Write the absolute difference as well."),
    option("--gain", _FACTOR, "FACTOR", "--difference: magnify it.", 1.0),
    option("--difference-map", MAPS, None, "--difference: in false colours. signed: luminance, "
           "blue where the kernel is darker, red where it is brighter; absolute: the largest of "
           "the channels, violet to yellow. The scale is printed; it ends at the largest "
           "difference over --gain."),
    flag("--force", "Replace an input, or a file that is not our picture."),
)

COMPARE = (
    *SHIPPED,
    option("--what", ["front", "budget", "kernels", "sheet", "presets"], None, "budget: the "
           "causes of a kernel's error; kernels: all kernels by error and cost; front: the kernels "
           "that no other beats, one line per picture; sheet: pictures of all kernels, drawn into "
           "--chart; presets: what engines show.  [default: budget and kernels]"),
    option("--picture pictures", None, "NAME|FILE,...", f"Irradiance pictures: {_FILE} files. The "
           f"edge is at {EDGE_DEGREES:g} degrees.  [default: {','.join(COMPARED)}]", multiple=True),
    option("--mm-per-pixel", Length("profile"), "MM|profile", "Size of all pixels; profile is "
           "the width of the profile's first annulus.  [default: from your own file, else 0.3]"),
    option("--size", Size(), "WxH", "Made pictures: columns and rows.  [default: 512x512]"),
    *_OF_FILES,
    option("--chart", None, "FILE", "Draw the kernels by error and cost, or the sheet, as PNG, SVG "
           "or PDF by the ending; - for PNG on stdout."),
    option("--table", None, "FILE", "Write the kernels' rows, .md, .csv or .json."),
    option("--error", ["delta-e", "p99", "l2"], None, "Error in chart and front: mean or 99th "
           "percentile of Delta E 2000, or relative L2 of linear light.", "delta-e"),
    option("--cost", ["fetches", "passes", "bytes", "seconds"], None, "Cost in chart and front: "
           "texture fetches or bytes moved a pixel, passes, or measured seconds.", "fetches"),
    option("--only", Names(FITS), "METHOD,...", "Only kernels by these fit methods."),
    option("--budget-chart", None, "FILE", "Draw the budget."),
    option("--photons", Count(2, 10**12), "N", "Photons of the budget's walk.  [default: 1e6]"),
    option("--method", ["cascade", *SEPARABLE], None, "Fit method of the budget's kernel.", "svd"),
    option("--rank", WholeRange(1, 1000), "N", "svd: rank of the budget's kernel.  [default: 3]"),
    option("--terms", WholeRange(1, 10), "N", "gaussians: number of Gaussians of the budget's "
           "kernel.  [default: 4]"),
    option("--model", [*methods.OF_HALF_SPACES, *methods.OF_LAYERS], None, "Profile "
           f"model of the budget's kernel; {', '.join(methods.OF_LAYERS)} for layers.  [default: "
           "the photon walk]"),
    option("-o --output", None, "FOLDER", "Folder of NAME-pareto.png and NAME-pareto.md with "
           "--all or --paper.  [default: here]"),
    flag("--force", "Replace an input, or files that are not our charts or tables."),
)

CHOOSE = (
    option("--distance distance_mm", Length(), "LENGTH", "Camera distance.", "0.6m"),
    option("--fov fov_degrees", _ANGLE, "DEGREES", "Vertical field of view.", 30.0),
    option("--resolution", Size(), "WxH", "Columns and rows of the frame.", "1920x1080"),
    option("--tolerance", Number(), "E", "Largest Delta E.  [default: 1; none with --fetches]"),
    option("--fetches", Number(), "N", "Most texture fetches a pixel."),
    option("--passes", WholeRange(1, 1000), "N", "Most passes of the stages."),
    option("--tolerance-of", ["p95", "p99", "mean"], None, "Figure that --tolerance limits: a "
           "percentile over the pixels, or the mean, which hides large errors of a few pixels.",
           "p95"),
    option("--irradiance", None, "NAME|FILE", f"Picture to judge by: {_FILE} file. The edge is at "
           f"{EDGE_DEGREES:g} degrees.", "head"),
    *_OF_FILES,
    option("-o --output", None, "FILE", "Table of taps, - for stdout; the profile goes beside it.  "
           "[default: MATERIAL.chosen.taps.json]"),
    STRICT,
    flag("--force", "Replace an input, or files that are not our kernel or profile."),
)

CHART = (
    option("--mm-per-pixel", Length("profile"), "MM|profile", "Pixels of the kernel, with "
           f"{_views_with('mm_per_pixel')}; profile is the width of the profile's first annulus.  "
           "[default: 0.3]"),
    option("--k ks", Numbers(), "0..4,...", f"One to four values, with {_views_with('ks')}.  "
           "[default: 0,1.55,4]"),
    option("--channel", None, "NAME", "Channel to draw, with --guide or of a kernel.  [default: "
           "the first that returns light; of a kernel up to three]"),
    option("--profile", None, "FILE", "Profile that a kernel was fitted to.  [default: found "
           "beside it or here, by its hash]"),
    option("--photons", Count(2, 10**12), "N", "Photons of the walk, with "
           f"{_views_with('photons')}.  [default: 1e7]"),
)

FIT_PIXELS = (
    flag("--list listing", "List the methods."),
    option("--method", list(FITS), None, "Fit method; --list describes each.", "cascade"),
    option("--mm-per-pixel", Length("profile"), "MM|profile", "Size of a pixel of the kernel; "
           "profile is the width of the profile's first annulus.  [default: 0.3]"),
    option("--pitches", Lengths(), "MM,...", "Pixel sizes to make a kernel for, a file each. "
           "Cascades with the same --stages can be mixed for sizes in between."),
    option("--support", Length("auto"), "MM|auto", "Half width of the kernel; auto is the "
           "smallest that keeps 99.9 % of every channel; cascade, gaussian-chain, rotated and "
           "pyramid keep up to 99.99 % within 320 pixels.", "auto"),
    flag("--smooth", "Take most of a walk's noise out of the profile before the fit."),
    flag("--normalize", "Separable kernels: scale each channel to unit energy, kept as a factor."),
)
FIT_OUTPUT = (STRICT, *output("PROFILE.METHOD.taps.json, .kernel.json without taps",
                             "is not our kernel"))

STABILITY = (
    option("--only", Names(STRESSES), "NAME,...", "Stresses, as below.  [default: every one]"),
    option("--mm-per-pixel", Length(), "MM", "Size of a pixel, where it is not what is made "
           "harder.", 0.3),
    flag("--whole is_whole", "As many seeds and sizes for cascades as for the others; slow."),
    _FIGURE,
    option("--table", None, "FILE", "Table in Markdown, - for stdout."),
    flag("--paper", "The paper's eleven materials, which take hours; no MATERIAL."),
    option("-o --output", None, "FOLDER", "--paper: folder of stability.md and charts.  "
           "[default: here]"),
    flag("--force", "Replace files that are not our chart or table."),
)
MOTION = (
    option("--light", list(LIGHTS), None, "Light, as below.", "strobe"),
    option("--irradiance", None, "NAME|FILE", f"Irradiance picture: {_FILE} file. The edge is at "
           f"{EDGE_DEGREES:g} degrees.", "head"),
    option("--mm-per-pixel", Length(), "MM", "Pixel size.  [default: from your file, else 0.3]"),
    option("--size", Size(), "WxH", "Made pictures: columns and rows.  [default: 512x512]"),
    _OF_FILES[0],
    option("--length", WholeRange(2, 100_000), "N", "Number of frames.", 100),
    option("--target-variance", _FACTOR, "V", "Variance that a frame's pixels should have, in "
           "squared units of radiant exitance.", 2e-3),
    option("--shift", Shift(), "X,Y", "Whole pixels by which the picture moves to the right and "
           "down in every frame.", "0,0"),
    option("--only", Names(RENDERERS), "NAME,...", "Renderers, as below; variates always runs.  "
           "[default: every one]"),
    option("--frames", None, "DIR", "Write every frame there, as frame-0000 and so on."),
    option("--format form", ["png", "exr"], None, "With --frames: format.  [default: png]"),
    option("--of", list(RENDERERS), None, "With --frames: renderer.  [default: variates]"),
    _FIGURE,
    flag("--table", "Measure Table 1 of the supplement in place of a sequence; no MATERIAL."),
    option("--seeds", WholeRange(1, 10_000), "N", "With --table: seeds.  [default: 200]"),
    flag("--force", "Replace files that are not our chart or pictures."),
)
SCENE = (
    option("--heads", WholeRange(1, 64), "N", "Number of heads.  [default: 1]"),
    option("--distance distance_units", _FACTOR, "UNITS", "From the camera to the row's middle.  "
           "[default: 10]"),
    option("--head head_units", _FACTOR, "UNITS", "Height of a head.", 2.5),
    option("--spacing spacing_units", _FACTOR, "UNITS", "From one head's middle to the next.", 2.0),
    option("--fov fov_degrees", _ANGLE, "DEGREES", "Vertical field of view.", 30.0),
    option("--resolution", Size(), "WxH", "Columns and rows of the frame.  [default: 1920x1200; "
           "480x300 with --table]"),
    option("--map-size", WholeRange(8, 16384), "N", "Side of a whole map in texels.  [default: "
           "1024; 512 with --table]"),
    option("--savings", Names((*SAVINGS, "none")), "NAME,...|none", "What is left out, as below.  "
           "[default: every one]"),
    option("--culled-by", ["vertex", "face"], None, "Normals by which texels face away.", "vertex"),
    option("--margin", _FACTOR, "D", "clipped: half widths of the picture that are kept.", 1.0),
    option("--mesh", None, "FILE", "OBJ, PLY, glTF or GLB with texture coordinates; needs the "
           "extra mesh.  [default: the made head]"),
    option("--bloom", Part(), "SHARE", "Light of -o that glare spreads over the "
           "picture, such as 0.05 or 5%.  [default: 0]"),
    flag("--table", "Measure the paper's Table 1 in place of a frame."),
    option("--chart", None, "FILE", "With --table: figure, PNG, SVG or PDF by its ending; - for "
           "PNG on stdout."),
    option("-o --output", None, "FILE", f"Picture with the savings, {ENDINGS}; - for EXR "
           "on stdout.  [default: none]"),
    flag("--force", "Replace a file that is not our chart or picture."),
)
REPORT = (
    SHIPPED[0],
    option("--kernel kernels", None, "FILE", "Your own table of taps, beside the others; may be "
           "given several times.", multiple=True),
    option("--irradiance", None, "FILE", "Your own irradiance picture, with which the page opens; "
           "it is scaled down to 256 x 256 pixels at most."),
    option("--mm-per-pixel", Length(), "MM", "Pixel size of the kernels, and of your own picture "
           "before it is scaled down.  [default: from your own file, else 0.3]"),
    option("--only", Names(FITS), "METHOD,...", "Only kernels by these fit methods, beside your "
           "own.  [default: those that are fitted in seconds]"),
    option("--photons", Count(2, 10**12), "N", "Photons for the models and the error "
           "budget.  [default: 200000]"),
    *output("MATERIAL.html, materials.html with --all", "is not our page"),
)
SWEEP = (
    flag("--dry-run", "Print points, photons, time and bytes from a short calibration, and end."),
    option("--scheduler", None, "ADDRESS", "Dask cluster that does the work: tcp://HOST:PORT, or "
           "local:N for N new workers.  [default: --threads processes of this machine]"),
    flag("--resume", "Compute only what an existing store of the same plan lacks."),
    option("-o --output", None, "FOLDER", "Zarr store to make.  [default: PLAN.zarr]"),
    flag("--force", "Replace an existing store of a sweep."),
)
EXPORT = (
    option("--format form", list(EXPORTS), None, "Output format, as below."),
    option("--preset", list(PRESETS), None, "An engine's own parameters, as below."),
    flag("--list listing", "List the presets."),
)
EXPORT_OUTPUT = STRICT, *output("NAME.FORMAT", "sssfit did not write")
# fmt: on
