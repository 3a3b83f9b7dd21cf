"""A clock for compiled code, so that a run can tell where its time went."""

import time

from numba import types

from fingersplit.compilation import kernel

__all__ = ["seconds"]

_CLOCK = int(time.CLOCK_MONOTONIC)
_clock_gettime = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.intp))


@kernel
def seconds(buffer):
    """Monotonic time [s]; ``buffer`` is an int64 array (2,) for the system call. Costs about 25 ns."""
    _clock_gettime(_CLOCK, buffer.ctypes.data)
    return buffer[0] + 1e-9 * buffer[1]
