"""Calls of the library whose results are approved: arguments that no command line reaches.

Each is an expression in the names of ``NAMES``, evaluated in a copy of the folder of files.
"""

import dataclasses
import functools
import io
import json
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import approval_records as records
import approval_world as world
import numpy as np
from approval_figures import figure_lines
from approval_files import array_text, file_lines, masked, text_lines
from approval_folder import copied_files
from approval_run import stand_ins
from matplotlib.figure import Figure

from sssfit import compare, export, measure
from sssfit.arrays import plain_value
from sssfit.choose import choice, report
from sssfit.compare import budget, evaluate, sheet, table
from sssfit.errors import SssfitError
from sssfit.export import document
from sssfit.fit import fit_artist, fit_svd
from sssfit.formats import colours, csv, mci, mco, pictures
from sssfit.kernel import SeparableKernel
from sssfit.material import Material, parse_material
from sssfit.measure import asymmetry, cost, delta_e, difference, score, structure
from sssfit.profile import Profile
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene


@dataclass(frozen=True)
class Call:
    """An expression; its text is what it is found by."""

    line: str

    @property
    def title(self) -> str:
        return self.line


@functools.cache
def scene(name: str, height: int = 20, width: int = 32, pitch: float = 0.25, **own: Any) -> Scene:
    return make_scene(name, height=height, width=width, mm_per_pixel=pitch, **own)


def near(truth: np.ndarray) -> np.ndarray:
    """A picture that is off by another share in every channel, pixel and direction."""
    ramp = np.linspace(-0.2, 0.3, truth.shape[0])[:, None, None]
    return np.asarray(truth * (1.0 + ramp) + 0.01 * np.arange(truth.shape[2]), dtype=np.float64)


def saved(pixels: Any, **own: Any) -> tuple[Any, bytes]:
    """What `save_image` says, and the file."""
    stream = io.BytesIO()
    return pictures.save_image(stream, pixels, **own), stream.getvalue()


@functools.cache
def comparison() -> Any:
    scenes = [scene("disk", pitch=0.5), scene("edge", pitch=0.5, angle_degrees=30.0)]
    return compare.compare_kernels(world.wax(), scenes, support_mm=3.0)


def fields(record: Any) -> dict[str, Any]:
    return {field.name: getattr(record, field.name) for field in dataclasses.fields(record)}


TRUTH = world.light(13, 17, 3).astype(np.float64)
MASK = (np.arange(13)[:, None] + np.arange(17) > 2).astype(np.float64)
NAMES = {
    **records.NAMES,
    **{name: value for name, value in vars(colours).items() if not name.startswith("_")},
    **{name: value for name, value in vars(delta_e).items() if not name.startswith("_")},
    **vars(export),
    "asymmetry": asymmetry,
    "budget": budget,
    "choice": choice,
    "compare": compare,
    "cost": cost,
    "csv": csv,
    "difference": difference,
    "document": document,
    "evaluate": evaluate,
    "mci": mci,
    "mco": mco,
    "np": np,
    "measure": measure,
    "pictures": pictures,
    "report": report,
    "score": score,
    "sheet": sheet,
    "table": table,
    "structure": structure,
    "world": world,
    "file_lines": file_lines,
    "io": io,
    "scene": scene,
    "near": near,
    "saved": saved,
    "fields": fields,
    "TRUTH": TRUTH,
    "MASK": MASK,
    "comparison": comparison,
    "make_scene": make_scene,
    "parse_material": parse_material,
    "fit_svd": fit_svd,
    "fit_artist": fit_artist,
    "Scene": Scene,
}


def lines_of(call: Call) -> list[str]:
    """What comes out of it: the result, what was warned of, or the error."""
    charts: dict[bytes, list[str]] = {}
    with copied_files() as folder, stand_ins(charts), warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            lines = list(told(eval(call.line, dict(NAMES))))
        except SssfitError as error:
            lines = [f"{type(error).__name__}: {error}"]
        except (TypeError, ValueError) as error:
            lines = [f"not ours: {type(error).__name__}: {error}"]
    lines += [f"{each.category.__name__}: {each.message}" for each in said]
    return [masked(f"| {line}".rstrip(), str(folder)) for line in lines]


def told(value: Any) -> Iterator[str]:
    """Lines of a result."""
    if isinstance(value, bytes):
        ending = {b"\x76\x2f\x31\x01": "exr", b"\x89PNG": "png"}.get(value[:4], "tif")
        yield from file_lines(f"result.{ending}", value)
    elif isinstance(value, str) and "\n" in value:
        yield from text_lines(value)
    elif isinstance(value, Profile | SeparableKernel):
        stream = io.BytesIO()
        value.write(stream)
        yield repr(value)
        yield from file_lines("result", stream.getvalue())
    elif isinstance(value, Figure):
        yield from figure_lines(value, {})
    elif isinstance(value, Material):
        yield from text_lines(value.to_toml())
    elif hasattr(value, "to_dict"):
        yield type(value).__name__
        yield from text_lines(json.dumps(value.to_dict()) + "\n")
    elif isinstance(value, np.ndarray):
        yield array_text(value)
    elif dataclasses.is_dataclass(value):
        yield type(value).__name__
        yield from told(fields(value))
    elif isinstance(value, Mapping):
        for key, each in value.items():
            parts = list(told(each))
            yield from (
                [f"{key}: {parts[0]}"]
                if len(parts) == 1
                else [f"{key}:", *(f"  {p}" for p in parts)]
            )
    elif isinstance(value, list | tuple) and not _is_plain(value):
        for each in value:
            yield from (f"- {line}" if k == 0 else f"  {line}" for k, line in enumerate(told(each)))
    else:
        yield repr(plain_value(value) if isinstance(value, list | tuple | np.generic) else value)


def _is_plain(values: Any) -> bool:
    return all(isinstance(each, int | float | str | None | np.generic) for each in values)


EXPORT = [
    "kernel_text(kernel('five'), 'hlsl')[0]",
    "json_document(kernel('grau'))",
    "kernel_text(fit_svd(world.mono(), rank=2, mm_per_pixel=0.8, normalize=True).kernel, 'hlsl')[0]",
    "kernel_text(kernel('grau', weights=put(world.kernels()['grau'].weights, (0, [0, 4], 0), 3e-39)), 'hlsl')[0]",
    "kernel_text(kernel('grau', weights=put(world.kernels()['grau'].weights, (0, [0, 4], 0), 1.2e-38)), 'hlsl')[0]",
    "kernel_text(kernel('grau', weights=put(world.kernels()['grau'].weights, (0, [0, 4], 0), -12345678.9)), 'hlsl')[0]",
    "kernel_text(kernel('leaf.burley', mm_per_pixel=0.123456789, scale=[1e-7, 123456789.0]), 'hlsl')[0]",
    "json_document(kernel('five', mm_per_pixel=1 / 7, scale=[0.5, 1 / 3, 2, 1e-9, 7e7]))",
    "kernel_text(kernel('five', meta={'material': 'a\\nb', 'photons': 0, 'seed': 0, 'settings': {'x\\n': 1}}), 'hlsl')[0]",
    "kernel_text(kernel('five', meta={'material_sha256': 'ab' * 32, 'profile_method': 'exact', 'seed': 3}), 'hlsl')[0]",
    "kernel_text(kernel('five'), 'glsl')[0]",
    "kernel_text(kernel('grau'), 'c', prefix='WAX', half=True)[0]",
    "kernel_text(Taps.load('wax.hand.taps.json'), 'wgsl')[0]",
    "document.description(kernel('wax.svd2', energy_error=[1e-13, -2e-12, np.nan],"
    " relative_frobenius_error=[0.0, 9e-13, 1.23456789]))",
]

FORMATS = [
    "csv.parse_csv('r,a,b\\n1,.1,.2\\n2,.01,.02\\n', 'x/a b.csv', quantity='density', unit='cm')",
    "csv.parse_csv('r_m,a\\n.001,.1\\n.002,.01\\n', 'a.csv', quantity='density', density_unit='mm')",
    "csv.parse_csv('a,r_um,a_stderr\\n.1,1,.01\\n.2,2,nan\\n.3,inf,.02\\n', 'a.csv', quantity='energy')",
    "csv.parse_csv('r,a\\n1,.1\\n', 'a.csv', quantity='density', unit='inch')",
    "csv.parse_csv('r_mm,a\\n1,.1\\n2,.1\\n', 'a.csv', quantity='density', density_unit='inch')",
    "csv.parse_csv('r_mm,a\\n1,.1\\n2,.1\\n', 'a.csv', quantity='weight')",
    "csv.parse_csv('r_mm,a\\ninf,.1\\n2,.1\\n', 'a.csv', quantity='energy')",
    "csv.parse_csv('r_mm,\\x1b,b\\n1,.1,.2\\n', 'a.csv', quantity='energy')",
    "csv.parse_csv('r_mm,a\\n1,1e13\\n2,1\\n', 'a.csv', quantity='energy')",
    "csv.parse_csv('r_mm,a\\n1e13,.1\\n2,1\\n', 'a.csv', quantity='energy')",
    "csv.csv_text(csv.load_csv('energy.csv'))",
    "csv.csv_text(world.plate())",
    *(
        f"csv.parse_csv('r_mm,a\\n1,.1\\n2,.01\\n{word},.5\\n', 'a.csv', quantity='energy').beyond_grid"
        for word in ("inf", "+INF", "Infinity", "-inf", "nan")
    ),
    "csv.parse_csv('r_mm,a,a_stderr\\n1,.1,NaN\\n2,.01,.001\\n', 'a.csv', quantity='energy').annulus_energy_stderr",
    "csv.UNITS, csv.QUANTITIES",
    "mci.load_mci('two.mci')",
    "mci.load_mci('sample.mci')",
    "mci.parse_mci('1.0\\n0\\n', 'a.mci')",
    "mci.parse_mci('', 'a.mci')",
    "mci.parse_mci('mcmli2.0\\n', 'a.mci')",
    "mci.parse_mci('2.0\\n', 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('first.mco A', 'a.mco X'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('first.mco', '..?'), 'a.mci')[0].material.name",
    "mci.parse_mci(world.TWO_RUNS.replace('0.05 0.02', '0.05 0'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100', '1.4 -1 100'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100', '9 1 100'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('0.5 7.4', '0 0'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100 0.9', '.98 0 0 1'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100', 'x 1 100'), 'a.mci')",
    "[mco.is_mco(text) for text in ('A1', '# a\\nA1', 'B1', 'mcmloA2.0', 'mcmlo_3.0', '1.0', '')]",
    "mco.load_mco('r.mco')",
    "mco.parse_mco(world.mco_text(above=1.2, below=1.5), 'some/where.mco')",
    "mco.parse_mco(world.mco_text().replace('InParm #', 'InParam #'), 'a.mco')",
    "mco.parse_mco(world.mco_text().replace('InParm #', 'Input #'), 'a.mco')",
    "mco.parse_mco(world.mco_text().replace('2 4 1', '2 1 1'), 'a.mco')",
    "mco.parse_mco(world.mco_text(rat='.9\\n.3\\n0\\n0'), 'a.mco')",
    "mco.parse_mco(world.mco_text(rat='.9\\n.3\\n0\\n0', absorbed='0\\n0', through='0\\n0\\n0\\n0'), 'a.mco')",
    "mco.parse_mco(world.mco_text(name='x' * 120 + '.mco'), 'a.mco').material_name",
    "mco.parse_mco(world.mco_text(absorbed='0.4\\n0.16'), 'a.mco')",
    "mco.parse_mco(world.mco_text(through='1\\n1\\n1\\n1'), 'a.mco')",
    "mco.parse_mco(world.mco_text(reflected='1 2\\n3 4 5'), 'a.mco')",
    "mco.parse_mco('A2\\n', 'a.mco')",
    "mco.join_channels([mco.load_mco('r.mco')] * 2, ['a'])",
    "mco.join_channels([mco.load_mco('r.mco'), mco.load_mco('g.mco')], ['a', 'a'])",
    "srgb_encode([0.0, 0.002, 0.0031308, 0.2, 1.0])",
    "srgb_decode([0.0, 0.03, 0.04045, 0.5, 1.0])",
    "linear_from_hex('#C58c6b'), linear_from_hex('#fA0')",
    "linear_from_hex('fa0')",
    "matrix_to_bt709([.708, .292, .17, .797, .131, .046, .3127, .329], 'a.exr')",
    "matrix_to_bt709([.64, .33, .3, .6, .15, .06, .3457, .3585], 'a.exr')",
    "matrix_to_bt709([.64, .33, .3, .6, .15, .06, .3127, .329], 'a.exr')",
    "matrix_to_bt709([.64, .33, .3, .6, .15, .06, .3127, 0], 'a.exr')",
    "matrix_to_bt709([.3, .6, .64, .33, .15, .06, .3127, .329], 'a.exr')",
    "matrix_to_bt709([.3, .6, .3, .6, .15, .06, .3127, .329], 'a.exr')",
    *(
        f"pictures.load_image('{name}')"
        for name in (
            *("mine.exr", "depth.exr", "vier.exr", "two.exr", "wide.exr", "ebu.exr", "rgb8.png"),
            *("rgba16.png", "grey.png", "turned.tif", "rgba8.tif", "photo.tga", "photo.jpg"),
            *(f"o{k}.tif" for k in range(1, 9)),
            *("inside.exr", "across.exr", "half.exr", "y.exr", "place.exr", "wide.tif"),
            *(
                f"t{name}.tga"
                for name in ("1_8", "2_15", "2_16", "2_24", "2_32", "2_48", "3_8", "4_8")
            ),
            *("associated.tif", "palette.png", "p3.png", "srgb_and_p3.png"),
            *("old.hdr", "xyz.hdr", "negative.exr", "foreign.png", "out", "missing.png"),
        )
    ),
    *(
        f"pictures.load_image('packed{code}.tif')"
        for code in (34661, 34712, 34887, 34925, 50000, 50002, 52546, 40000)
    ),
    "pictures.load_image('layers.exr', layer='near')",
    "pictures.load_image('layers.exr', layer=3)",
    "pictures.load_image('mine.exr', largest_bytes=1000)",
    "pictures.load_image('mine.exr', largest_bytes=-1)",
    "saved(TRUTH, format='exr', mm_per_pixel=0.123456789012345)",
    "saved(TRUTH, format='exr', channels=['B', 'G', 'R'], alpha=MASK)",
    "saved(TRUTH, format='exr', alpha=MASK, alpha_is_multiplied=True)",
    "saved(TRUTH, format='png', exposure=1.5, alpha=0.5 * MASK + 0.25, alpha_is_multiplied=True)",
    "saved(TRUTH[..., :1], format='png', alpha=MASK)",
    "saved(TRUTH - 0.1, format='png')",
    "saved(TRUTH[..., :2], format='exr', channels=['a', 'ä'])",
    "saved(TRUTH[..., :2], format='exr')",
    "saved(TRUTH[..., :2], format='png')",
    "saved(TRUTH, format='tiff', exposure=2.0)",
    "saved(TRUTH, format='gif')",
    "saved(TRUTH)",
    "saved(TRUTH[0], format='exr')",
    "saved(TRUTH / 0, format='exr')",
    "saved(TRUTH * 1e39, format='exr')",
    "saved(TRUTH, format='exr', channels=['R', 'R', 'B'])",
    "saved(TRUTH, format='exr', channels=['R', 'G', '\\n'])",
    "saved(TRUTH, format='exr', channels=3)",
    "saved(TRUTH, format='exr', alpha=MASK[1:])",
    "saved(TRUTH, format='exr', channels=['R', 'G', 'A'], alpha=MASK)",
    "saved(TRUTH, format='exr', mm_per_pixel=0)",
    "saved(TRUTH, format='png', exposure=float('inf'))",
    "saved([['a']], format='png')",
    "pictures.Image(TRUTH, ('R', 'G', 'B'), alpha=MASK[1:])",
    "pictures.Image(TRUTH[0], ('R', 'G', 'B'))",
    "[pictures.image_format(name) for name in ('a.EXR', 'a.tif', 'a.tiff', 'a.png')]",
    *(
        f"pictures.load_image('{name}')"
        for name in (
            *("only.exr", "dotted.exr", "alpha.exr", "red.exr", "aov.exr", "greys.exr"),
            *("acescg.exr", "same.exr", "small.exr", "y_small.exr", "gamma1.png", "gamma1.8.png"),
            *("plain.png", "gamma2.2.png"),
            *(
                "scaled.exr",
                "parts.exr",
                "primaries.hdr",
                "wrong_factors.hdr",
                "wrong_exposure.hdr",
            ),
            *(
                "negative.hdr",
                "far.exr",
                "negative_wide.exr",
                "holed.exr",
                "infinite.exr",
                "wrong_primaries.hdr",
                "far.hdr",
                "twice.hdr",
                "cut.tif",
            ),
            *("flipped.png", "unended.png", "noise.jpg", "grey.dat", "nearly.dat", "short.tga"),
            *("depth7.tga", "wide0.tga", "flat.exr", "empty.csv", "x" * 500),
        )
    ),
    "pictures.load_image('parts.exr', layer='second')",
    "pictures.load_image('parts.exr', layer='third')",
    "pictures.load_image('greys.exr', layer='a')",
    "pictures.load_image('only.exr', layer='')",
    "pictures.load_image('bare.exr', layer='R')",
    "pictures.load_image('only.exr', layer='only')",
    *(f"pictures.load_image({path})" for path in ("3", "'a\\0b'", "b'mine.exr'")),
    "[pictures.is_image_file(each) for each in ('own.exr', 'own.png', 'own.tif', 'bare.exr',"
    " 'rgb8.png', 'foreign.png', 'missing.png', 3)]",
    "pictures.load_image('mine.exr', largest_bytes=32 * 10 * 14 * 3).pixels.shape",
    "pictures.load_image('mine.exr', largest_bytes=32 * 10 * 14 * 3 - 1)",
    "saved(np.zeros((1, 1000001, 1)), format='png')",
    "saved([[[1.0], [2.0, 3.0]]], format='exr')",
    "saved(1j * TRUTH, format='exr')",
    "saved(TRUTH[:0], format='exr')",
    "saved(1.0000005 * TRUTH / TRUTH.max(), format='png')",
    "saved(1.01 * TRUTH / TRUTH.max(), format='png')",
    "saved(TRUTH[..., :1], format='tiff', alpha=MASK, mm_per_pixel=0.25)",
    "saved(TRUTH, format='tiff', alpha=0.25 + 0.5 * MASK, alpha_is_multiplied=True)",
    "saved(TRUTH, format='exr', alpha=MASK * np.nan)",
    "saved(TRUTH, format='exr', channels=['λ' * 127, 'b', 'c'])[0]",
    "saved(TRUTH, format='exr', channels=['λ' * 128, 'b', 'c'])",
    "saved(TRUTH, format='exr', channels=['', 'b', 'c'])",
    "saved(TRUTH, format='exr', exposure=True)",
    "[reflectance_of_codes(each) for each in ('#fff', [197, 140, 107], [40.0], [0, 255])]",
    "reflectance_of_codes([1.5, 2, 3])",
    "reflectance_of_codes([1, 256, 3])",
    *(
        f"csv.csv_text(profile('wax', {change}))"
        for change in (
            *("meta={'channels': ['r_cm', 'G', 'B'], 'material': None}",),
            *("meta={'channels': ['G_stderr', 'G', 'B'], 'material': None}",),
            *("meta={'channels': ['#a', 'b,c', 'd \"e\"'], 'material': None, 'source': 's\\nt'}",),
            "annulus_energy=put(world.wax().annulus_energy, ([3, 9], [2, 0]), -1e-3)",
            "beyond_grid=[0.1, -0.25, 0.1]",
            "beyond_grid=[0.1, 0.9, 0.1]",
            "beyond_grid_stderr=[np.nan, 0.125, np.nan]",
        )
    ),
    "mco.parse_mco(world.mco_text(layers='0.5 1 100 0.9 0.1\\n1.4 2.5 10 0 0.2'), 'a.mco')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 2.5 10 0 0.2', '1.4 2.5 10 0 1e6'), 'a.mci')[0]"
    ".material",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 2.5 10 0 0.2', '1.4 2.5 10 0 999999'), 'a.mci')[0]"
    ".material",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100 0.9', '1.4 0 0 0.9').replace('1.4 2.5 10',"
    " '1.4 0 0'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('1.4 1 100 0.9', '1.4 1e9 1e9 0.9'), 'a.mci')",
    "mci.parse_mci(world.TWO_RUNS.replace('0.9 0.1', '1 1e-8'), 'a.mci')[0].material",
    "mci.load_mci('two.mci', 0)",
    "mci.parse_mci('x', 'a\\nb')",
    "mci.load_mci('a\\nb')",
    "mco.parse_mco('x', 'a\\nb')",
    "csv.parse_csv('x', 'a\\nb')",
    "pictures.load_image('a\\nb')",
    "mci.load_mci('two.mci', 2)",
    "[run.settings({'dr_mm': 0.7, 'radius_mm': None}, photons=k == 1) for k, run in"
    " enumerate(mci.load_mci('two.mci'))]",
    "mco.join_channels([mco.load_mco('deep.mco'), mco.load_mco('through.mco')], ['a', 'b'])",
    "mco.join_channels([mco.parse_mco(world.mco_text(name=n, photons=p), n) for n, p in"
    " (('x.mco', 7), ('y.mco', 9))], ['a', 'b'])",
    "mco.join_channels([mco.load_mco('r.mco'), mco.parse_mco(world.mco_text().replace('2 4 1', '2 5 1')"
    ".replace('4.5473E+00', '4.5473E+00\\n0').replace('1.1368E+00', '1.1368E+00\\n0'), 'more.mco')],"
    " ['a', 'b'])",
    "mco.join_channels([mco.parse_mco(world.mco_text(above=1.1, below=1.5), 'x.mco')] * 2, ['a', 'b']).material",
    "mco.parse_mco(world.mco_text().replace('A1 #', '# a comment\\n\\nA1 #'), 'a.mco')",
    "mco.parse_mco(world.mco_text().replace('InParm #', 'InParam #').replace('r.mco A #',"
    " 'r.mco A#7 '), 'a.mco').meta",
    "mco.parse_mco(world.mco_text().replace('1.4 2.5 10 0 0.2', '1.4 2.5 10 0 0.2 # µ'), 'a.mco')"
    ".meta",
]

COMPARE = [
    "comparison()",
    "table.table_text(comparison(), '.md', 'l2', 'seconds')",
    "table.table_text(comparison(), '.csv', 'l2', 'passes')",
    "[table.verdict_lines(comparison(), e, c) for e in ('l2', 'delta-e') for c in ('passes', 'seconds')]",
    "compare.pareto_front([1, 2, 2, 3, 4], [5, 4, 4, 4, 1])",
    "compare.compare_kernels(world.leaf(), [scene('edge')], support_mm=1.0).to_dict()['rows'][:2]",
    "compare.compare_kernels(world.wax(), [])",
    "compare.compare_kernels(world.wax(), [scene('edge'), scene('edge')])",
    "compare.compare_kernels(world.wax(), [scene('edge'), scene('disk', pitch=0.5)])",
    "compare.compute_guide(world.plate(), ks=[0.5], channel='G', mm_per_pixel=0.4, support_mm=2.0)",
    "fields(compare.compute_guide(world.plate(), ks=[0.5, 3.0], mm_per_pixel=0.4, support_mm=2.0))",
    "compare.compute_guide(world.plate(), ks=[])",
    "compare.compute_spectrum(world.plate(), mm_per_pixel=0.4)",
    "fields(compare.compute_spectrum(world.four(), mm_per_pixel=0.6))",
    "compare.view_kernel(kernel('plate.artist'), world.plate(), channels=['R', 'B'])",
    "fields(compare.view_kernel(kernel('wax.svd2'), world.wax(), channels=['G']))",
    "compare.view_kernel(kernel('vier.gaussians4'))",
    "compare.view_kernel(kernel('wax.svd2'), world.plate())",
    "evaluate.evaluate(scene('disk'), kernel('wax.svd2'), world.wax(), border='clamp', structure=True, exposure=2.0)",
    "evaluate.evaluate(scene('edge', pitch=0.2125), kernel('plate.artist'), world.plate(), border='zero')",
    "evaluate.evaluate(scene('disk'), kernel('wax.svd2'))",
    "evaluate.evaluate_in_screen_space(scene('head', pitch=3.0), kernel('wax.svd2'), follow='lerp', border='clamp')",
    "evaluate.evaluate_in_screen_space(scene('head', pitch=3.0), kernel('wax.svd2'))",
    "evaluate.evaluate_in_screen_space(scene('disk'), kernel('wax.svd2'))",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), scene('edge', pitch=0.5, angle_degrees=20.0),"
    " photons=2000, method='burley', storage='8-bit', radius_mm=9.0, seed=3)",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), scene('disk', pitch=0.5),"
    " photons=2000, settings={'rank': 2}, model='dipole', storage='float32')",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), scene('disk'), storage='16-bit')",
    "budget.error_budget(world.parse_material(world.LEAF, 'w'), scene('disk'))",
    "budget.error_budgets(world.parse_material(world.WAX, 'w'), [])",
    "budget.error_budgets(world.parse_material(world.WAX, 'w'), [scene('disk'), scene('edge', pitch=0.5)])",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), scene('disk'), model='multipole')",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), Scene('flat', np.ones((4, 5, 1)), 0.5))",
    "compare.compare_kernels(world.wax(), [scene('disk')], candidates=[])",
    "compare.compare_kernels(world.wax(), [scene('disk', pitch=2.5), scene('edge', pitch=2.5)]).to_dict()['rows'][:2]",
    "sheet.compute_sheet(world.mono(), mm_per_pixel=0.8, pixels=12, scenes=('edge',), most_terms=1)",
    "evaluate.evaluate(scene('disk'), kernel('wax.svd2')).with_difference()",
    "evaluate.evaluate(scene('disk'), kernel('wax.svd2')).save({'truth': io.BytesIO()})",
    "evaluate.evaluate(scene('disk'), kernel('wax.svd2'), world.plate())",
    "[evaluate.evaluate(scene('disk'), kernel('wax.svd2')).save({'picture': Path('p.png')}, exposure=e)"
    " for e in (None, 5.0)], file_lines('p.png', Path('p.png').read_bytes())",
    "evaluate.evaluate(scene('edge', 9, 14, angle_degrees=25.0), kernel('wax.svd2'), world.wax(),"
    " structure=True)",
    "evaluate.evaluate(scene('edge', 13, 14, angle_degrees=25.0), kernel('wax.svd2'), world.wax(),"
    " border='zero', exposure=0.25, structure=True)",
    "compare.pareto_front([1, 2, 3], [1, 2])",
    "compare.pareto_front([[1]], [[2]])",
    "compare.pareto_front([np.nan, 2, 2, 1], [0, 3, 3, np.inf])",
    "compare.compare_kernels(world.wax(), [Scene('flat', np.ones((4, 5, 1)), 0.5)])",
    "compare.compare_kernels(world.wax(), [Scene('pair', TRUTH[..., :2], 0.5)])",
    "compare.compare_models(parse_material(world.WAX, 'w'), walk=world.four())",
    "compare.compare_models(parse_material(world.WAX, 'w'), walk=world.leaf())",
    "[compare.view_kernel(fit_svd(world.mono(), rank=1, mm_per_pixel=0.004, support_mm=p).kernel).to_dict()"
    " for p in (1.2, 1.208)]",
    "fields(compare.view_kernel(fit_svd(world.mono(), rank=1, mm_per_pixel=0.002, support_mm=1.205).kernel,"
    " world.mono()))",
    "compare.view_kernel(kernel('wax.svd2'), channels=['X'])",
    "budget.error_budget(world.parse_material(world.WAX, 'w'), scene('disk', pitch=0.5), photons=2000,"
    " settings={}, method='svd')",
    "table.table_text(comparison(), '.json', 'l2', 'passes')",
    "[table.kernels_text(comparison(), 'l2', 'seconds'), table.fronts_text([comparison()], 'l2', 'passes')]",
    "sheet.production_look(fit_artist(world.plate(), mm_per_pixel=0.4).kernel)",
]

CHOOSE = [
    "choice.choose(world.mono(), mm_per_pixel=0.5, scene=scene('edge', pitch=0.5), tolerance=6.0, tolerance_of='p99')",
    "choice.choose(world.plate(), mm_per_pixel=0.5, scene=scene('disk', pitch=0.5), tolerance=6.0, tolerance_of='mean')",
    "choice.choose(world.wax(), mm_per_pixel=2.5, distance_mm=700.0, frame=(48, 64), tolerance=3.0)",
    "choice.choose(world.wax(), mm_per_pixel=0.5, tolerance_of='p90')",
    "choice.choose(world.wax(), mm_per_pixel=0.5, tolerance=-1)",
    "choice.choose(world.wax(), mm_per_pixel=0.0)",
    "choice.choose(world.wax(), mm_per_pixel=0.001)",
    "choice.choose(world.wax(), mm_per_pixel=0.5, scene=scene('disk'))",
    "[choice.mm_per_pixel_at(600.0, 30.0, 1080), choice.mm_per_pixel_at(250.0, 170.0, 7)]",
    "choice.mm_per_pixel_at(600.0, 181.0, 1080)",
    "choice.mm_per_pixel_at(-1.0, 30.0, 1080)",
    "choice.mm_per_pixel_at(600.0, 30.0, 0)",
    "choice.mm_per_pixel_at(1e308, 179.0, 1)",
    "choice.mm_per_pixel_at(600.0, 0.0, 1080)",
    "choice.mm_per_pixel_at(600.0, 180.0, 1080)",
    "choice.mm_per_pixel_at(0.0, 30.0, 1080)",
    "choice.mm_per_pixel_at(1.0, 0.001, 1000)",
    "choice.choose(world.four(), mm_per_pixel=0.5)",
    "report.sentences(choice.choose(profile('mono', r_edges_mm=1000 * world.mono().r_edges_mm), mm_per_pixel=1500.0))",
    "report.sentences(choice.choose(world.mono(), mm_per_pixel=1.0, distance_mm=200.0, frame=(40, 40), tolerance=2.2))",
    "report.sentences(choice.choose(parse_material(world.WAX, 'w'), mm_per_pixel=0.5, scene=scene('disk', pitch=0.5), tolerance=5.7))",
    "choice.choose(world.mono(), mm_per_pixel=0.5, scene=Scene('flat', np.ones((4, 5, 1)), 0.5))",
    "choice.choose(world.mono(), mm_per_pixel=0.5, scene=Scene('masked', TRUTH[..., :1], 0.5, mask=0 * MASK))",
    "choice.choose(world.mono(), mm_per_pixel=0.5, scene=Scene('masked', TRUTH[..., :1], 0.5, mask=MASK),"
    " tolerance=8.0)",
    "report.sentences(choice.choose(world.mono(), mm_per_pixel=2.0, distance_mm=1e7, frame=(2, 2)))",
    "choice.choose(profile('mono', annulus_energy=0 * world.mono().annulus_energy, beyond_grid=[0]),"
    " mm_per_pixel=0.5)",
    "report.sentences(choice.choose(profile('wax', meta={'material': {'name': 'x'}, 'material_sha256': None}),"
    " mm_per_pixel=1.5, scene=scene('disk', pitch=1.5), tolerance=9.0))",
    "report.sentences(choice.choose(world.plate(), mm_per_pixel=0.5, scene=scene('disk', pitch=0.5),"
    " tolerance=2.5, seed=4))",
    "[report.sentences(choice.choose(world.mono(), mm_per_pixel=p, tolerance=t, distance_mm=200.0,"
    " frame=(24, 30))) for p, t in ((1.5, 3.0),)]",
]

MEASURE = [
    "score.measure(near(TRUTH), TRUTH)",
    "score.measure(near(TRUTH), TRUTH, exposure=0.5, mask=MASK, structure=True)",
    "score.measure(near(TRUTH)[..., :2], TRUTH[..., :2], mask=MASK)",
    "score.measure(near(TRUTH)[..., :1], TRUTH[..., :1])",
    "score.measure(TRUTH, TRUTH)",
    "score.measure(TRUTH, 0 * TRUTH)",
    "score.measure(TRUTH, TRUTH[1:])",
    "score.measure(TRUTH, TRUTH, mask=MASK[1:])",
    "score.measure(TRUTH, TRUTH, mask=0 * MASK)",
    "score.measure(TRUTH, TRUTH, exposure=0.0)",
    "score.measure(TRUTH / 0, TRUTH)",
    "[score.auto_exposure(TRUTH), score.auto_exposure(TRUTH, MASK)]",
    "delta_e_2000(near(TRUTH)[2], TRUTH[2], 0.7)",
    "delta_e_2000(near(TRUTH)[2, :, :1], TRUTH[2, :, :1])",
    "lab(TRUTH[1])",
    "[structure.ssim(near(TRUTH), TRUTH, 0.7), structure.ssim(near(TRUTH), TRUTH, mask=MASK)]",
    "[structure.flip(near(TRUTH), TRUTH, 0.7), structure.flip(near(TRUTH), TRUTH, mask=MASK, pixels_per_degree=20.0)]",
    "structure.flip(near(TRUTH), TRUTH, pixels_per_degree=0.0)",
    "structure.ssim(TRUTH[:4], TRUTH[:4])",
    "fields(difference.difference_map(near(TRUTH), TRUTH, kind='signed', gain=3.0))",
    "fields(difference.difference_map(near(TRUTH), TRUTH, kind='absolute'))",
    "fields(difference.difference_map(near(TRUTH)[..., :2], TRUTH[..., :2]))",
    "fields(difference.difference_map(near(TRUTH)[..., :1], TRUTH[..., :1], kind='absolute', gain=2.0))",
    "fields(difference.difference_map(TRUTH, TRUTH))",
    "fields(difference.difference_map(TRUTH, TRUTH, kind='relative'))",
    "fields(difference.difference_map(TRUTH, TRUTH[1:]))",
    "difference.magnified_difference(near(TRUTH), TRUTH, gain=2.5)",
    "difference.magnified_difference(near(TRUTH), TRUTH, gain=-1.0)",
    "[asymmetry.radial_asymmetry(kernel('wax.svd2').full(1), from_pixels=k) for k in (1, 2, 4)]",
    "asymmetry.asymmetry_by_radius(kernel('wax.svd2').full(0))",
    "asymmetry.radial_asymmetry(kernel('wax.svd2').full(1), from_pixels=5)",
    "asymmetry.radial_asymmetry(np.ones((3, 4)))",
    "asymmetry.radial_asymmetry(np.ones((1, 1)))",
    "asymmetry.radial_asymmetry(np.full((3, 3), np.nan))",
    "[cost.cost_of(kernel(name), 0.25) for name in ('wax.svd2', 'five', 'grau')]",
    "cost.seconds_per_megapixel(lambda: None, 40, repeats=3)",
    "cost.seconds_per_megapixel(lambda: None, 0)",
    "cost.seconds_per_megapixel(lambda: None, 4, repeats=0)",
    "cost.cost_of(kernel('wax.gaussians3', weights=world.kernels()['wax.gaussians3'].weights"
    " * np.array([1, 0, 1])[:, None, None]))",
    "score.measure(TRUTH[0], TRUTH[0])",
    "score.measure(TRUTH[:0], TRUTH[:0])",
    "structure.flip(TRUTH[..., :2], TRUTH[..., :2])",
    "score.measure(near(TRUTH)[..., :2], TRUTH[..., :2], structure=True)",
    "score.auto_exposure(0 * TRUTH)",
    "score.measure(near(TRUTH), np.where(TRUTH > 0.1, TRUTH, 0), exposure=2.0)",
    "score.measure(TRUTH - 0.5, TRUTH)",
    "score.measure(near(TRUTH), -TRUTH, exposure=1.0)",
    "[score.auto_exposure(np.where(TRUTH > t, TRUTH, 0)) for t in (0.0, 0.5, 0.98)]",
    "structure.ssim(near(TRUTH)[:12, :11], TRUTH[:12, :11])",
    "structure.ssim(near(TRUTH)[:, :11], TRUTH[:, :11], mask=MASK[:, :11] * np.eye(13)[:, :11])",
    "fields(difference.difference_map(near(TRUTH), TRUTH, kind=None, gain=3.0))",
    "fields(difference.difference_map(near(TRUTH)[..., :1], TRUTH[..., :1], kind='signed'))",
    "fields(difference.difference_map(near(TRUTH)[..., :2], TRUTH[..., :2], kind='absolute', gain=.5))",
    "[asymmetry.radial_asymmetry(np.outer([1, 2, 9, 2, 1], [1, 3, 7, 3, 1]), from_pixels=k) for k in (1, 2)]",
    "asymmetry.radial_asymmetry(np.zeros((5, 5)))",
    "asymmetry.asymmetry_by_radius(np.eye(5))",
]

CALLS = {
    "python-export": [*map(Call, EXPORT)],
    "python-formats": [*map(Call, FORMATS)],
    "python-compare": [*map(Call, COMPARE)],
    "python-choose": [*map(Call, CHOOSE)],
    "python-measure": [*map(Call, MEASURE)],
    "python-records": [*map(Call, records.RECORDS)],
}
