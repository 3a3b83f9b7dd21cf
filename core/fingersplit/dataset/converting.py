"""From a data set to the layout of another one."""

from pathlib import Path

import numpy as np

from fingersplit.dataset.layouts import available_layouts
from fingersplit.dataset.layouts.layout import ConvertedObject, Layout
from fingersplit.dataset.reading import Dataset, Shard
from fingersplit.dataset.request import SPLITS, DatasetObject
from fingersplit.errors import FormatError, OutputError, suggestion

__all__ = ["convert"]


def convert(dataset: Dataset, layout: str, folder: Path) -> str:
    """Write the grasps of a data set in a layout of ``available_layouts``, with a list of objects for each split.

    Only grasps that were asked for go out; where the layout has a place for their outcome, all that were judged.

    Args:
        dataset: The data set.
        layout: Name of the layout.
        folder: New or empty folder to write to.

    Returns:
        What was written, in a sentence.

    Raises:
        FormatError: Unknown layout.
        OutputError: The folder is not empty, or cannot be made.
    """
    layouts = available_layouts()
    if layout not in layouts:
        raise FormatError(f"Unknown layout {layout!r}; {suggestion(layout, layouts)}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder} cannot be made: {error.strerror}.") from error
    if any(folder.iterdir()):
        raise OutputError(f"{folder} is not empty; give a new folder.")
    grasps, names = 0, {split: list[str]() for split in SPLITS}
    for item in dataset.objects:
        shard = dataset.joined(item)
        made = None if shard is None else _converted(item, shard, layouts[layout])
        if made is not None and len(made.rows):
            layouts[layout].write(folder, made)
            names[item.split].append(item.label)
            grasps += len(made.rows)
    for split, labels in names.items():
        (folder / f"{split}.txt").write_text("".join(f"{label}\n" for label in labels))
    return f"{layouts[layout].title}: {grasps} grasps of {sum(map(len, names.values()))} objects."


def _converted(item: DatasetObject, shard: Shard, layout: Layout) -> ConvertedObject:
    columns = shard.columns
    chosen = columns["selected"] | (shard.judged if layout.failures else False)
    if layout.free_way:
        chosen = chosen & np.isfinite(columns["pregrasp_position"]).all(axis=1)
    rows = np.flatnonzero(chosen)
    return ConvertedObject(item, shard, rows, shard.good[rows])
