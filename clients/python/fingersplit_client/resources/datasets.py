"""Data sets: many grasps of many objects, planned by the service's workers."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Generic

from fingersplit_client._exchange import dump, given, parse, quoted
from fingersplit_client._flow import Flow
from fingersplit_client.modes import Mode, operation
from fingersplit_client.resources.resource import Resource
from fingersplit_client.schemas import Dataset, DatasetCreate, DatasetPage, DatasetRound, ObjectInfo

__all__ = ["Datasets"]


class Datasets(Resource[Mode], Generic[Mode]):
    """Many grasps of many objects."""

    @operation
    def create(
        self,
        objects: Sequence[ObjectInfo | str],
        *,
        job: dict[str, Any] | DatasetRound | None = None,
        name: str = "data set",
        per_object: int = 100,
        verified: bool = False,
        max_rounds: int = 50,
        split: tuple[float, float, float] = (0.8, 0.1, 0.1),
        licence: str = "unspecified",
    ) -> Flow[Dataset]:
        """Have rounds planned until every object has as many grasps as wanted, or is given up.

        Args:
            objects: Uploaded objects, or their ids.
            job: What a round plans, as for `Jobs.create` without an object: ``hand``, ``starts``, ``scene``, ...
            name: Name for people.
            per_object: Grasps wanted of each object.
            verified: Count only grasps that held in simulation.
            max_rounds: Rounds after which an object is given up.
            split: Shares of train, validation and test.
            licence: Licence of the data set.
        """
        ids = [one if isinstance(one, str) else one.id for one in objects]
        asked = DatasetCreate(
            objects=ids,
            job=DatasetRound.model_validate(job or {}),
            name=name,
            per_object=per_object,
            verified=verified,
            max_rounds=max_rounds,
            split=split,
            licence=licence,
        )
        return parse(Dataset, (yield from self._exchange("POST", "/v1/datasets", json=dump(asked))))

    @operation
    def get(self, dataset_id: str) -> Flow[Dataset]:
        """How far a data set is."""
        return parse(Dataset, (yield from self._exchange("GET", f"/v1/datasets/{quoted(dataset_id)}")))

    @operation
    def list(self, *, limit: int = 100, cursor: str | None = None) -> Flow[DatasetPage]:
        """A page of the data sets, newest first; ``next_cursor`` of one page is ``cursor`` of the next."""
        params = given(limit=limit, cursor=cursor)
        return parse(DatasetPage, (yield from self._exchange("GET", "/v1/datasets", params=params)))

    @operation
    def cancel(self, dataset_id: str) -> Flow[Dataset]:
        """Begin no more rounds and end those that run; shards that are there stay."""
        return parse(Dataset, (yield from self._exchange("POST", f"/v1/datasets/{quoted(dataset_id)}/cancel")))

    @operation
    def delete(self, dataset_id: str) -> Flow[None]:
        """Delete a data set with the jobs of its rounds."""
        yield from self._exchange("DELETE", f"/v1/datasets/{quoted(dataset_id)}")

    @operation
    def download(self, dataset_id: str, folder: "os.PathLike[str] | str") -> Flow[int]:
        """Bring the shards that are there and not yet in ``folder``; how many were written.

        The folder is a data set like one of ``fingersplit dataset``: it can be read and converted, and further calls
        bring what was planned since.
        """
        place, way = Path(folder), f"/v1/datasets/{quoted(dataset_id)}"
        found = parse(Dataset, (yield from self._exchange("GET", way)))
        manifest = yield from self._exchange("GET", f"{way}/manifest")
        for name in ("train", "validation", "test", "failed"):
            (place / name).mkdir(parents=True, exist_ok=True)
        _write(place / "dataset.json", json.dumps(manifest.json(), indent=2).encode() + b"\n")
        written = 0
        for item in found.items:
            for shard in item.shards:
                if not (place / shard.path).exists():
                    content = yield from self._exchange("GET", f"{way}/shards/{item.index}/{shard.round}")
                    _write(place / shard.path, content.content)
                    written += 1
            if item.error is not None:
                told = {"object": item.name, "file": item.name}
                told |= {"code": item.error.code, "message": item.error.detail}
                _write(place / "failed" / f"{item.index:05d}.json", json.dumps(told, indent=2).encode() + b"\n")
        return written


def _write(path: Path, content: bytes) -> None:
    """Write a file that others see whole or not at all."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_bytes(content)
    part.replace(path)
