"""Draw docs/layers.png and write the table of docs/layers.md: errors and seconds of ten stacks.

python docs/make_layers.py

Errors are the largest |F - F_36| at an annulus edge, as a share of the light that leaves; F_36 has 36
directions. Seconds are processor time of one channel.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from sssfit.grid import make_grid
from sssfit.material import Layer, Material
from sssfit.process import one_blas_thread
from sssfit.simulate.stack.sampling import Family, Sampler
from sssfit.simulate.stack.slabs import stacks_of
from sssfit.simulate.stack.solution import solved_with

DOCS = Path(__file__).parent
COUNTS = (8, 12, 16, 20, 24, 28)
FINEST = 36
