"""Array and tuple types that every module shares."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]
Vector = tuple[float, float, float]  # one vector's x, y, z
