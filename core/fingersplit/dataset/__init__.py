"""Data sets: many grasps of many objects in shards that can be read while more are written.

A name loads what it needs when it is first used: what only names a request needs neither planner nor HDF5.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fingersplit.dataset.reading import Dataset, Shard
    from fingersplit.dataset.request import DatasetRequest, find_objects
    from fingersplit.dataset.running import make_dataset

__all__ = ["Dataset", "DatasetRequest", "Shard", "find_objects", "make_dataset"]

_HOME = {
    "Dataset": "reading",
    "DatasetRequest": "request",
    "Shard": "reading",
    "find_objects": "request",
    "make_dataset": "running",
}


def __getattr__(name: str) -> Any:
    """Load a public name on its first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'fingersplit.dataset' has no attribute {name!r}.")
    return getattr(import_module(f"fingersplit.dataset.{_HOME[name]}"), name)
