"""A planned grasp as a rerun recording: start, splitting and simulation on one timeline ``step``.

Planning rows are also on the timeline ``iteration``, simulated frames on ``sim_time``. All entities below ``world``
stand in the object frame, which is the world frame of the simulation. Bodies are written once and moved by instance
poses: the first instance is the split grasp, the second, if there is one, the mapped parallel grasp beside it.
"""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from fingersplit.contacts.metrics import available_metrics
from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording import colors
from fingersplit.recording.annotations import annotate
from fingersplit.recording.posing import Poses, hand_links, pose_links
from fingersplit.recording.recording_file import choose_view, grasp_blueprint, recording_file
from fingersplit.recording.replay import ReplayedGrasp
from fingersplit.recording.series import (
    CONE_HEIGHT,
    RecordedFrames,
    planning_indexes,
    record_planning,
    record_simulation,
    simulation_indexes,
)
from fingersplit.recording.shading import ShadedMesh, shade_hand, shade_object
from fingersplit.recording.surroundings import find_surroundings, path_of
from fingersplit.verification import SimulationFrames

with extra("recording"):
    import rerun as rr

__all__ = ["hand_entities", "log_bodies", "write_recording"]

CONTACT_RADIUS = 3e-3
"""[m]"""
POINT_RADIUS = 1.5e-3
"""Of the points of a cloud [m]."""
APPROACH_LENGTH = 0.05
"""Of the arrow along which the palm comes [m]; it ends as far before the middle of the jaws."""


def hand_entities(hand: Hand) -> list[str]:
    """Entity of every link of a hand."""
    return [f"world/hand/{link.name}" for link in hand_links(hand)]


def log_bodies(stream: rr.RecordingStream, model: ObjectModel, hand: Hand, replayed: ReplayedGrasp) -> None:
    """What never changes: meshes, colours and sizes, the parallel grasp, the axes of the palm's start."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _log_mesh(stream, "world/object", shade_object(model.mesh), colors.OBJECT)
    for entity, mesh in zip(hand_entities(hand), shade_hand(hand), strict=True):
        _log_mesh(stream, entity, mesh)
    cone = trimesh.creation.cone(radius=replayed.friction * CONE_HEIGHT, height=CONE_HEIGHT, sections=32)
    cone.vertices[:, 2] -= CONE_HEIGHT  # the tip at the contact, the cone along the inward normal
    cones = rr.Mesh3D(vertex_positions=cone.vertices, triangle_indices=cone.faces, albedo_factor=colors.CONE)
    stream.log("world/contacts/cones", cones, static=True)
    rgb = [colors.rgba(colors.FINGERS[f % len(colors.FINGERS)]) for f in range(len(hand.fingers))]
    for entity, archetype in (
        ("world/contacts", rr.Points3D.from_fields(colors=rgb, radii=CONTACT_RADIUS)),
        ("world/contacts/normals", rr.Arrows3D.from_fields(colors=rgb, radii=CONTACT_RADIUS / 4)),
        ("world/cpo/tangent_steps", rr.Arrows3D.from_fields(colors=colors.STEP, radii=CONTACT_RADIUS / 5)),
        ("world/cpo/reference_points", rr.Points3D.from_fields(colors=colors.REFERENCE, radii=CONTACT_RADIUS / 2)),
        ("world/collision_points", rr.Points3D.from_fields(colors=colors.COLLISION, radii=CONTACT_RADIUS / 2)),
        ("world/forces/split", rr.Arrows3D.from_fields(colors=colors.FORCE, radii=CONTACT_RADIUS / 3)),
        ("world/forces/initial", rr.Arrows3D.from_fields(colors=colors.FORCE, radii=CONTACT_RADIUS / 3)),
    ):
        stream.log(entity, archetype, static=True)
    for metric in available_metrics().values():
        if metric.recorded_states:
            stream.log(f"metrics/{metric.curve}", rr.SeriesPoints(marker_sizes=4.0), static=True)
    _log_parallel_grasp(stream, replayed)
    _log_surroundings(stream, model, replayed)


def _log_surroundings(stream: rr.RecordingStream, model: ObjectModel, replayed: ReplayedGrasp) -> None:
    """Supports, obstacles, surface that must not be touched, and the palm's way in and out."""
    for one in find_surroundings(replayed.scene, model, replayed.rejected_by):
        entity: list[object] = ["world", "scene", one.name]
        color = {"support": colors.SUPPORT, "forbidden": colors.FORBIDDEN}.get(one.kind, colors.OBSTACLE)
        if one.kind == "cloud":
            stream.log(entity, rr.Points3D(one.vertices, colors=color, radii=POINT_RADIUS), static=True)
        else:
            mesh = rr.Mesh3D(vertex_positions=one.vertices, triangle_indices=one.faces, albedo_factor=color)
            stream.log(entity, mesh, static=True)
    if len(replayed.scene.names):
        path = rr.LineStrips3D([path_of(replayed.grasp)], colors=colors.WAY, radii=CONTACT_RADIUS / 5)
        stream.log("world/way", path, static=True)
    if replayed.rejected_by:
        counts = "\n".join(f"- {name}: {count}" for name, count in replayed.rejected_by.items())
        text = rr.TextDocument(f"Candidates rejected by\n\n{counts}", media_type="text/markdown")
        stream.log("rejected", text, static=True)


def _log_mesh(
    stream: rr.RecordingStream, entity: str, mesh: ShadedMesh, color: tuple[int, int, int, int] | None = None
) -> None:
    archetype = rr.Mesh3D(
        vertex_positions=mesh.vertices,
        triangle_indices=mesh.faces,
        vertex_normals=mesh.normals,
        vertex_colors=mesh.colors,
        albedo_factor=color,
    )
    stream.log(entity, archetype, static=True)


def _log_parallel_grasp(stream: rr.RecordingStream, replayed: ReplayedGrasp) -> None:
    """The two jaw contacts that the run began with, the line between them, and the approach."""
    grasp = replayed.grasp.initial.parallel_grasp
    contacts, approach = np.array(grasp.contacts), np.array(grasp.approach)
    points = rr.Points3D(contacts, colors=colors.PARALLEL, radii=CONTACT_RADIUS)
    line = rr.LineStrips3D([contacts], colors=colors.PARALLEL, radii=CONTACT_RADIUS / 5)
    middle = contacts.mean(axis=0)
    arrow = rr.Arrows3D(
        origins=middle - 2 * APPROACH_LENGTH * approach,
        vectors=APPROACH_LENGTH * approach,
        colors=colors.PARALLEL,
        radii=CONTACT_RADIUS / 4,
    )
    for entity, archetype in (("jaws", points), ("jaws/line", line), ("approach", arrow)):
        stream.log(f"world/parallel_grasp/{entity}", archetype, static=True)


STILL = Poses(np.array([[[0.0, 0.0, 0.0, 1.0]]]), np.zeros((1, 1, 3)))
"""An object that stands in its own frame."""


def write_recording(path: Path, replayed: ReplayedGrasp, model: ObjectModel, hand: Hand) -> None:
    """Write a recording.

    Args:
        path: The .rrd file to write.
        replayed: The grasp with its history.
        model: The object.
        hand: The hand.
    """
    split, initial = _frames(replayed.frames, hand), _frames(replayed.initial_frames, hand)
    simulations = [one for one in (split, initial) if one is not None]
    eye, beside = choose_view(model, replayed, simulations, side_by_side=initial is not None)
    title = f"{model.name}, {hand.name} hand, {replayed.grasp.title}"
    trace = replayed.trace
    with recording_file(path, grasp_blueprint(eye, simulated=bool(simulations))) as stream:
        stream.send_recording_name(title)
        log_bodies(stream, model, hand, replayed)
        planned = pose_links(hand, trace.joints, trace.palm_rotations, trace.palm_positions)
        hands, objects = [planned], [STILL]
        if initial is not None:
            hands.append(_rows(planned, np.zeros(len(trace), dtype=np.int64)))
            objects.append(STILL)
        indexes = planning_indexes(np.arange(len(trace)))
        _send_poses(stream, hand_entities(hand), indexes, hands, beside)
        _send_poses(stream, ["world/object"], planning_indexes(np.arange(1)), objects, beside)
        if simulations:
            _record_simulations(stream, hand, split, initial, planned, beside)
        record_planning(stream, trace, model, hand, replayed.friction)
        annotate(stream, title, replayed, split)


def _frames(frames: SimulationFrames | None, hand: Hand) -> RecordedFrames | None:
    return None if frames is None else RecordedFrames(frames, hand)


def _record_simulations(
    stream: rr.RecordingStream,
    hand: Hand,
    split: RecordedFrames | None,
    initial: RecordedFrames | None,
    planned: Poses,
    beside: NDArray[np.float64],
) -> None:
    """Both simulations on the frames of the longer one; a body without a simulation stands still."""
    times = max((one.times for one in (split, initial) if one is not None), key=len)
    first_step = planned.positions.shape[1]
    indexes, hands, objects = simulation_indexes(first_step, times), [], []
    for name, one, offset in (("split", split, np.zeros(3)), ("initial", initial, beside)):
        if one is not None:
            frames = one.rows(len(times))
            hands.append(_rows(one.hand_poses, frames))
            objects.append(_rows(one.object_poses, frames))
            record_simulation(stream, name, one, hand, indexes, frames, offset)
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
