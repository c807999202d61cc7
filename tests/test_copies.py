"""Copies of records, and records sent to other processes, cannot be written to either."""

import copy
import dataclasses
import pickle
from collections.abc import Mapping

import numpy as np
import pytest
from reference_pixels import one_over_r_profile

from sssfit.fit import fit_svd
from sssfit.fit.disk import fit_disk
from sssfit.formats.pictures import Image
from sssfit.material import load_material
from sssfit.measure.score import measure
from sssfit.scene.made import make_scene
from sssfit.scene.mesh import Mesh
from sssfit.stability.curve import Curve

PROFILE = one_over_r_profile(40, 0.1, [0.5, 1.0])
FACES = np.array([[0, 1, 2]])
CORNERS = [[0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.7]]
RECORDS = {
    "layer": lambda: load_material("skin1").layers[0],
    "material": lambda: load_material("skin1"),
    "profile": lambda: PROFILE,
    "fit": lambda: fit_svd(PROFILE, rank=2, mm_per_pixel=0.3),
    "taps": lambda: fit_disk(PROFILE, taps=8, mm_per_pixel=0.3).kernel,
    "scene": lambda: make_scene("head", height=24, width=16, mm_per_pixel=9.0),
    "image": lambda: Image(np.ones((2, 2, 3)), ("R", "G", "B"), alpha=np.ones((2, 2))),
    "mesh": lambda: Mesh("one", CORNERS, np.eye(3)[:, :2], FACES, 1.0 + np.eye(3)),
    "score": lambda: measure(np.ones((16, 16, 3)), np.ones((16, 16, 3))),
    "curve": lambda: Curve("of noise", [1.0, 2.0], [0.1, 0.2]),
}


def arrays_of(value, path=""):
    """All arrays of a record with their places in it."""
    if isinstance(value, np.ndarray):
        return {path: value}
    if dataclasses.is_dataclass(value):
        parts = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
    elif isinstance(value, Mapping):
        parts = value
    else:
        parts = dict(enumerate(value)) if isinstance(value, tuple) else {}
    return {
        k: v for key, each in parts.items() for k, v in arrays_of(each, f"{path}.{key}").items()
    }


@pytest.mark.parametrize("name", ["scene", "image", "mesh"])
def test_records_of_pictures_say_in_a_line_what_they_are(name):
    said = repr(RECORDS[name]())
    expected = {
        "scene": "<Scene head: 16 x 24 pixels of 9 mm, 1 channel, with depth, mask, specular>",
        "image": "<Image '': 2 x 2 pixels, channels 'R, G, B'>",
        "mesh": "<Mesh 'one': 1 triangle in 1 x 1 x 0.7 mm>",
    }
    assert said == expected[name]


@pytest.mark.parametrize("name", RECORDS)
def test_copies_are_the_same_and_as_fixed(name):
    record = RECORDS[name]()
    originals = arrays_of(record)
    assert originals
    twins = copy.copy(record), copy.deepcopy(record), pickle.loads(pickle.dumps(record))
    for found in (originals, *map(arrays_of, twins)):
        assert found.keys() == originals.keys()
        for path, each in found.items():
            assert each.tobytes() == originals[path].tobytes(), path
            assert not each.flags.writeable, path
