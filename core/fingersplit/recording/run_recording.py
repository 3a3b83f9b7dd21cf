"""A planned grasp as a rerun recording: start, splitting and lift on one timeline ``step``.

Planning rows are also on the timeline ``iteration``, simulated frames on ``sim_time``. All entities below ``world``
stand in the object frame, which is the world frame of the simulation. Bodies are written once and moved by instance
poses: the first instance is the split grasp, the second, if there is one, the mapped parallel grasp beside it.
"""

from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from fingersplit.contacts.friction import planned_friction
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.plan import PlannedGrasp
from fingersplit.recording.blueprint import choose_view, grasp_blueprint
from fingersplit.recording.bodies import hand_entities, log_bodies
from fingersplit.recording.lift_rows import Lift, lift_indexes, record_lift
from fingersplit.recording.planning_rows import planning_indexes, record_planning
from fingersplit.recording.posing import Poses, pose_links
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.recording.story import log_story
from fingersplit.recording.stream import recording_file
from fingersplit.verification import Verification

__all__ = ["record_run", "write_recording"]

STILL = Poses(np.array([[[0.0, 0.0, 0.0, 1.0]]]), np.zeros((1, 1, 3)))
"""An object that stands in its own frame."""


def record_run(
    path: Path,
    model: ObjectModel,
    hand: Hand,
    grasp: PlannedGrasp,
    initial_verification: Verification | None = None,
    friction: float | None = None,
) -> None:
    """Write the recording of a grasp that was just planned, with the simulation of its verification if it has one.

    Args:
        path: The .rrd file to write.
        model: The object.
        hand: The hand.
        grasp: The grasp.
        initial_verification: Verification of the mapped parallel grasp, shown beside it; by default the grasp's own.
        friction: As for ``write_recording``.
    """
    write_recording(path, model, hand, RecordedRun.from_planned(grasp, hand, initial_verification), friction)


def write_recording(
    path: Path, model: ObjectModel, hand: Hand, run: RecordedRun, friction: float | None = None
) -> None:
    """Write a recording.

    Args:
        path: The .rrd file to write.
        model: The object.
        hand: The hand.
        run: What is told.
        friction: Coulomb friction coefficient that was planned for; None as for ``plan``.
    """
    friction = planned_friction(friction, model.options.friction)
    lift = None if run.simulation is None else Lift(run.simulation, hand)
    initial = None if run.initial_simulation is None else Lift(run.initial_simulation, hand)
    lifts = [one for one in (lift, initial) if one is not None]
    eye, beside = choose_view(model, run, lifts, side_by_side=initial is not None)
    title = f"{model.name}, {hand.name} hand, {run.title}"
    with recording_file(path, grasp_blueprint(eye, lifted=bool(lifts))) as stream:
        stream.send_recording_name(title)
        log_bodies(stream, model, hand, run, friction)
        planned = pose_links(hand, run.trace.joints, run.trace.palm_rotations, run.trace.palm_positions)
        hands, objects = [planned], [STILL]
        if initial is not None:
            hands.append(_rows(planned, np.zeros(len(run.trace), dtype=np.int64)))
            objects.append(STILL)
        indexes = planning_indexes(np.arange(len(run.trace)))
        _send_poses(stream, hand_entities(hand), indexes, hands, beside)
        _send_poses(stream, ["world/object"], planning_indexes(np.arange(1)), objects, beside)
        if lifts:
            _record_lifts(stream, hand, lift, initial, planned, beside)
        record_planning(stream, run.trace, model, hand, friction)
        log_story(stream, title, run, lift)


def _record_lifts(
    stream: rr.RecordingStream,
    hand: Hand,
    lift: Lift | None,
    initial: Lift | None,
    planned: Poses,
    beside: NDArray[np.float64],
) -> None:
    """Both lifts on the frames of the longer one; a body without a simulation stands still."""
    times = max((one.times for one in (lift, initial) if one is not None), key=len)
    first_step = planned.positions.shape[1]
    indexes, hands, objects = lift_indexes(first_step, times), [], []
    for name, one, offset in (("split", lift, np.zeros(3)), ("initial", initial, beside)):
        if one is not None:
            frames = one.rows(len(times))
            hands.append(_rows(one.hand_poses, frames))
            objects.append(_rows(one.object_poses, frames))
            record_lift(stream, name, one, hand, indexes, frames, offset)
        elif name == "split":
            hands.append(_rows(planned, np.full(len(times), first_step - 1)))
            objects.append(_rows(STILL, np.zeros(len(times), dtype=np.int64)))
    _send_poses(stream, hand_entities(hand), indexes, hands, beside)
    _send_poses(stream, ["world/object"], indexes, objects, beside)


def _rows(poses: Poses, rows: NDArray[np.int64]) -> Poses:
    return Poses(poses.xyzw[:, rows], poses.positions[:, rows])


def _send_poses(
    stream: rr.RecordingStream,
    entities: list[str],
    indexes: list[rr.TimeColumn],
    scenes: list[Poses],
    beside: NDArray[np.float64],
) -> None:
    """Instance poses of bodies: one instance for each scene, every further scene moved by ``beside`` (3,) [m]."""
    positions = np.stack([scene.positions + i * beside for i, scene in enumerate(scenes)], axis=2)  # (B, T, S, 3)
    quaternions = np.stack([scene.xyzw for scene in scenes], axis=2)  # (B, T, S, 4)
    for entity, places, turns in zip(entities, positions, quaternions, strict=True):
        columns = rr.InstancePoses3D.columns(translations=places, quaternions=turns)
        stream.send_columns(entity, indexes, columns)
