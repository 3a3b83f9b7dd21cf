"""Shards: one HDF5 file for each round of an object, which appears whole or not at all."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.dataset.columns import COLUMNS, TEXT, metric_names, rows_of
from fingersplit.dataset.request import SCHEMA, SCHEMA_VERSION, DatasetObject, DatasetRequest
from fingersplit.errors import DatasetError
from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.result.plan import PlanResult
from fingersplit.result.wire import to_dict

__all__ = ["PART", "ShardHead", "read_head", "selection", "shard_path", "write_shard"]

PART = ".part"
"""Ending of a shard that is being written."""


@dataclass(frozen=True)
class ShardHead:
    """What a shard says of itself without its arrays.

    Attributes:
        path: The file.
        index: The object's place in the order.
        round: Number of the round, from 0.
        rows: Grasps in it.
        feasible: Feasible ones.
        verified: Simulated ones.
        held: Ones that held.
        selected: Ones that count.
        started: Starts that were run.
    """

    path: Path
    index: int
    round: int
    rows: int
    feasible: int
    verified: int
    held: int
    selected: int
    started: int


def shard_path(folder: Path, item: DatasetObject, number: int) -> Path:
    """Where the shard of a round is."""
    return folder / item.split / f"{item.label}.{number:04d}.h5"


def selection(result: PlanResult, verified: bool, missing: int) -> NDArray[np.bool_]:
    """Which grasps of a round count: the first ``missing`` that held, or that are feasible where none is verified."""
    good = [
        grasp.verification is not None and grasp.verification.passed if verified else grasp.feasible
        for grasp in result.grasps
    ]
    counted = np.array(good, dtype=bool)
    return counted & (np.cumsum(counted) <= missing)


def write_shard(
    path: Path,
    item: DatasetObject,
    request: DatasetRequest,
    number: int,
    chosen: NDArray[np.bool_],
    result: PlanResult,
    hand: Hand,
) -> None:
    """Write the grasps of a round; another process sees the whole file or none.

    Args:
        path: From ``shard_path``.
        item: The object.
        request: The order.
        number: Number of the round.
        chosen: Which grasps count, from ``selection``.
        result: The round.
        hand: The hand with the fingers that grasp.
    """
    with extra("formats"):
        import h5py
    part = path.with_name(f"{path.name}.{os.getpid()}{PART}")
    with h5py.File(part, "w") as file:
        file.attrs.update(_root(item, request, number, result, int(chosen.sum())))
        _write_about(file, result, hand)
        grasps = file.create_group("grasps")
        grasps.attrs["metric_names"] = metric_names(result)
        _write(grasps, "selected", chosen, "", "Whether it is one of the grasps that were asked for")
        for column in COLUMNS:
            rows = rows_of(column, result, hand)
            _write(grasps, column.name, rows, column.unit, column.meaning, column.kind == TEXT)
    with part.open("rb") as stream:
        os.fsync(stream.fileno())
    part.replace(path)


def read_head(path: Path) -> ShardHead:
    """What a shard says of itself.

    Raises:
        DatasetError: The file is no shard of this version.
    """
    with extra("formats"):
        import h5py
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("schema") != SCHEMA or file.attrs.get("schema_version") != SCHEMA_VERSION:
                raise DatasetError(f"{path} is no shard of schema {SCHEMA} {SCHEMA_VERSION}.")
            names = ("object_index", "round", "rows", "feasible", "verified", "held", "selected", "started")
            return ShardHead(path, *(int(file.attrs[name]) for name in names))
    except (OSError, KeyError) as error:
        raise DatasetError(f"{path} is damaged; delete it, and its round is planned again.") from error


def _root(
    item: DatasetObject, request: DatasetRequest, number: int, result: PlanResult, selected: int
) -> dict[str, Any]:
    verdicts = [one.verification.passed for one in result.grasps if one.verification is not None]
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "generator": f"fingersplit {result.provenance.software_version}",
        "licence": request.licence,
        "split": item.split,
        "object_index": item.index,
        "object_file": item.file,
        "object_file_sha256": item.sha256,
        "round": number,
        "seed": result.seed,
        "rows": len(result.grasps),
        "feasible": sum(grasp.feasible for grasp in result.grasps),
        "verified": len(verdicts),
        "held": sum(verdicts),
        "selected": selected,
        "started": result.summary.started,
        "terminations": json.dumps(result.summary.terminations),
        "message": result.summary.message,
        "units": "m, rad, kg, N, s",
        "quaternions": "wxyz, from the palm frame to the object frame",
        "frames": "object frame: that of the object's file, in metres; surface normals point out of the object",
    }


def _write_about(file: Any, result: PlanResult, hand: Hand) -> None:
    """Groups without arrays of grasps: object, hand, planner, protocol, scene."""
    planned = result.object
    file.create_group("object").attrs.update(
        {
            "name": planned.name,
            "id": planned.id,
            "unit": planned.source.unit,
            "scale": planned.source.scale,
            "extents": planned.extents,
            "volume": planned.volume,
            "mass": planned.mass,
            "mass_basis": planned.mass_basis,
            "center_of_mass": planned.center_of_mass,
            "inertia": np.array(planned.inertia),
            "friction": result.friction,
            "options": json.dumps(planned.options.to_document()),
            "report": json.dumps(None if planned.report is None else to_dict(planned.report)),
        }
    )
    links = hand.model.links
    tool = hand.gripper
    file.create_group("hand").attrs.update(
        {
            "name": result.hand,
            "description_sha256": result.provenance.hand_sha256,
            "palm_frame": hand.palm,
            "joint_names": list(hand.joint_names),
            "finger_names": [finger.name for finger in hand.fingers],
            "contact_links": [links[pad.link].name for pad in hand.pads],
            "palm_from_jaws": np.asarray(tool.palm_from_gripper),
            "jaws": "columns: closing axis x, y, approach z of the parallel gripper that the hand imitates",
        }
    )
    file.create_group("planner").attrs.update(
        {
            "settings": json.dumps(result.provenance.planner),
            "source": result.provenance.parallel_grasps,
            "starts": result.starts,
            "top_k": result.provenance.top_k,
            "constraints": json.dumps(result.provenance.constraints),
        }
    )
    summary = result.summary.verification
    reports = [grasp.verification for grasp in result.grasps if grasp.verification is not None]
    file.create_group("protocol").attrs.update(
        {
            "name": "" if summary is None else summary.protocol,
            "controller": "" if summary is None else summary.controller,
            "parameters": json.dumps(reports[0].settings if reports else None),
            "simulator": reports[0].simulator if reports else "",
        }
    )
    file.create_group("scene").attrs["summary"] = json.dumps(None if result.scene is None else to_dict(result.scene))


def _write(group: Any, name: str, rows: NDArray[Any], unit: str, meaning: str, text: bool = False) -> None:
    with extra("formats"):
        import h5py
    kind = h5py.string_dtype() if text else rows.dtype
    packed = {} if text or rows.size == 0 else {"compression": "gzip", "shuffle": True}
    dataset = group.create_dataset(name, data=rows, dtype=kind, **packed)
    dataset.attrs.update({"unit": unit, "meaning": meaning})
