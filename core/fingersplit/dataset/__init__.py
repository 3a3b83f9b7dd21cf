"""Data sets: many grasps of many objects in shards that can be read while more are written."""

from fingersplit.dataset.order import DatasetOrder, find_objects
from fingersplit.dataset.reading import Dataset, Shard
from fingersplit.dataset.running import make_dataset

__all__ = ["Dataset", "DatasetOrder", "Shard", "find_objects", "make_dataset"]
