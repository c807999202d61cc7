"""What holds for every test process."""

import os

# As the command line has it, and before numpy is imported: with OpenBLAS's own threads the exact
# solver's tests took eight times as long in two processes on two busy cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
