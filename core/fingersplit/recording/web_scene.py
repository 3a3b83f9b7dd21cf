"""A grasp or a hand as one compact JSON document, for a browser to draw and to move.

Meshes are quantised: corners to 16 bits of their box, normals to 8, as base64. Links hang on their parents, so a state
is the palm's pose and the joints' angles. Lengths [m], angles [rad], forces [N], quaternions ``wxyz``, object frame.
"""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingersplit.grasp import HandPose
from fingersplit.hands.hand import Hand
from fingersplit.hands.model import Shape
from fingersplit.hands.shapes import shape_mesh
from fingersplit.hands.shapes_kernel import CONVEX
from fingersplit.objects.model import ObjectModel
from fingersplit.planning.search import Search
from fingersplit.recording import colors
from fingersplit.recording.looks import hand_looks, light_mesh
from fingersplit.recording.replay import ReplayedGrasp
from fingersplit.recording.shading import shaded_corners
from fingersplit.scene.preparing import PreparedScene
from fingersplit.splitting.trace import PHASE_NAMES, QUALITY
from fingersplit.transforms import wxyz_from_rotation
from fingersplit.verification import SimulationFrames

__all__ = ["grasp_scene", "hand_scene", "motion_scene", "starts_scene"]

Array = NDArray[np.float64]

OBJECT_FACES, OBSTACLE_FACES = 10_000, 2_000
"""Most that are sent of the object and of each obstacle."""
STATES, SIMULATED = 160, 250
"""Most states of a search and frames of a simulation that are sent."""
DIGITS = 5
"""Decimals of lengths and angles."""


def hand_scene(hand: Hand) -> dict[str, Any]:
    """A hand on its own: what is drawn, how its drivers move it, and postures to show."""
    coupling = hand.model.coupling
    lateral, _, approach = hand.gripper.palm_from_gripper.T
    return {
        "hand": _hand(hand),
        "lateral": _short(lateral),
        "approach": _short(approach),
        "drivers": [
            {"name": name, "lower": _short(low), "upper": _short(high)}
            for name, low, high in zip(coupling.drivers, coupling.lower, coupling.upper, strict=True)
        ],
        "coupling": {"matrix": _short(coupling.matrix), "offset": _short(coupling.offset)},
        "postures": _postures(hand),
        "pads": [
            {
                "link": pad.link,
                "center": _short(pad.center),
                "radius": _short(pad.radius),
                "color": colors.FINGERS[f % len(colors.FINGERS)],
            }
            for f, pad in enumerate(hand.pads)
        ],
    }


def grasp_scene(replayed: ReplayedGrasp, model: ObjectModel, hand: Hand) -> dict[str, Any]:
    """A grasp with its search: object, hand, contacts, cones, forces, approach, and what stands around."""
    grasp, trace, scene = replayed.grasp, replayed.trace, replayed.scene
    rows = np.unique(np.linspace(0, len(trace) - 1, STATES).round().astype(int))
    given = grasp.initial.parallel_grasp
    pregrasp = grasp.pregrasp_pose(hand)
    return {
        "name": model.name,
        "title": grasp.title,
        "hand": _hand(hand),
        **_object(model, scene),
        "friction": replayed.friction,
        "fingers": [
            {"name": f.name, "color": colors.FINGERS[i % len(colors.FINGERS)]} for i, f in enumerate(hand.fingers)
        ],
        "phase_colors": colors.PHASES,
        "parallel_grasp": {"contacts": _short(given.contacts), "approach": _short(given.approach)},
        "states": {
            "phases": [PHASE_NAMES[phase] for phase in trace.phases[rows].tolist()],
            "quality": [float(f"{value:.5g}") for value in trace.scores[rows, QUALITY].tolist()],
            "palm": [_pose(trace.object_from_palm(row)) for row in rows.tolist()],
            "joints": _short(trace.joints[rows]),
            "contacts": _short(trace.contacts[rows]),
            "normals": _short(trace.normals[rows], 3),
        },
        "assumed": [contact.assumed for contact in grasp.contacts],
        "forces": [None if contact.force is None else _short(contact.force, 3) for contact in grasp.contacts],
        "pregrasp": None if pregrasp is None else _hand_pose(pregrasp),
    }


def starts_scene(found: Search) -> dict[str, Any]:
    """Where each run of a search ended and why: hand, object, surroundings, and a state for every start."""
    scene = found.scene
    return {
        "name": found.model.name,
        "hand": _hand(found.hand),
        **_object(found.model, scene),
        "starts": [
            {
                "end": run.termination.label,
                "feasible": run.feasible,
                "violations": list(run.violations),
                "advice": run.termination.advice,
                "quality": float(f"{float(run.last.quality):.4g}"),
                "palm": _pose(run.final.object_from_palm),
                "joints": _short(run.final.joints),
                "contacts": _short(run.final.contacts),
            }
            for run in found.runs
        ],
    }


def motion_scene(frames: SimulationFrames | None) -> dict[str, Any]:
    """What the simulation that verified a grasp did, up to the first frame that is not finite; nothing without one."""
    if frames is None:
        return {"times": []}
    numbers = (frames.palm_positions, frames.joints, frames.object_positions, frames.contact_forces)
    finite = np.logical_and.reduce([np.isfinite(one).reshape(len(one), -1).all(axis=1) for one in numbers])
    usable = len(finite) if finite.all() else int(finite.argmin())
    rows = np.unique(np.linspace(0, max(usable - 1, 0), SIMULATED).round().astype(int))[:usable]
    return {
        "times": _short(frames.times[rows], 3),
        "closing": min(int(np.searchsorted(rows, frames.closing)), len(rows) - 1),
        "phases": [str(frames.phase_names[phase]) for phase in frames.phases[rows]],
        "palm": _poses(frames.palm_positions[rows], frames.palm_wxyz[rows]),
        "joints": _short(frames.joints[rows], 4),
        "object": _poses(frames.object_positions[rows], frames.object_wxyz[rows]),
        "contacts": _short(frames.contact_positions[rows], 4),
        "forces": _short(frames.contact_forces[rows], 2),
    }


def _object(model: ObjectModel, scene: PreparedScene) -> dict[str, Any]:
    """The object, which way is up, and what stands around."""
    vertices, faces = light_mesh(model.mesh.vertices, np.asarray(model.mesh.faces, np.int64), OBJECT_FACES)
    gravity = scene.object_from_world[:3, :3] @ _unit(np.array(scene.constraints.scene.gravity))
    return {"object": _mesh(vertices, faces), "up": _short(-gravity), "around": _surroundings(scene)}


def _hand(hand: Hand) -> dict[str, Any]:
    model = hand.model
    return {
        "title": hand.title,
        "links": [
            {"name": link.name, "parent": link.parent, "pose": _pose(link.pose), "joints": list(link.joints)}
            for link in model.links
        ],
        "joints": [
            {
                "name": joint.name,
                "axis": _short(joint.axis),
                "anchor": _short(joint.anchor),
                "reference": _short(joint.reference),
            }
            for joint in model.joints
        ],
        "meshes": [
            {"link": look.link, "rgb": look.rgb, **_mesh(look.vertices, look.faces)} for look in hand_looks(hand)
        ],
        "shapes": [
            {
                "link": shape.link,
                "kind": int(shape.kind),
                "pose": _pose(shape.pose),
                **(_mesh(*_solid(shape)) if shape.kind == CONVEX else {"size": _short(shape.size)}),
            }
            for shape in model.shapes
        ],
    }


def _postures(hand: Hand) -> list[dict[str, Any]]:
    """Half-way, and every preshape of every grip, as joint and driver angles."""
    coupling = hand.model.coupling
    half = (coupling.lower + coupling.upper) / 2
    found = [("half-way", hand.model.joints_from_drivers(half), half)]
    places = [hand.joint_names.index(driver) for driver in coupling.drivers]
    for g, grip in enumerate(hand.grips):
        preshapes = enumerate(grip.gripper.preshapes)
        found += [(f"grip {g + 1}, preshape {k + 1}", joints, joints[places]) for k, joints in preshapes]
    return [{"name": name, "joints": _short(joints), "drivers": _short(drivers)} for name, joints, drivers in found]


def _surroundings(scene: PreparedScene) -> list[dict[str, Any]]:
    """Support surfaces and obstacles: primitives, meshes and points, with their poses in the object frame."""
    object_from_world, around = scene.object_from_world, list[dict[str, Any]]()
    for surface in scene.constraints.scene.support_surfaces:
        pose = object_from_world @ surface.scene_from_surface
        around.append({"name": surface.id, "plane": surface.extents, "pose": _pose(pose)})
    for obstacle in scene.constraints.scene.obstacles:
        one: dict[str, Any] = {"name": obstacle.id, "pose": _pose(object_from_world @ obstacle.pose.matrix)}
        if obstacle.primitive is not None:
            one |= {"kind": int(obstacle.primitive.kind), "size": _short(obstacle.primitive.half_sizes)}
        elif obstacle.model is not None:
            mesh = obstacle.model.mesh
            one |= _mesh(*light_mesh(mesh.vertices, np.asarray(mesh.faces, np.int64), OBSTACLE_FACES))
        elif obstacle.points is not None:
            chosen = np.unique(np.linspace(0, len(obstacle.points) - 1, 4_000).round().astype(int))
            one |= _quantised(obstacle.points[chosen])
        around.append(one)
    return around


def _solid(shape: Shape) -> tuple[Array, NDArray[np.int64]]:
    """Corners and triangles of a shape."""
    mesh = shape_mesh(shape.kind, shape.size)
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def _mesh(vertices: Array, faces: NDArray[np.int64]) -> dict[str, Any]:
    """Corners with normals that are smooth except across creases, and triangles."""
    corners, vertex_of, normals = shaded_corners(vertices, faces)
    small = len(vertex_of) <= 0xFFFF
    return _quantised(vertices[vertex_of]) | {
        "normals": _packed(np.round(127 * normals).astype(np.int8)),
        "faces": _packed(corners.astype(np.uint16 if small else np.uint32)),
        "wide": not small,
    }


def _quantised(points: Array) -> dict[str, Any]:
    low, span = points.min(axis=0), float(np.ptp(points, axis=0).max()) or 1.0
    steps = np.round((points - low) / span * 0xFFFF).astype(np.uint16)
    return {"low": _short(low, 6), "span": _short(span, 6), "points": _packed(steps)}


def _packed(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _pose(matrix: Array) -> list[float]:
    """Position and quaternion wxyz, (7,)."""
    return [*_short(matrix[:3, 3]), *_short(wxyz_from_rotation(matrix[:3, :3]), 6)]


def _hand_pose(pose: HandPose) -> dict[str, Any]:
    return {"palm": _pose(pose.object_from_palm), "joints": _short(pose.joints)}


def _poses(positions: Array, wxyz: Array) -> list[list[float]]:
    return [[*_short(position), *_short(turn)] for position, turn in zip(positions, wxyz, strict=True)]


def _unit(vector: Array) -> Array:
    return np.asarray(vector / (float(np.linalg.norm(vector)) or 1.0))


def _short(values: Any, digits: int = DIGITS) -> Any:
    """Plain numbers with few decimals."""
    return np.round(np.asarray(values, dtype=np.float64), digits).tolist()
