"""Records and their files, whole and damaged; texts, numbers and tables: calls for the approvals.

What a person may change in a file of ours is changed here, a place at a time.
"""

import dataclasses
import io
import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import approval_world as world
import numpy as np

from sssfit import kinds, messages, text
from sssfit.errors import SssfitError
from sssfit.export import summary
from sssfit.kernel import SeparableKernel
from sssfit.kernel.json import is_kernel_file
from sssfit.material import parse_material
from sssfit.profile import Profile, full_kernel
from sssfit.profile.npz import is_profile_file

GONE = object()
HUGE = 10**400


def kernel(name: str, **changes: Any) -> SeparableKernel:
    """A kernel of the folder, some of its fields changed."""
    return dataclasses.replace(world.kernels()[name], **changes)


def profile(name: str, **changes: Any) -> Profile:
    """A profile of the folder, some of its fields changed; ``meta`` is merged."""
    record: Profile = getattr(world, name)()
    if "meta" in changes:
        changes["meta"] = dict(record.meta) | changes["meta"]
    return dataclasses.replace(record, **changes)


def put(array: Any, place: Any, value: float) -> np.ndarray:
    """A copy with another number at a place."""
    changed = np.array(array, dtype=np.float64)
    changed[place] = value
    return changed


def stored(record: Any) -> bytes:
    stream = io.BytesIO()
    record.write(stream)
    return stream.getvalue()


def edited(name: str, place: str, value: Any) -> SeparableKernel:
    """Read a kernel's file with another value at a place, such as "terms.0.sign"."""
    whole = json.loads(stored(world.kernels()[name]))
    *path, last = [int(each) if each.isdigit() else each for each in place.split(".")]
    at = whole
    for each in path:
        at = at[each]
    if value is GONE:
        del at[last]
    else:
        at[last] = value
    return read_kernel(json.dumps(whole))


def read_kernel(content: str | bytes) -> SeparableKernel:
    data = content if isinstance(content, bytes) else content.encode()
    return SeparableKernel.read(io.BytesIO(data), "k.json")


def packed(name: str, **changes: Any) -> bytes:
    """A profile's file, some of its members changed: arrays, or bytes as they are."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(stored(getattr(world, name)()))) as archive:
        members = {each.removesuffix(".npy"): archive.read(each) for each in archive.namelist()}
    for key, value in changes.items():
        if value is GONE:
            del members[key]
        else:
            members[key] = value if isinstance(value, bytes) else _npy(np.asarray(value))
    with zipfile.ZipFile(stream, "w") as archive:
        for key, data in members.items():
            archive.writestr(f"{key}.npy", data)
    return stream.getvalue()


def _npy(array: np.ndarray, version: tuple[int, int] = (1, 0)) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, array, version=version)
    return stream.getvalue()


def read_profile(data: bytes) -> Profile:
    return Profile.read(io.BytesIO(data), "p.npz")


def meta(name: str, **changes: Any) -> str:
    """The JSON of a profile's meta."""
    found = dict(getattr(world, name)().meta) | changes
    return json.dumps({key: value for key, value in found.items() if value is not GONE})


def copied(record: Any) -> Any:
    return pickle.loads(pickle.dumps(record))


def loaded(data: bytes) -> Any:
    return kinds.load(io.BytesIO(data), "f.bin")


NAMES = {
    **{key: value for key, value in globals().items() if callable(value)},
    "npy": _npy,
    "GONE": GONE,
    "HUGE": HUGE,
    "Path": Path,
    "SeparableKernel": SeparableKernel,
    "SssfitError": SssfitError,
    "full_kernel": full_kernel,
    "is_kernel_file": is_kernel_file,
    "is_profile_file": is_profile_file,
    "kinds": kinds,
    "messages": messages,
    "parse_material": parse_material,
    "summary": summary,
    "text": text,
}

_WAX = "kernel('wax.svd2', "
RECORDS = [
    # A kernel's fields.
    *(
        f"{_WAX}{change})"
        for change in (
            *("mm_per_pixel=0.0", "mm_per_pixel=[0.25, 0.5]", "mm_per_pixel='wide'"),
            *("mm_per_pixel=2e12", "method=''", "method='a\\nb'", "method=3"),
            *("channels='RGB'", "channels=('R', 'G')", "channels=('R', 'G', 'R')"),
            *("weights=np.ones((2, 4, 3))", "weights=np.ones((9, 3))", "weights=[[['a']]]"),
            *("signs=np.ones((2, 2))", "signs=[[1, -1, 0.5], [1, 1, 1]]", "scale=[1, 2]"),
            *("scale=[1, -0.5, 2]", "scale=[1, 2, np.nan]", "scale=[1, 2, 2e18]"),
            *("relative_frobenius_error=[0.1, -0.2, 0.3]", "energy_error=[0.1, 0.2, -2e36]"),
            "weights=put(world.kernels()['wax.svd2'].weights, (1, 0, 2), 0.125)",
            "weights=put(world.kernels()['wax.svd2'].weights, (1, 4, 2), 3e18)",
            "weights=1e17 * world.kernels()['wax.svd2'].weights, scale=[2, 3, 1e16]",
            *("parameters=[1]", "parameters={'R': 3}", "parameters={'R': {'weight': [0.5]}}"),
            "parameters={'R': {'variances_mm2': 2.0}}",
            "parameters={'G': {'near_mm2': -0.5}}",
            "parameters={'G': {'weights': [2e18, 1.0]}}",
            "parameters={'G': {'variances_mm2': [1.0, 2.0], 'weights': [0.5]}}",
            *("meta={'material': 'a\\tb'}", "meta={'photons': 'many'}", "meta={'seed': -1}"),
            *("meta={'version': 3}", "meta={'settings': [1]}", "meta={'x': np.inf}"),
            *("meta={'profile_sha256': 5}", "meta={'photons': 2.5}", "meta=3"),
        )
    ),
    *(
        f"[repr({each}), {each}._repr_html_(), copied({each}) is not None]"
        for each in ("kernel('plate.artist')", "kernel('five')", "kernel('grau')")
    ),
    "copied(kernel('leaf.burley'))",
    "[kernel('plate.artist').line, kernel('wax.svd2').quadrant(1), kernel('wax.svd2').full(2)]",
    "kernel('vier.gaussians4').figures()",
    "kernel('plate.artist').plot(world.plate())",
    "kernel('grau').plot()",
    # A kernel's file.
    *(
        f"edited('wax.svd2', '{place}', {value})"
        for place, value in (
            *(("format", "'sssfit.kernel/2'"), ("format", "'other/1'"), ("format", "GONE")),
            *(("format", "3"), ("method", "3"), ("method", "'a\\nb'"), ("method", "GONE")),
            *(("mm_per_pixel", "0"), ("mm_per_pixel", "'1'"), ("mm_per_pixel", "True")),
            *(("mm_per_pixel", "HUGE"), ("mm_per_pixel", "None"), ("mm_per_pixel", "-0.25")),
            *(("channels", "[]"), ("channels", "['R', 'R', 'B']"), ("channels", "'RGB'")),
            *(("channels", "['R', 'a\\x07', 'B']"), ("channels", "['R', 'G', 'B', 'D']")),
            *(("errors.energy", "[0.1, 0.2]"), ("errors.energy", "GONE"), ("errors", "3")),
            *(("errors.relative_frobenius", "[0.1, -0.2, None]"), ("rank", "3"), ("rank", "0")),
            *(("pixels", "7"), ("pixels", "8"), ("support_mm", "1.25"), ("energy.1", "0.5")),
            *(("energy", "[1]"), ("scale", "[1, 2]"), ("scale.2", "-1"), ("terms", "[]")),
            *(("terms.1.weights", "[[1, 2, 3]] * 7"), ("terms.0.weights.3", "[1, 2]")),
            *(("terms.0.weights.3", "[1, None, 2]"), ("terms.0.sign.1", "2"), ("rank", "2.5")),
            *(("terms.0.sign", "[1, 1]"), ("terms.1.sign.2", "True"), ("terms.0", "7")),
            *(("colour", "1"), ("meta.photons", "'many'"), ("meta.seed", "HUGE")),
            *(("meta.material", "'a\\nb'"), ("parameters", "[]"), ("meta", "None")),
            *(("terms.1.weights.8.2", "1e19"), ("terms.1.weights.8.2", "0.375")),
        )
    ),
    *(
        f"read_kernel({content!r})"
        for content in (
            '{"format": "sssfit.kernel/1", "rank": 1, "rank": 1}',
            '{"format": "sssfit.kernel/1", "rank": NaN}',
            '{"format": "sssfit.kernel/1", "rank": -Infinity}',
            *('{"format": "sssfit.kernel/1"', "[1, 2]", '"sssfit"', "", "null", "wax"),
            b'{"format": "sssfit.kernel/1", "method": "gr\xfcn"}',
        )
    ),
    "[is_kernel_file(Path(each)) for each in ('five.kernel.json', 'foreign.json', 'wax.toml')]",
    "[is_profile_file(Path(each)) for each in ('mono.profile.npz', 'foreign.npz', 'wax.toml')]",
    # A profile's fields.
    *(
        f"profile('plate', {change})"
        for change in (
            *("annulus_energy=[1.0, 2.0]", "annulus_energy='x'", "r_edges_mm=[0, 1, 2]"),
            *("r_edges_mm=world.plate().r_edges_mm[::-1]", "r_edges_mm=None"),
            "r_edges_mm=0.25 + world.plate().r_edges_mm",
            "r_edges_mm=1e13 * world.plate().r_edges_mm",
            "r_edges_mm=put(world.plate().r_edges_mm, 5, 0.8000000005)",
            "r_edges_mm=put(world.plate().r_edges_mm, 5, np.inf)",
            *(
                "beyond_grid=[0.1, 0.2]",
                "beyond_grid=[0.1, np.nan, 0.2]",
                "unfinished=[0, 0, 2e12]",
            ),
            "beyond_grid_stderr=[0.1, -0.25, np.nan]",
            "annulus_energy_stderr=put(world.plate().annulus_energy_stderr, (7, 1), 2e12)",
            "absorbed=np.ones((2, 4))",
            "annulus_transmittance=None",
            "annulus_transmittance=None, beyond_grid_transmittance=None",
            *("specular_reflectance=1.5", "specular_reflectance=-0.25", "specular_reflectance=[1]"),
            *("meta={'format': 'x'}", "meta={'channels': ['B', 'G']}", "meta={'channels': 'BGR'}"),
            *("meta={'channels': ['B', 'G', 'B']}", "meta={'channels': ['B', 'G', 'X']}"),
            *("meta={'relative_error': -1}", "meta={'relative_error': True}"),
            *("meta={'energy_balance_stderr': [0.1]}", "meta={'energy_balance_stderr': 0.1}"),
            *("meta={'material': 3}", "meta={'material': {'name': 'x'}}"),
            *("meta={'material_sha256': 'ab'}", "meta={'photons': -5}", "meta={'seed': 'x'}"),
            *("meta={'method': ''}", "meta={'version': ['1']}", "meta={'settings': 3}"),
            "meta={'source': 'a\\nb'}",
        )
    ),
    *(
        f"[repr({each}), {each}._repr_html_(), {each}.label, {each}.material_name]"
        for each in (
            *("profile('wax')", "profile('four')", "profile('mono')"),
            "profile('mono', meta={'material': {'name': 'putty', 'source': 'a\\nshop'}})",
        )
    ),
    "profile('mono', meta={'material': {'name': 'putty', 'source': 'a\\nshop'}}).to_dict()",
    "profile('four').to_dict()",
    "copied(profile('leaf'))",
    "[profile('wax').cumulative, profile('wax').cumulative_stderr]",
    "[profile('leaf').cumulative_stderr, profile('four').cumulative_stderr]",
    "profile('four', meta={'photons': 1}).cumulative_stderr",
    "[profile('plate').reflectance_per_mm2, profile('plate').reflectance_per_mm2_stderr]",
    "[profile('four').cumulative_at([0.05, 0.3, 2.9, 7.0]), profile('mono').cumulative_at(0.7)]",
    "profile('four').cumulative_at([0.1, -0.2])",
    "profile('four').flat_annuli()",
    "[profile('four').line_kernel(0.7, 3), profile('mono').line_kernel(0.9)]",
    "[profile('four').quadrant_kernel(0.7, 2), profile('wax').quadrant_kernel(0.3, 3, channel=1)]",
    "full_kernel(profile('wax').quadrant_kernel(0.3, 2, channel=2))",
    "profile('wax').quadrant_kernel(0.3, 3, channel=3)",
    *(
        f"profile('wax').{each}"
        for each in (
            *("line_kernel(-0.5)", "line_kernel(0.5, -2)", "line_kernel('x')"),
            *("line_kernel(0.5, 1.5)", "quadrant_kernel(1e-9)", "quadrant_kernel(1e-4, 3 * 10**4)"),
            *("line_kernel(1e-300)", "line_kernel(np.inf)"),
        )
    ),
    "[profile(each).energy_radii_mm([0.25, 0.9, 1.0]) for each in ('wax', 'four')]",
    "profile('wax').energy_radii_mm([0.5, 1.5])",
    "[profile(each).transmittance for each in ('plate', 'wax')]",
    "[profile(each).transmittance_stderr for each in ('plate', 'wax')]",
    "profile('plate', beyond_grid_transmittance=None, beyond_grid_transmittance_stderr=None)"
    ".transmittance",
    "profile('plate', beyond_grid_transmittance=None).transmittance_stderr",
    "[profile(each).energy_balance for each in ('plate', 'four')]",
    "profile('four').plot()",
    # A profile's file.
    *(
        f"read_profile(packed('mono', {change}))"
        for change in (
            *("meta=GONE", "meta='[]'", "meta='{'", "meta=meta('mono', format='sssfit.profile/3')"),
            *("meta=meta('mono', format='other/3')", "meta=meta('mono', format=GONE)"),
            *("beyond_grid=GONE", "beyond_grid=GONE, absorbed=GONE", "extra=[1.0]"),
            *("unfinished=np.zeros(1, np.float32)", "meta=np.array([1.0, 2.0])"),
            "unfinished=npy(np.zeros(1), (2, 0))",
            "unfinished=npy(np.zeros(1))[:-3]",
            "unfinished=npy(np.zeros(1)) + b'12345678'",
            "unfinished=npy(np.zeros((2, 3)))",
            "meta=meta('mono', channels=['a', 'b'])",
        )
    ),
    "read_profile(b'')",
    "read_profile(b'PK' + bytes(60))",
    "Profile.load('out')",
    "Profile.load('missing.npz')",
    "Profile.load('a\\nb')",
    "SeparableKernel.load('a\\nb')",
    "SeparableKernel.load('out')",
    "kinds.load('a\\nb')",
    "parse_material('x', 'a\\nb')",
    "text.read_text('a\\nb', 'a\\nb', expected='a table', error=SssfitError)",
    # Files of any kind.
    *(
        f"kinds.load({name!r})"
        for name in ("out", "x\0y", "Skin1", "skin3", "foreign.csv", "missing", "wax.toml")
    ),
    "[type(kinds.load(each)).__name__ for each in ('grau.kernel.json', 'mono.profile.npz', 'skin2')]",
    *(f"loaded({data!r})" for data in (b"", b"mine", b"\xff\xfe\0", b'name = "x"\neta = 2\n')),
    # Texts and numbers.
    *(
        f"[each and each.content for each in map(text.decode, {data})]"
        for data in (
            "['a;b'.encode('utf-16-le'), 'a;b'.encode('utf-16-be'), 'a;b'.encode('utf-16')]",
            "[b'\\xef\\xbb\\xbfa\\r\\nb\\rc', b'gr\\xfcn \\x81', b'a\\0b', b'a\\x1a\\x1a', b'ab']",
        )
    ),
    "text.read_text('a\\0b', 'a\\0b', expected='a table', error=SssfitError)",
    "text.read_text('missing.csv', 'missing.csv', expected='a table', error=SssfitError)",
    "text.read_text('out', 'out', expected='a table', error=SssfitError)",
    "text.read_text('rgb8.png', 'rgb8.png', expected='a table', error=SssfitError)",
    "[text.finite_number(each) for each in ('1', '+.5', '1.', '-2e3', '1e400', '1_0', '٣', 'x', '')]",
    "[text.decimal_shifted(*each) for each in (('7.4', -1), ('0e99', 3), ('.3', 1), ('12e-3', -2))]",
    "[text.number('1.5'), text.numbers('1,-2.5'), text.length_mm(' 2.5 cm'), text.length_mm('3um')]",
    "[text.length_mm('.5m'), text.length_mm('auto', 'auto'), text.lengths_mm('1,2,3cm')]",
    "[text.lengths_mm('1mm, 2cm'), text.whole_number('1_000', 1, 5000), text.share('0.5%')]",
    "[text.share('.25'), text.base_colour(' #FA0 '), text.base_colour('.5, 25%')]",
    *(
        f"text.{call}"
        for call in (
            *("number('x')", "number('inf')", "numbers('1,,2')", "length_mm('-1')"),
            *("length_mm('1km')", "length_mm('1e400')", "length_mm('x', 'auto')"),
            *("lengths_mm('1,2cm,3')", "lengths_mm('1cm,2')", "whole_number('2.5', 1, 9)"),
            *("whole_number('0', 1, 2000)", "whole_number('2001', 1, 2000)", "share('0')"),
            *("whole_number('2000', 1, 2000)", "whole_number('1', 1, 2000)", "share('1')"),
            *("share('100%')", "share('x')", "base_colour('#12')", "base_colour('.5,x')"),
            *("lengths_mm('0,1')", "whole_number('x', 2, 7)"),
        )
    ),
    # Words and tables.
    "[messages.shown(each) for each in ('a\\nb', 'x' * 57, 'x' * 58, 'x' * 59, 10**5000, 0.1)]",
    "[messages.shown(np.float64(0.25)), messages.shown(np.eye(2)), messages.printable('a\\x1b\\u200b')]",
    "[messages.did_you_mean(each, ('skin1', 'marble')) for each in ('SKIN', 'Marbel', 'x', '')]",
    "[messages.number(*each) for each in ((0.12345, '.2g'), (None, '.2g'), (np.nan, '.3g|unknown'),"
    " (0.12345, '.2g%'), (1e-9, '.2g%'), (9.9e-10, '.2g%'), (-1e-5, '.1f%'), (-0.25, '+.2g%'))]",
    "[messages.number(*each) for each in ((123.456, '.2g%'), (123.456, '+.2g%'), (0.0, '+.2g%'),"
    " (-1e-12, '.3g%'), (np.inf, '.1f|inf'), (2e-9, '.3g%'), (None, '.2g%|none'))]",
    "messages.table(['a', 'long head'], [['first name', '1'], ['b', '22.5']])",
    "messages.columns('x', ['p', 'q'], ('one', [1.5, None], '.2f'), ('two', None, ''))",
    "messages.filled('{a:.2f} {b} {c[d]:.1g%} {e:s|none}', {'a': 1.255, 'b': [1], 'c': {'d': 0.25},"
    " 'e': None})",
    "[messages.by_channel('abcdef'[:n], [0.1, None, 0.25, 3.0, 4.0, 5.0][:n], '.2g') for n in (1, 4, 5, 6)]",
    "[messages.by_channel(['n' * 30, 'n' * 31], [1, 2], '.1f'), messages.of_material(None)]",
    "[messages.of_material('m' * 30), messages.of_material('m' * 31), messages.of_material('a\\nb')]",
    "messages.html_table('a < b', ['h & i', 'j'], [['<1>', '\"2\"'], ['3', '4']])",
    "messages.report(['{a}', ('b', 'no {b}'), ('c', 'yes {c}')], {'a': 1, 'b': None, 'c': 0})",
    # Pages of what is rarely shown.
    "summary.summary(summary.figures_of(profile('mono', meta={'material': {'name': 'putty',"
    " 'source': 'a shop'}, 'version': None, 'method': None})))",
    "summary.summary(summary.figures_of(profile('wax', annulus_energy=put(world.wax().annulus_energy,"
    " (slice(4, 7), 1), 0.0), annulus_energy_stderr=put(world.wax().annulus_energy_stderr,"
    " (slice(4, 7), 1), 0.0), meta={'energy_balance_stderr': [1e-3, 2e-4, 3e-5]})))",
    "summary.summary(summary.figures_of(parse_material(world.WAX.replace('0.03', '0.0').replace('0.7',"
    " '0.0'), 'w')))",
    "summary.summary(summary.figures_of(parse_material(world.WAX.replace('0.03', '1e-9').replace('0.7',"
    " '1e-9'), 'w')))",
    "summary.summary(summary.figures_of(kernel('wax.svd2', meta={}, parameters={'R':"
    " {'a': [1.5, None], 'b\\n': True, 'c': 'x', 'd': {'e': 1}}})))",
]
