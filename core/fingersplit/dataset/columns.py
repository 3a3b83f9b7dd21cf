"""The schema of a shard: what is kept of every grasp, as arrays of one row a grasp."""

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.result.grasp import GraspResult, PalmPose
from fingersplit.result.plan import PlanResult

__all__ = ["COLUMNS", "Column", "cause_of", "grasp_id", "metric_names", "rows_of"]

TEXT = "text"
NAN3, NAN4 = (math.nan,) * 3, (math.nan,) * 4
NOT_VERIFIED = -1

Value = Callable[[GraspResult, Hand, PlanResult], Any]


@dataclass(frozen=True)
class Column:
    """One array of a shard.

    Attributes:
        name: Of the HDF5 data set below ``grasps``.
        kind: ``f8``, ``i4``, ``i1``, ``?`` or ``text``.
        shape: Of one row; J joints, F fingers, M metrics.
        unit: Unit, empty for none.
        meaning: What it says.
        value: What it is of a grasp.
    """

    name: str
    kind: str
    shape: str
    unit: str
    meaning: str
    value: Value


def grasp_id(grasp: GraspResult, result: PlanResult) -> str:
    """16 hex digits that stand for object, hand, palm pose and joints."""
    numbers = np.array([*grasp.palm.position, *grasp.palm.wxyz, *grasp.joints.values()])
    text = f"{result.object.id} {result.provenance.hand_sha256}".encode()
    return hashlib.sha256(text + numbers.tobytes()).hexdigest()[:16]


def cause_of(grasp: GraspResult) -> str:
    """Why a grasp is no good one: ``held``, the simulation's reason, ``infeasible: ...`` or ``not verified``."""
    if not grasp.feasible:
        return f"infeasible: {grasp.violations[0].rstrip('.')}" if grasp.violations else "infeasible"
    return "not verified" if grasp.verification is None else grasp.verification.reason


def metric_names(result: PlanResult) -> list[str]:
    """Names of the metrics in the order of their column."""
    return sorted(result.grasps[0].metrics) if result.grasps else []


def rows_of(column: Column, result: PlanResult, hand: Hand) -> NDArray[Any]:
    """A column of all grasps of a result, of its shape also where there are none."""
    values = [column.value(grasp, hand, result) for grasp in result.grasps]
    if column.kind == TEXT:
        return np.array(values, dtype=object)
    sizes = {"J": len(hand.joint_names), "F": len(hand.fingers), "M": len(metric_names(result))}
    shape = tuple(sizes[part] if part in sizes else int(part) for part in column.shape.split(",") if part)
    return np.array(values, dtype=column.kind).reshape(len(values), *shape)


def _joints(joints: dict[str, float] | None, hand: Hand) -> list[float]:
    return [math.nan if joints is None else joints[name] for name in hand.joint_names]


def _before(grasp: GraspResult) -> PalmPose | None:
    return None if grasp.pregrasp is None else grasp.pregrasp.palm


def _metrics(grasp: GraspResult, _hand: Hand, result: PlanResult) -> list[float]:
    values = (grasp.metrics[name] for name in metric_names(result))
    return [math.nan if value is None else value for value in values]


def _held(grasp: GraspResult, _hand: Hand, _result: PlanResult) -> int:
    return NOT_VERIFIED if grasp.verification is None else int(grasp.verification.passed)


def _moved(name: str) -> Value:
    """Slip or turn of the verification."""

    def value(grasp: GraspResult, _hand: Hand, _result: PlanResult) -> float:
        moved = None if grasp.verification is None else getattr(grasp.verification, name)
        return math.nan if moved is None else float(moved)

    return value


def _contacts(name: str) -> Value:
    def value(grasp: GraspResult, _hand: Hand, _result: PlanResult) -> list[Any]:
        return [NAN3 if one is None else one for one in (getattr(contact, name) for contact in grasp.contacts)]

    return value


def _p_hold(grasp: GraspResult, _hand: Hand, _result: PlanResult) -> float:
    """Of a grasp whose robustness was estimated."""
    estimated = getattr(grasp, "p_hold", None)
    value = getattr(estimated, "value", estimated)
    return math.nan if value is None else float(value)


COLUMNS = (
    Column("id", TEXT, "", "", "Stands for object, hand, palm pose and joints", lambda g, _h, r: grasp_id(g, r)),
    Column("rank", "i4", "", "", "Place in the ranking of its round, 1 is best", lambda g, _h, _r: g.rank),
    Column("feasible", "?", "", "", "Whether every constraint holds", lambda g, _h, _r: g.feasible),
    Column("held", "i1", "", "", "Simulation: 1 held, 0 did not, -1 not simulated", _held),
    Column("cause", TEXT, "", "", "held, why not, or infeasible and the constraint", lambda g, _h, _r: cause_of(g)),
    Column("termination", TEXT, "", "", "Why the search ended", lambda g, _h, _r: g.termination.label),
    Column("palm_position", "f8", "3", "m", "Palm in the object frame", lambda g, _h, _r: g.palm.position),
    Column("palm_wxyz", "f8", "4", "", "Rotation from palm to object frame", lambda g, _h, _r: g.palm.wxyz),
    Column("joints", "f8", "J", "rad", "Joint angles of the grasp", lambda g, h, _r: _joints(g.joints, h)),
    Column(
        "pregrasp_position",
        "f8",
        "3",
        "m",
        "Palm where the approach begins, object frame; NaN without a free way in",
        lambda g, _h, _r: NAN3 if (palm := _before(g)) is None else palm.position,
    ),
    Column(
        "pregrasp_wxyz",
        "f8",
        "4",
        "",
        "Its rotation; NaN without a free way in",
        lambda g, _h, _r: NAN4 if (palm := _before(g)) is None else palm.wxyz,
    ),
    Column(
        "pregrasp_joints",
        "f8",
        "J",
        "rad",
        "Joint angles during the approach; NaN without a free way in",
        lambda g, h, _r: _joints(None if g.pregrasp is None else g.pregrasp.joints, h),
    ),
    Column(
        "squeeze_joints",
        "f8",
        "J",
        "rad",
        "Targets of position servos that press the pads on",
        lambda g, h, _r: _joints(g.squeeze_joints, h),
    ),
    Column("contact_position", "f8", "F,3", "m", "Contact on the surface, object frame", _contacts("position")),
    Column("contact_normal", "f8", "F,3", "", "Surface normal there, out of the object", _contacts("normal")),
    Column("contact_fingertip", "f8", "F,3", "m", "Point of the pad that faces the contact", _contacts("fingertip")),
    Column("contact_force", "f8", "F,3", "N", "Force that carries the weight; NaN where none can", _contacts("force")),
    Column("contact_residual", "f8", "F", "m", "How far the pad is from just touching", _contacts("residual")),
    Column("contact_pad_angle", "f8", "F", "rad", "Pad normal against inward surface normal", _contacts("pad_angle")),
    Column("metrics", "f8", "M", "", "Metrics in the order of the attribute metric_names", _metrics),
    Column("p_hold", "f8", "", "", "Estimated probability to hold; NaN where not estimated", _p_hold),
    Column("slip", "f8", "", "m", "Farthest that the object moved in the hand; NaN if not simulated", _moved("slip")),
    Column("turn", "f8", "", "rad", "Most that it turned in the hand; NaN if not simulated", _moved("turn")),
    Column(
        "start_contacts",
        "f8",
        "2,3",
        "m",
        "Parallel grasp that the search started from, object frame",
        lambda g, _h, _r: g.initial.parallel_grasp.contacts,
    ),
    Column(
        "start_approach",
        "f8",
        "3",
        "",
        "Its direction of approach",
        lambda g, _h, _r: g.initial.parallel_grasp.approach,
    ),
    Column(
        "clearance",
        "f8",
        "",
        "m",
        "Distance of the hand to what stands around; NaN where nothing is near",
        lambda g, _h, _r: math.nan if g.clearance is None else g.clearance.distance,
    ),
)
"""Every array below ``grasps``, beside ``selected``, which says which grasps count."""
