"""A planned grasp as a rerun recording: start, splitting and lift on one timeline ``step``.

Planning rows are also on the timeline ``iteration``, simulated frames on ``sim_time``. All entities below ``world``
stand in the object frame, which is the world frame of the simulation. Bodies are written once and moved by instance
poses: the first instance is the split grasp, the second, if there is one, the mapped parallel grasp beside it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.plan import PlannedGrasp
from fingersplit.recording import colors
from fingersplit.recording.blueprint import Eye, grasp_blueprint
from fingersplit.recording.lift_rows import Lift, lift_indexes, record_lift
from fingersplit.recording.planning_rows import CONE_HEIGHT, planning_indexes, record_planning
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.recording.shading import ShadedMesh, shade_hand, shade_object
from fingersplit.recording.story import log_story
from fingersplit.splitting.settings import PlannerSettings

__all__ = ["APPLICATION", "record_run", "write_recording"]

APPLICATION = "fingersplit"
CONTACT_RADIUS = 3e-3
"""[m]"""
HAND_REACH = 0.2
"""About how far a hand stands out of the object it grasps [m]."""

Poses = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Rotations (T, B, 3, 3) and positions (T, B, 3) [m] of B bodies."""


def record_run(
    path: Path, model: ObjectModel, hand: Hand, grasp: PlannedGrasp, initial_verification: Any = None
) -> None:
    """Write the recording of a grasp that was just planned, with the simulation of its verification if it has one.

    Args:
        path: The .rrd file to write.
        model: The object.
        hand: The hand.
        grasp: The grasp.
        initial_verification: Verification of the mapped parallel grasp by the same protocol, shown beside it.
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
    eye, beside = _view(model, run, lifts, side_by_side=initial is not None)
    stream = rr.RecordingStream(APPLICATION)
    stream.save(path, default_blueprint=grasp_blueprint(eye, lifted=bool(lifts)))
    try:
        title = f"{model.name}, {hand.name} hand, {run.title}"
        stream.send_recording_name(title)
        _log_bodies(stream, model, hand, run, friction)
        planned = record_planning(stream, run.trace, model, hand, friction)
        still = np.eye(3)[None, None], np.zeros((1, 1, 3))
        first_step = len(run.trace)
        hands, objects = [planned], [still]
        if initial is not None:
            hands.append((np.repeat(planned[0][:1], first_step, axis=0), np.repeat(planned[1][:1], first_step, axis=0)))
            objects.append(still)
        indexes = planning_indexes(np.arange(first_step))
        _send_poses(stream, _hand_entities(hand), indexes, hands, beside)
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
    _send_poses(stream, _hand_entities(hand), indexes, hands, beside)
    _send_poses(stream, ["world/object"], indexes, objects, beside)


def _hand_entities(hand: Hand) -> list[str]:
    return [f"world/hand/{name}" for name in hand.shape_names]


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


def _log_bodies(stream: rr.RecordingStream, model: ObjectModel, hand: Hand, run: RecordedRun, friction: float) -> None:
    """What never changes: meshes, colours and sizes, the parallel grasp, the axes of the palm's start."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _log_mesh(stream, "world/object", shade_object(model.mesh), colors.OBJECT)
    for entity, mesh, carrier in zip(
        _hand_entities(hand), shade_hand(hand), hand.arrays.shape_fingers.tolist()[: len(hand.shape_names)], strict=True
    ):
        _log_mesh(stream, entity, mesh, colors.PALM if carrier < 0 else colors.LINK)
    cone = trimesh.creation.cone(radius=friction * CONE_HEIGHT, height=CONE_HEIGHT, sections=32)
    cone.vertices[:, 2] -= CONE_HEIGHT  # the tip at the contact, the cone along the inward normal
    cones = rr.Mesh3D(vertex_positions=cone.vertices, triangle_indices=cone.faces, albedo_factor=colors.CONE)
    stream.log("world/contacts/cones", cones, static=True)
    rgb = [colors.rgba(colors.FINGERS[f % len(colors.FINGERS)]) for f in range(len(hand.fingers))]
    for entity, archetype in (
        ("world/contacts", rr.Points3D.from_fields(colors=rgb, radii=CONTACT_RADIUS)),
        ("world/contacts/normals", rr.Arrows3D.from_fields(colors=rgb, radii=CONTACT_RADIUS / 4)),
        ("world/cpo/tangent_steps", rr.Arrows3D.from_fields(colors=colors.STEP, radii=CONTACT_RADIUS / 5)),
        ("world/cpo/reference_points", rr.Points3D.from_fields(colors=colors.REFERENCE, radii=CONTACT_RADIUS / 2)),
        ("world/collision_points", rr.Points3D.from_fields(colors=colors.HIT, radii=CONTACT_RADIUS / 2)),
        ("world/forces/split", rr.Arrows3D.from_fields(colors=colors.FORCE, radii=CONTACT_RADIUS / 3)),
        ("world/forces/initial", rr.Arrows3D.from_fields(colors=colors.FORCE, radii=CONTACT_RADIUS / 3)),
        ("metrics/ferrari_canny", rr.SeriesPoints(marker_sizes=4.0)),
    ):
        stream.log(entity, archetype, static=True)
    _log_parallel_grasp(stream, run)


def _log_mesh(stream: rr.RecordingStream, entity: str, mesh: ShadedMesh, color: tuple[int, int, int, int]) -> None:
    archetype = rr.Mesh3D(
        vertex_positions=mesh.vertices,
        triangle_indices=mesh.faces,
        vertex_normals=mesh.normals,
        albedo_factor=color,
    )
    stream.log(entity, archetype, static=True)


def _log_parallel_grasp(stream: rr.RecordingStream, run: RecordedRun) -> None:
    """The two jaw contacts that the run began with, the line between them, and the approach."""
    grasp = run.document["initial"]["parallel_grasp"]
    contacts, approach = np.array(grasp["contacts"]), np.array(grasp["approach"])
    points = rr.Points3D(contacts, colors=colors.PARALLEL, radii=CONTACT_RADIUS)
    line = rr.LineStrips3D([contacts], colors=colors.PARALLEL, radii=CONTACT_RADIUS / 5)
    middle = contacts.mean(axis=0)
    arrow = rr.Arrows3D(
        origins=middle - HAND_REACH / 2 * approach,
        vectors=HAND_REACH / 4 * approach,
        colors=colors.PARALLEL,
        radii=CONTACT_RADIUS / 4,
    )
    for entity, archetype in (("jaws", points), ("jaws/line", line), ("approach", arrow)):
        stream.log(f"world/parallel_grasp/{entity}", archetype, static=True)


def _view(model: ObjectModel, run: RecordedRun, lifts: list[Lift], *, side_by_side: bool) -> tuple[Eye, NDArray[Any]]:
    """An eye that sees the fingers from the side, and where a second scene stands."""
    up = np.array([0.0, 0.0, 1.0])
    palm_x = run.trace.palm_rotations[-1][:, 0]  # across the closing direction of the fingers
    towards = palm_x - (palm_x @ up) * up
    if np.linalg.norm(towards) < 0.3:
        towards = np.cross(run.trace.palm_rotations[-1][:, 2], up)
    towards = towards / np.linalg.norm(towards)
    right = np.cross(up, towards)
    radius = model.radius + HAND_REACH
    beside = 1.2 * radius * right
    raised = max((float(np.ptp(lift.object_positions[:, 2])) for lift in lifts), default=0.0)
    middle = (run.trace.palm_positions[-1] + model.center_of_mass) / 2
    target = middle + raised / 2 * up + (beside / 2 if side_by_side else 0)
    distance = 1.3 * radius + 0.9 * raised + (0.4 * radius if side_by_side else 0)
    direction = towards + 0.35 * up + 0.35 * right
    return (target + distance * direction / np.linalg.norm(direction), target), beside
