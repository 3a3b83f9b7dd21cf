"""A stored result planned again, so that what a document leaves out can be seen."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fingersplit.errors import ResultError
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
from fingersplit.planning.plan import PlannedGrasp
from fingersplit.planning.planning import plan
from fingersplit.splitting.settings import PlannerSettings

__all__ = ["read_result", "replay"]

SAME = 1e-6
"""Joint angles of the same grasp differ by less [rad]."""


def read_result(path: Path) -> dict[str, Any]:
    """A result document from a file.

    Raises:
        ResultError: The file holds none.
    """
    try:
        document = json.loads(path.read_text())
        document["hand"], document["object"]["id"], document["grasps"]
    except (ValueError, TypeError, KeyError) as error:
        raise ResultError(
            f"{path} is no result document; give what `fingersplit plan --json` or the service wrote."
        ) from error
    return dict(document)


def replay(
    document: dict[str, Any], rank: int, model: ObjectModel, hand: Hand, settings: PlannerSettings, friction: float
) -> PlannedGrasp:
    """Split the fingers again from the parallel grasp that a stored grasp came from.

    Args:
        document: A result document.
        rank: Rank of the grasp, from 1.
        model: The object it was planned for.
        hand: The hand it was planned for.
        settings: The settings it was planned with; documents do not hold them.
        friction: The friction it was planned for.

    Returns:
        The same grasp, with its trace.

    Raises:
        ResultError: No such rank, another object, or the grasp does not come out again.
    """
    if document["object"]["id"] != model.id:
        raise ResultError(
            f"The result is for the object {document['object']['id']}, not {model.id}; "
            f"give the file it was planned for, and its unit."
        )
    stored = next((grasp for grasp in document["grasps"] if grasp["rank"] == rank), None)
    if stored is None:
        raise ResultError(f"The result has no grasp of rank {rank}; it has {len(document['grasps'])}.")
    parallel_grasp = ParallelGrasp.from_document(stored["initial"]["parallel_grasp"])
    joints = np.array([stored["joints"][name] for name in hand.joint_names])
    for grasp in plan(model, hand, [parallel_grasp], starts=2, top_k=2, settings=settings, friction=friction).grasps:
        if np.abs(grasp.run.final.joints - joints).max() < SAME:
            return replace(grasp, rank=rank)
    raise ResultError(
        f"Rank {rank} does not come out again with these settings and this version; give the settings that it was "
        f"planned with."
    )
