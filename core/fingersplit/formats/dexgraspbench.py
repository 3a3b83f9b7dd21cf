"""DexGraspBench samples: one grasp as a pickled dict of hand configurations, read and written."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingersplit.errors import ExchangeError
from fingersplit.formats.pickled_npy import dump_npy, load_npy
from fingersplit.formats.results import Results

__all__ = ["DexGraspBenchSample", "read_dexgraspbench", "write_dexgraspbench"]

_OBJECT_POSE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class DexGraspBenchSample:
    """One grasp; every configuration is position xyz [m], quaternion wxyz, joints [rad] in the MJCF's order, (7 + N,).

    Attributes:
        object_pose: Object in the world, position xyz [m] and quaternion wxyz, (7,).
        object_scale: Factor from the object's mesh to metres.
        object_path: Folder of the object.
        approach: Configurations on the way in, (n, 7 + N), None when there are none.
        pregrasp: Before the fingers close.
        grasp: Fingers on the object.
        squeeze: Where position servos aim to hold it.
        joint_names: Names of the joints, None where the file does not say.
    """

    object_pose: NDArray[np.float64]
    object_scale: float
    object_path: str
    approach: NDArray[np.float64] | None
    pregrasp: NDArray[np.float64]
    grasp: NDArray[np.float64]
    squeeze: NDArray[np.float64]
    joint_names: tuple[str, ...] | None


def write_dexgraspbench(results: Results) -> bytes:
    """The best of the grasps; the object stands in the world's origin, so the world frame is the object frame.

    Where a pre-grasp is known it begins the approach, and the hand opened as for it, but at the grasp's palm, is
    ``pregrasp_qpos``: DexGraspBench moves the palm first and closes then.
    """
    best = results.grasps[0]
    opened = best.grasp.qpos
    if best.pregrasp is not None:
        opened = np.concatenate([best.grasp.qpos[:7], best.pregrasp.joints])
    sample = {
        "obj_pose": np.array(_OBJECT_POSE),
        "obj_scale": 1.0,
        "obj_path": results.object_name,
        "pregrasp_qpos": opened,
        "grasp_qpos": best.grasp.qpos,
        "squeeze_qpos": best.squeeze.qpos,
        "joint_names": list(results.hand.joint_names),
        "fingersplit": results.provenance,
    }
    if best.pregrasp is not None:
        sample["approach_qpos"] = np.stack([best.pregrasp.qpos, opened])
    return dump_npy(sample)


def read_dexgraspbench(data: bytes) -> DexGraspBenchSample:
    """Read a sample.

    Raises:
        ExchangeError: Not such a file, a field is missing, or its numbers have the wrong shape.
    """
    sample = load_npy(data)
    if not isinstance(sample, dict):
        raise ExchangeError(f"A DexGraspBench sample is a dict, this file holds {type(sample).__name__}.")
    missing = [key for key in ("obj_pose", "obj_scale", "obj_path", "grasp_qpos") if key not in sample]
    if missing:
        raise ExchangeError(f"The DexGraspBench sample has no {missing[0]!r}; found: {', '.join(map(str, sample))}.")
    grasp = _numbers(sample["grasp_qpos"], "grasp_qpos", None)
    approach = sample.get("approach_qpos")
    names = sample.get("joint_names")
    return DexGraspBenchSample(
        object_pose=_numbers(sample["obj_pose"], "obj_pose", 7),
        object_scale=float(_numbers([sample["obj_scale"]], "obj_scale", 1)[0]),
        object_path=str(sample["obj_path"]),
        approach=None if approach is None else np.stack([_numbers(q, "approach_qpos", len(grasp)) for q in approach]),
        pregrasp=_numbers(sample.get("pregrasp_qpos", grasp), "pregrasp_qpos", len(grasp)),
        grasp=grasp,
        squeeze=_numbers(sample.get("squeeze_qpos", grasp), "squeeze_qpos", len(grasp)),
        joint_names=None if names is None else tuple(str(name) for name in names),
    )


def _numbers(value: ArrayLike, name: str, size: int | None) -> NDArray[np.float64]:
    """A row of finite numbers (size,), at least a pose when ``size`` is None."""
    try:
        row = np.array(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError) as error:
        raise ExchangeError(f"{name} of the DexGraspBench sample is no row of numbers: {error}.") from error
    if (len(row) < 7 if size is None else len(row) != size) or not np.isfinite(row).all():
        wanted = "at least 7" if size is None else str(size)
        raise ExchangeError(f"{name} of the DexGraspBench sample needs {wanted} finite numbers, got {len(row)}.")
    return row
