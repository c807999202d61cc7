"""What every fit method makes, as passes on a software driver against the renderer."""

import warnings

import numpy as np
import pytest
from shader_runs import run
from test_shaders import RUN, apart

from sssfit.errors import SssfitWarning
from sssfit.export import kernel_text
from sssfit.fit import fit_result
from sssfit.fit.on_taps import on_taps
from sssfit.kernel import Taps
from sssfit.material import load_material
from sssfit.methods import FITS
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_dipole

PITCH = 0.6
QUICK = {
    "cascade": {"stages": "1-1|2"},
    "gaussian-chain": {"blur": "published"},
    "rotated": {"directions": 2, "taps": 5},
}


@pytest.fixture(scope="module")
def skin1():
    return simulate_dipole(load_material("skin1"))


@pytest.mark.parametrize("method", list(FITS))
def test_every_method_runs_in_every_dialect(skin1, method):
    with warnings.catch_warnings():  # of misfits, which do not matter here
        warnings.simplefilter("ignore", SssfitWarning)
        kernel = fit_result(skin1, method, mm_per_pixel=PITCH, **QUICK.get(method, {})).kernel
    taps = kernel if isinstance(kernel, Taps) else on_taps(kernel, 9)
    light = np.random.default_rng(1).random((37, 50, 3))
    wanted = render_taps(Scene("light", light, PITCH), taps, border="clamp")
    for dialect in RUN:
        text, _ = kernel_text(taps, dialect)
        found = run(text, dialect, taps, light, PITCH, normalized=True)
        assert apart(found * taps.energy, wanted) < 1e-5, dialect
