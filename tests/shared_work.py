"""Work that tests share: exact solutions, lit heads, fits of candidates, and the sizes of texts.

So are the taps that are fitted for engines.

All depend on their arguments alone and cannot be changed. What one worker made, the others read
from a folder of this run, which no other run reads: nothing of older sources can pass a test.

Long searches of cascades are shared as well, in the files of LONG_SEARCHES.

The tests of the solver and of the head compute them themselves, as do those that count threads or
interrupt a run, and whatever runs within ``alone``.
"""

import contextlib
import dataclasses
import functools
import hashlib
import json
import os
import pickle
from collections.abc import Mapping
from pathlib import Path
from types import NoneType

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import RendererAgg

import sssfit.choose.options
import sssfit.compare.candidates
import sssfit.export.presets.separable_fit
import sssfit.fit._spectrum
import sssfit.fit.cascade
import sssfit.scene.head
import sssfit.simulate.half_space
import sssfit.simulate.stack
from sssfit.fit._chain import Chain

OWN = {
    *("test_deterministic", "test_exact", "test_head", "test_head_through", "test_interrupts"),
    *("test_layered_materials", "test_memory_order", "test_processes", "test_runner"),
    *("test_slabs", "test_stack", "test_stack_walk", "test_sweep", "test_sweep_cluster"),
}
_OWN_FITS = {"test_approved"}  # its clock counts how often it is asked, fits included
# What these ask is how good a cascade is. The others, approvals among them, fit dozens, and one
# descent, few frequencies and short descents will do for them: a fifth of the time.
LONG_SEARCHES = {
    *("test_borders_page", "test_cascade", "test_disks_page", "test_distance", "test_docs"),
    *(
        "test_docs_tables",
        "test_engines",
        "test_frames",
        "test_motion",
        "test_on_taps",
        "test_readme_figures",
        "test_shading",
        "test_stability_seeds",
    ),
}
# These ask what is done with cascades, of which they fit dozens: any will do.
_HASTY_SEARCHES = {
    *("test_budget", "test_choose", "test_cli_choose", "test_cli_options", "test_pareto"),
    *("test_pareto_chart", "test_records"),
}
# These ask which of two cascades is nearer, or draw lines: far ones, where a descent stops early.
_WHOLE_DESCENTS = {"test_rotated"}
_PLAIN = str | int | float | NoneType  # a setting that is a function, or a scene, is not shared
_TEXT_STYLE = "mathtext.fontset", "text.hinting", "text.hinting_factor", "text.usetex"
_state = {"allowed": True, "fits": True, "short": 0, "folder": None, "begun": False}


def _short_descent(chain, x, most, gain=3e-3, real=sssfit.fit.cascade.descent):
    return real(chain, x, min(most, 20), max(gain, 0.02))


def _hasty_descent(chain, x, most, gain=3e-3, real=sssfit.fit.cascade.descent):
    return real(chain, x, min(most, 6), gain)


SHORT = (
    (sssfit.fit.cascade, "_STARTS", 2),
    (sssfit.fit.cascade, "_KEPT_STARTS", 1),
    (sssfit.fit.cascade, "_HOPS", ()),
    (sssfit.fit.cascade, "descent", _short_descent),
    (sssfit.fit._spectrum, "_FREQUENCIES", 28),
    (sssfit.fit._spectrum, "_SEARCHED", 28),
)
_HASTY = (
    *SHORT,
    (sssfit.fit.cascade, "_SHAPES", 1),
    (sssfit.fit.cascade, "_ROUGH_STEPS", 30),
    (sssfit.fit.cascade, "descent", _hasty_descent),
)
_LONG = tuple((module, name, getattr(module, name)) for module, name, _ in _HASTY)


def allow(file):
    """Share from now on, unless this file of tests computes everything itself."""
    _state["allowed"] = file not in OWN
    _state["fits"] = _state["allowed"] and file not in _OWN_FITS
    short = 0 if file in LONG_SEARCHES else 3 if file in _WHOLE_DESCENTS else len(SHORT)
    short = len(_HASTY) if file in _HASTY_SEARCHES else short
    _state["short"] = short
    for module, name, value in (*_LONG, *_HASTY[:short]):
        setattr(module, name, value)


def keep_in(folder):
    """Share with the other workers of this run, which have the same folder."""
    _state["folder"] = folder


@contextlib.contextmanager
def alone():
    """Compute everything in this block, and keep nothing of it."""
    before = dict(_state)
    _state.update(allowed=False, fits=False)
    try:
        yield
    finally:
        _state.update(before)


def begin():
    """Put what is shared in front of the real functions, unless it is."""
    if _state["begun"]:
        return
    _state["begun"] = True
    solver, head, fits = sssfit.simulate.half_space, sssfit.scene.head, sssfit.compare.candidates
    solver._solve = _solved_once(solver._solve)
    stack = sssfit.simulate.stack
    stack.solve_stacks = _layers_once(stack.solve_stacks)
    head.head_scene = _lit_once(head.head_scene)
    fits.fit_separable = _fitted_once(fits.fit_separable)
    fits.fit_taps = _fitted_once(fits.fit_taps)
    sssfit.choose.options.fit_result = _fitted_once(sssfit.choose.options.fit_result)
    engines = sssfit.export.presets.separable_fit  # whose callers are imported after this
    engines.fit_separable = _matched_once(engines.fit_separable)
    sssfit.fit.cascade.searched = _searched_once(sssfit.fit.cascade.searched)
    RendererAgg.get_text_width_height_descent = _measured_once(
        RendererAgg.get_text_width_height_descent
    )


def _once(known, key, make):
    """What was made for a key, here or by another worker of this run; made, if it was not."""
    if key not in known:
        known[key] = _read(key) or make()
        _keep(key, known[key])
    return known[key]


def _path(key):
    return Path(_state["folder"]) / hashlib.sha256(repr(key).encode()).hexdigest()


def _read(key):
    if _state["folder"] is None or not _path(key).exists():
        return None
    main, *buffers = pickle.loads(_path(key).read_bytes())
    # Arrays on bytes can only be read, as they could before.
    return pickle.loads(main, buffers=[bytes(each) if fixed else bytearray(each)
                                       for fixed, each in buffers])  # fmt: skip


def _keep(key, made):
    if _state["folder"] is None or _path(key).exists():
        return
    buffers = []
    main = pickle.dumps(made, protocol=5, buffer_callback=buffers.append)
    views = [each.raw() for each in buffers]
    aside = _path(key).with_suffix(f".{os.getpid()}")
    aside.write_bytes(pickle.dumps([main, *((each.readonly, bytes(each)) for each in views)]))
    aside.replace(_path(key))


def _solved_once(real):
    known = {}

    @functools.wraps(real)
    def solve(eta, channels, level, workers):
        if not _state["allowed"] or workers.stop is not None:
            return real(eta, channels, level, workers)
        own = [(float(each.albedo), each.radii_mfp.tobytes()) for each in channels]
        key = "exact", float(eta), level, tuple(own)
        return list(_once(known, key, lambda: real(eta, channels, level, workers)))

    return solve


def _layers_once(real):
    """A plate takes 13 s, and charts, choices, budgets and comparisons of it all need it."""
    known = {}

    @functools.wraps(real)
    def solve_stacks(materials, grids, tolerance, pool, threads, *, reduced=None, stop=None):
        def solve():
            return real(materials, grids, tolerance, pool, threads, reduced=reduced, stop=stop)

        if not materials or not _state["allowed"] or (stop is not None and stop()):
            return solve()
        given = pickle.dumps((list(materials), list(grids), list(reduced or ())))
        return list(_once(known, ("layers", tolerance, given), solve))

    return solve_stacks


def _lit_once(real):
    known = {}

    @functools.wraps(real)
    def head_scene(**given):
        key = tuple(sorted((name, value) for name, value in given.items() if name != "threads"))
        if not _state["allowed"] or not all(isinstance(each, int | float) for _, each in key):
            return real(**given)
        return _once(known, ("head", *key), lambda: real(**given))

    return head_scene


def _fitted_once(real):
    """Comparisons and choices fit the same candidates to the same few profiles."""
    known = {}

    @functools.wraps(real)
    def fit(profile, method, **settings):
        values = settings.values()
        if not _state["fits"] or not all(isinstance(each, _PLAIN) for each in values):
            return real(profile, method, **settings)
        key = contents(profile), method, _state["short"], *sorted(settings.items())
        return _once(known, (real.__name__, *key), lambda: real(profile, method, **settings))

    return fit


def _matched_once(real):
    """The taps of an engine take .8 s, and a dozen files make the presets of skin1."""
    known = {}

    @functools.wraps(real)
    def fit_separable(source, taps):
        if not _state["fits"]:
            return real(source, taps)
        key = "engine", contents(source.profile), taps
        return _once(known, key, lambda: real(source, taps))

    return fit_separable


def _searched_once(real):
    """A cascade takes up to 2.4 s, and four files of tests look at the same two."""
    known = {}

    @functools.wraps(real)
    def searched(few, many, seed, starts=(), *, effort=1):
        if not _state["fits"] or _state["short"] or not isinstance(many, Chain):
            return real(few, many, seed, starts, effort=effort)
        targets = (each for of in (few, many) for each in dataclasses.astuple(of.target))
        given = [each.tobytes() if isinstance(each, np.ndarray) else each for each in targets]
        given += [each.tobytes() for each in starts]
        key = "search", type(many), many.shapes, many.aliasing, *given, seed, effort
        x, count = _once(known, key, lambda: real(few, many, seed, starts, effort=effort))
        return x.copy(), count

    return searched


def _measured_once(real):
    """Matplotlib measures "0.1" again for every figure; of a chart's layout that is a third."""
    known = {}

    @functools.wraps(real)
    def measure(self, text, font, ismath):
        style = tuple(mpl.rcParams[name] for name in _TEXT_STYLE)
        key = text, tuple(vars(font).values()), ismath, self.dpi, style
        if key not in known:
            known[key] = real(self, text, font, ismath)
        return known[key]

    return measure


def contents(profile):
    """Everything in a profile, provenance included: a kernel takes over some of it."""
    fields = [getattr(profile, each.name) for each in dataclasses.fields(profile)]
    return tuple(
        each.tobytes() if isinstance(each, np.ndarray)
        else json.dumps(dict(each), sort_keys=True) if isinstance(each, Mapping)
        else each
        for each in fields
    )  # fmt: skip
