"""What never changes in a recording: meshes, colours and sizes, and the parallel grasp that it began with."""

import numpy as np
import trimesh

from fingersplit.contacts.metrics import available_metrics
from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording import colors
from fingersplit.recording.planning_rows import CONE_HEIGHT
from fingersplit.recording.posing import hand_links
from fingersplit.recording.replay import ReplayedGrasp
from fingersplit.recording.shading import ShadedMesh, shade_hand, shade_object

with extra("recording"):
    import rerun as rr

__all__ = ["hand_entities", "log_bodies"]

CONTACT_RADIUS = 3e-3
"""[m]"""
APPROACH_LENGTH = 0.05
"""Of the arrow along which the palm comes [m]; it ends as far before the middle of the jaws."""


def hand_entities(hand: Hand) -> list[str]:
    """Entity of every link of a hand."""
    return [f"world/hand/{link.name}" for link in hand_links(hand)]


def log_bodies(stream: rr.RecordingStream, model: ObjectModel, hand: Hand, replayed: ReplayedGrasp) -> None:
    """What never changes: meshes, colours and sizes, the parallel grasp, the axes of the palm's start."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    _log_mesh(stream, "world/object", shade_object(model.mesh), colors.OBJECT)
    for entity, link, mesh in zip(hand_entities(hand), hand_links(hand), shade_hand(hand), strict=True):
        _log_mesh(stream, entity, mesh, colors.PALM if link.finger < 0 else colors.LINK)
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


def _log_mesh(stream: rr.RecordingStream, entity: str, mesh: ShadedMesh, color: tuple[int, int, int, int]) -> None:
    archetype = rr.Mesh3D(
        vertex_positions=mesh.vertices,
        triangle_indices=mesh.faces,
        vertex_normals=mesh.normals,
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
