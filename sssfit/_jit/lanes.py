"""How the photons of a walk lie side by side: blocks of rows with an entry for each lane."""

import numpy as np
import numpy.typing as npt

LANES = 256  # 128 to 1024 took the same time; fewer waste less at the end of a batch
GENERATOR_ROWS = 4  # of words, which a lane's generator takes
# Rows of the layered walk are 64 bytes further apart than a power of two, or the same lane of every
# row would fall into the same set of the cache.
STRIDE = LANES + 16

# Rows of the layered walk's blocks: of lanes (``layered_lanes``), of slots (``layered_slots``) and
# of what ``layered_tally.book_channels`` keeps
FLOAT_ROWS, WORD_ROWS = 18, GENERATOR_ROWS + 2
SLOT_ROWS, SLOT_WORD_ROWS = 13, GENERATOR_ROWS + 2
SCRATCH_ROWS = 6
SUMS = 4  # sums of absorption that take turns: each addition waits for the one before it

LaneFloats = npt.NDArray[np.float32]
LaneWords = npt.NDArray[np.uint32]
Flags = npt.NDArray[np.uint8]
Indices = npt.NDArray[np.uint64]
