"""Data sets read back: shards as arrays, also while others are being written."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.dataset.folder import DatasetFolder
from fingersplit.dataset.request import SPLITS, DatasetObject, DatasetRequest
from fingersplit.errors import DatasetError
from fingersplit.extras import extra

__all__ = ["Dataset", "Shard", "poses", "read_shard"]

JSON = {"object": ("options", "report"), "planner": ("settings", "constraints"), "protocol": ("parameters",)}
"""Attributes that hold JSON."""


@dataclass(frozen=True, eq=False)
class Shard:
    """The grasps of one round.

    Attributes:
        path: The file.
        attributes: What stands at its root: seed, split, licence and counts among it.
        object, hand, planner, protocol: What its groups say.
        scene: What the result said of the scene; None without one.
        columns: Arrays of one row a grasp, by their names in ``columns.COLUMNS``, and ``selected``.
        metric_names: Names of the metrics, in the order of their array.
    """

    path: Path
    attributes: dict[str, Any]
    object: dict[str, Any]
    hand: dict[str, Any]
    planner: dict[str, Any]
    protocol: dict[str, Any]
    scene: dict[str, Any] | None
    columns: dict[str, NDArray[Any]]
    metric_names: tuple[str, ...]

    def __len__(self) -> int:
        """Number of grasps, whatever became of them."""
        return len(self.columns["id"])

    @property
    def good(self) -> NDArray[np.bool_]:
        """Grasps that held; where none was simulated, the feasible ones."""
        verified = self.columns["held"] >= 0
        return self.columns["held"] == 1 if verified.any() else self.columns["feasible"]

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Grasps of which is known whether they are good: all but feasible ones that were not simulated."""
        verified = self.columns["held"] >= 0
        return verified | ~self.columns["feasible"] if verified.any() else np.ones(len(self), dtype=bool)

    @property
    def object_from_palm(self) -> NDArray[np.float64]:
        """Poses of the palm, (n, 4, 4)."""
        return poses(self.columns["palm_position"], self.columns["palm_wxyz"])


def poses(positions: NDArray[np.float64], wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transforms (n, 4, 4) of positions (n, 3) and quaternions (n, 4)."""
    from scipy.spatial.transform import Rotation

    matrices = np.tile(np.eye(4), (len(positions), 1, 1))
    if len(positions):
        matrices[:, :3, :3] = Rotation.from_quat(wxyz, scalar_first=True).as_matrix()
        matrices[:, :3, 3] = positions
    return matrices


class Dataset:
    """A data set on disk, complete or not.

    Args:
        path: Its folder.

    Raises:
        DatasetError: It holds no data set of this version.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        folder = DatasetFolder(path)
        self.request: DatasetRequest = folder.request()
        self.objects: list[DatasetObject] = folder.objects()
        self._folder = folder

    def failures(self) -> dict[int, dict[str, Any]]:
        """Objects that have too few grasps, or none: code and message by index."""
        return self._folder.failures()

    def shards(self, split: str | None = None) -> Iterator[Shard]:
        """Every shard that is there now, by object and round.

        Args:
            split: Only those of ``train``, ``validation`` or ``test``.

        Raises:
            DatasetError: No such split, or a damaged shard.
        """
        if split is not None and split not in SPLITS:
            raise DatasetError(f"There is no split {split!r}; splits are {', '.join(SPLITS)}.")
        for item in self.objects:
            if split in (None, item.split):
                yield from self.of(item)

    def of(self, item: DatasetObject) -> Iterator[Shard]:
        """The shards of an object, by round."""
        for path in sorted((self.path / item.split).glob(f"{item.label}.*.h5")):
            yield read_shard(path)

    def joined(self, item: DatasetObject) -> Shard | None:
        """All grasps of an object as if they were of one round; None where there is no shard."""
        found = list(self.of(item))
        if not found:
            return None
        first = max(found, key=len)  # its metrics have names
        rows = [shard for shard in found if len(shard)] or found[:1]
        columns = {name: np.concatenate([shard.columns[name] for shard in rows]) for name in first.columns}
        return Shard(
            first.path,
            first.attributes,
            first.object,
            first.hand,
            first.planner,
            first.protocol,
            first.scene,
            columns,
            first.metric_names,
        )


def read_shard(path: Path) -> Shard:
    """A shard as arrays.

    Raises:
        DatasetError: It is damaged.
    """
    with extra("formats"):
        import h5py
    try:
        with h5py.File(path, "r") as file:
            groups = {name: _attributes(file[name], JSON.get(name, ())) for name in (*JSON, "hand")}
            return Shard(
                path=path,
                attributes=_attributes(file, ("terminations",)),
                scene=json.loads(file["scene"].attrs["summary"]),
                columns={name: _array(rows) for name, rows in file["grasps"].items()},
                metric_names=tuple(map(str, file["grasps"].attrs["metric_names"])),
                **groups,
            )
    except (OSError, KeyError, ValueError) as error:
        raise DatasetError(f"{path} is damaged; delete it, and its round is planned again.") from error


def _array(rows: Any) -> NDArray[Any]:
    return np.asarray(rows.asstr()[()] if rows.dtype.kind == "O" else rows[()])


def _attributes(group: Any, parsed: tuple[str, ...]) -> dict[str, Any]:
    found = dict[str, Any]()
    for name, value in group.attrs.items():
        if name in parsed:
            found[name] = json.loads(value)
        elif isinstance(value, np.ndarray):
            found[name] = value.tolist()
        else:
            found[name] = value.item() if isinstance(value, np.generic) else value
    return found
