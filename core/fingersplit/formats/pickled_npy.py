"""The .npy files of grasp datasets hold pickled Python objects; they are read without running what is in them."""

import io
import pickle
from typing import Any

import numpy as np
from numpy.lib import format as npy_format

from fingersplit.errors import FormatError

__all__ = ["dump_npy", "load_npy"]

_HARMLESS = {
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("_codecs", "encode"),
    *(
        (f"numpy.{core}.{module}", name)
        for core in ("core", "_core")
        for module, name in (
            ("multiarray", "_reconstruct"),
            ("multiarray", "scalar"),
            ("numeric", "_frombuffer"),
        )
    ),
}
"""What an array or a number unpickles with; anything else a file asks for is refused."""


def dump_npy(value: Any) -> bytes:
    """What ``np.save`` writes for a dict or a list of dicts."""
    stream = io.BytesIO()
    array = np.empty(() if isinstance(value, dict) else len(value), dtype=object)
    array[...] = value
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def load_npy(data: bytes) -> Any:
    """What such a file holds: an array of numbers, or the dict or list of dicts that was pickled.

    Raises:
        FormatError: No .npy file, a truncated one, or one that holds anything but numbers, texts and their
            collections.
    """
    stream = io.BytesIO(data)
    try:
        version = npy_format.read_magic(stream)
        read_header = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
        shape, _, dtype = read_header(stream)
        if not dtype.hasobject:
            return np.load(io.BytesIO(data), allow_pickle=False)
        array = _Unpickler(stream).load()
    except FormatError:
        raise
    except Exception as error:  # unpickling damaged bytes raises whatever their damage leads to
        raise FormatError("The file is no whole .npy file: its header or what was stored in it is damaged.") from error
    if not isinstance(array, np.ndarray) or array.shape != shape:
        raise FormatError("The .npy file holds something else than its header says.")
    return array.item() if array.ndim == 0 else array.tolist()


class _Unpickler(pickle.Unpickler):
    """Makes arrays, numbers, texts and their collections, and nothing else."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _HARMLESS:
            raise FormatError(
                f"The .npy file asks for {module}.{name} to be run; only numbers, texts and their collections are read."
            )
        return super().find_class(module, name)
