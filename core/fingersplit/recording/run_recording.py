"""A planned grasp as a rerun recording: start, splitting and lift on one timeline ``step``.

Planning rows are also on the timeline ``iteration``, simulated frames on ``sim_time``. All entities below ``world``
stand in the object frame, which is the world frame of the simulation. Bodies are written once and moved by instance
poses: the first instance is the split grasp, the second, if there is one, the mapped parallel grasp beside it.
"""

from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.plan import PlannedGrasp
from fingersplit.recording.blueprint import choose_view, grasp_blueprint
from fingersplit.recording.bodies import hand_entities, log_bodies
from fingersplit.recording.lift_rows import Lift, lift_indexes, record_lift
from fingersplit.recording.planning_rows import planning_indexes, record_planning
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.recording.story import log_story
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.verification import Verification

__all__ = ["APPLICATION", "record_run", "write_recording"]

APPLICATION = "fingersplit"

Poses = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Rotations (T, B, 3, 3) and positions (T, B, 3) [m] of B bodies."""


def record_run(
    path: Path, model: ObjectModel, hand: Hand, grasp: PlannedGrasp, initial_verification: Verification | None = None
) -> None:
    """Write the recording of a grasp that was just planned, with the simulation of its verification if it has one.

    Args:
        path: The .rrd file to write.
        model: The object.
        hand: The hand.
        grasp: The grasp.
        initial_verification: Verification of the mapped parallel grasp, shown beside it; by default the grasp's own.
    """
    write_recording(path, model, hand, RecordedRun.from_planned(grasp, hand, initial_verification))


def write_recording(
    path: Path, model: ObjectModel, hand: Hand, run: RecordedRun, friction: float | None = None
) -> None:
    """Write a recording.

    Args:
        path: The .rrd file to write.
        model: The object.
        hand: The hand.
        run: What is told.
        friction: Coulomb friction coefficient of the planner; None for its default.
    """
    friction = PlannerSettings().friction if friction is None else friction
    lift = None if run.simulation is None else Lift(run.simulation, hand)
    initial = None if run.initial_simulation is None else Lift(run.initial_simulation, hand)
    lifts = [one for one in (lift, initial) if one is not None]
    eye, beside = choose_view(model, run, lifts, side_by_side=initial is not None)
    stream = rr.RecordingStream(APPLICATION)
    stream.save(path, default_blueprint=grasp_blueprint(eye, lifted=bool(lifts)))
    try:
        title = f"{model.name}, {hand.name} hand, {run.title}"
        stream.send_recording_name(title)
        log_bodies(stream, model, hand, run, friction)
        planned = record_planning(stream, run.trace, model, hand, friction)
        still = np.eye(3)[None, None], np.zeros((1, 1, 3))
        first_step = len(run.trace)
        hands, objects = [planned], [still]
        if initial is not None:
            hands.append((np.repeat(planned[0][:1], first_step, axis=0), np.repeat(planned[1][:1], first_step, axis=0)))
            objects.append(still)
        indexes = planning_indexes(np.arange(first_step))
        _send_poses(stream, hand_entities(hand), indexes, hands, beside)
        _send_poses(stream, ["world/object"], planning_indexes(np.arange(1)), objects, beside)
        if lifts:
            _record_lifts(stream, hand, lift, initial, planned, first_step, beside)
        log_story(stream, title, run, lift)
        stream.flush()
    finally:
        stream.disconnect()


def _record_lifts(
    stream: rr.RecordingStream,
    hand: Hand,
    lift: Lift | None,
    initial: Lift | None,
    planned: Poses,
    first_step: int,
    beside: NDArray[np.float64],
) -> None:
    """Both lifts on the frames of the longer one; a body without a simulation stands still."""
    times = max((one.times for one in (lift, initial) if one is not None), key=len)
    indexes, hands, objects = lift_indexes(first_step, times), [], []
    for name, one, offset in (("split", lift, np.zeros(3)), ("initial", initial, beside)):
        if one is not None:
            frames = one.rows(len(times))
            hands.append((one.shape_rotations[frames], one.shape_positions[frames]))
            objects.append((one.object_rotations[frames, None], one.object_positions[frames, None]))
            record_lift(stream, name, one, hand, indexes, frames, offset)
        elif name == "split":
            rotations, positions = (np.repeat(part[-1:], len(times), axis=0) for part in planned)
            hands.append((rotations, positions))
            objects.append((np.tile(np.eye(3), (len(times), 1, 1, 1)), np.zeros((len(times), 1, 3))))
    _send_poses(stream, hand_entities(hand), indexes, hands, beside)
    _send_poses(stream, ["world/object"], indexes, objects, beside)


def _send_poses(
    stream: rr.RecordingStream,
    entities: list[str],
    indexes: list[rr.TimeColumn],
    scenes: list[Poses],
    beside: NDArray[np.float64],
) -> None:
    """Instance poses of bodies: one instance for each scene, every further scene moved by ``beside`` (3,) [m]."""
    rotations = np.stack([scene[0] for scene in scenes], axis=2)  # (T, B, S, 3, 3)
    positions = np.stack([scene[1] + i * beside for i, scene in enumerate(scenes)], axis=2)  # (T, B, S, 3)
    xyzw = Rotation.from_matrix(rotations.reshape(-1, 3, 3)).as_quat().reshape(*positions.shape[:3], 4)
    counts = [len(scenes)] * len(positions)
    for body, entity in enumerate(entities):
        columns = rr.InstancePoses3D.columns(
            translations=positions[:, body].reshape(-1, 3), quaternions=xyzw[:, body].reshape(-1, 4)
        )
        stream.send_columns(entity, indexes, columns.partition(counts))
