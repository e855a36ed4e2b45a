"""Linear algebra that reductions need beyond SciPy; it knows only arrays."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
