"""Arrays as the functions written in Python take them. Those of `_core` check what they take themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

FloatArray: TypeAlias = NDArray[np.float32]
"""float32 array; shapes are in the docstrings."""

Scalar = TypeVar("Scalar", np.float32, np.float64, np.int32)


def real_array(name: str, values: ArrayLike, dtype: type[Scalar]) -> NDArray[Scalar]:
    """Return values as an array of ``dtype``, without a copy if they are one.

    Raises
    ------
    TypeError
        For values other than real numbers: complex ones, text, objects; and for floats where ``dtype`` is an
        integer. It calls the values by ``name``.
    """
    array: NDArray[Any] = np.asarray(values)
    kinds = "biuf" if np.issubdtype(dtype, np.floating) or array.size == 0 else "biu"
    if array.dtype.kind not in kinds:
        expected = "real numbers" if "f" in kinds else "integers"
        raise TypeError(f"{name} has the dtype {array.dtype}, expected {expected}")
    return array.astype(dtype, copy=False)
