"""MJCF or URDF to links, joints and solids: compiled by MuJoCo, cut at the palm, fixed joints folded in."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import HandError
from fingersplit.hands.description import HandDescription
from fingersplit.hands.model import Joint, Link, Solid
from fingersplit.hands.urdf import rewrite_urdf
from fingersplit.transforms import pose_matrix, rotation_from_wxyz

__all__ = ["HINGE", "SLIDE", "Tree", "compile_model", "read_tree"]

MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
MAX_RANGE = 4 * math.pi
"""[rad]; of a joint."""
MAX_REACH = 2.0
"""[m]; of a link from the palm, and of a solid from its link."""


@dataclass(frozen=True, eq=False)
class Tree:
    """Links, joints and solids below a palm, and where they stand in the compiled model.

    Attributes:
        links: As in ``HandModel``.
        joints: As in ``HandModel``.
        collision: Solids that collide.
        visuals: Solids for pictures.
        link_of_body: Link of each of the model's bodies below the palm.
        joint_of_id: Joint of each of the model's joints that is kept.
        angles: Angle of every one of the model's joints that is not kept [rad], by id.
    """

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    collision: tuple[Solid, ...]
    visuals: tuple[Solid, ...]
    link_of_body: dict[int, int]
    joint_of_id: dict[int, int]
    angles: dict[int, float]


def compile_model(path: Path, root: Path) -> tuple[Any, list[str]]:
    """The ``MjModel`` of an MJCF or URDF file whose meshes lie below ``root``, and notes.

    Raises:
        HandError: The file cannot be read or compiled.
    """
    notes: list[str] = []
    try:
        if path.suffix.lower() == ".urdf" or b"<robot" in path.read_bytes()[:4096]:
            text, notes = rewrite_urdf(path, root)
            spec = mujoco.MjSpec.from_string(text)
        else:
            spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.balanceinertia, spec.compiler.boundmass, spec.compiler.boundinertia = 1, 1e-6, 1e-9
        return spec.compile(), notes
    except OSError as error:
        raise HandError(f"{path} cannot be read: {error.strerror or error}.") from error
    except ValueError as error:
        raise HandError(f"{path.name} does not compile. MuJoCo says: {' '.join(str(error).split())}") from error


def read_tree(model: Any, description: HandDescription) -> Tree:
    """Links from the palm outwards.

    Raises:
        HandError: No such palm, a joint that is no hinge or has no limits, or an unknown name in the description.
    """
    palm = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, description.palm)
    if palm < 0:
        names = [str(model.body(b).name) or f"body{b}" for b in range(model.nbody)]
        raise HandError(f"The model has no body {description.palm!r} for the palm; its bodies: {', '.join(names)}.")
    bodies = _subtree(model, palm)
    fixed = _angles_by_id(model, description.fixed, "fixed")
    limits = _angles_by_id(model, description.limits, "limits")
    links: list[Link] = []
    joints: list[Joint] = []
    joint_of_id: dict[int, int] = {}
    link_of_body: dict[int, int] = {}
    for body in bodies:
        pose = pose_matrix(rotation_from_wxyz(model.body_quat[body]), model.body_pos[body])
        own: list[int] = []
        for j in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
            if body == palm:
                continue
            if j in fixed:
                if model.jnt_type[j] not in (HINGE, SLIDE):
                    _joint(model, j, None)
                if own:
                    raise HandError(f"Joint {_joint_name(model, j)!r} turns on another one and cannot be fixed.")
                pose = pose @ _turned(model, j, fixed[j])
                continue
            joint_of_id[j] = len(joints)
            own.append(len(joints))
            joints.append(_joint(model, j, limits.get(j)))
        link_of_body[body] = len(links)
        axes = rotation_from_wxyz(model.body_iquat[body])
        links.append(
            Link(
                name=_body_name(model, body),
                parent=-1 if body == palm else link_of_body[model.body_parentid[body]],
                pose=np.eye(4) if body == palm else pose,
                joints=tuple(own),
                mass=float(model.body_mass[body]),
                center_of_mass=model.body_ipos[body].copy(),
                inertia=axes @ np.diag(model.body_inertia[body]) @ axes.T,
            )
        )
    collision, visuals = _solids(model, link_of_body, description)
    _check_size(links, (*collision, *visuals))
    angles = {
        j: fixed.get(j, float(model.qpos0[model.jnt_qposadr[j]])) for j in range(model.njnt) if j not in joint_of_id
    }
    return Tree(tuple(links), tuple(joints), collision, visuals, link_of_body, joint_of_id, angles)


def _check_size(links: list[Link], solids: tuple[Solid, ...]) -> None:
    """Refuse models whose lengths, or those of their meshes, are in millimetres."""
    places: list[NDArray[np.float64]] = []
    for link in links:
        places.append(link.pose if link.parent < 0 else places[link.parent] @ link.pose)
        reach = float(np.linalg.norm(places[-1][:3, 3]))
        if reach > MAX_REACH:
            raise HandError(
                f"{link.name!r} is {reach:g} m from the palm. Lengths are read in metres; are the model's in "
                "millimetres?"
            )
    for solid in solids:
        corners = solid.size if solid.vertices is None else solid.vertices
        if (size := float(np.abs(corners).max())) > MAX_REACH:
            what = "solid" if solid.vertices is None else "mesh"
            raise HandError(
                f"The {what} {solid.name!r} of {links[solid.link].name!r} reaches {size:g} m from its middle. Lengths "
                "are read in metres; a mesh in millimetres needs the scale 0.001 in the model."
            )


def _joint(model: Any, j: int, limits: Any) -> Joint:
    name = _joint_name(model, j)
    if model.jnt_type[j] == SLIDE:
        raise HandError(
            f"Joint {name!r} is no hinge, but slides; only hinges are planned for. Hold it where it is under "
            "[fixed], in metres, or change the model."
        )
    if model.jnt_type[j] != HINGE:
        raise HandError(f"Joint {name!r} is no hinge; only hinges are planned for. Replace it by hinges in the model.")
    if limits is None and not model.jnt_limited[j]:
        raise HandError(f"Joint {name!r} has no limits; give them under [limits] or fix the joint under [fixed].")
    lower, upper = model.jnt_range[j] if limits is None else limits
    if not lower < upper:
        raise HandError(f"Joint {name!r} has the limits {lower:g} to {upper:g}; the lower one must be below.")
    if upper - lower > MAX_RANGE:
        raise HandError(
            f"Joint {name!r} has the limits {lower:g} to {upper:g} rad, more than two turns. Are they in degrees? "
            "Correct them in the model, or give them under [limits] in radians."
        )
    return Joint(
        name=name,
        axis=model.jnt_axis[j].copy(),
        anchor=model.jnt_pos[j].copy(),
        reference=float(model.qpos0[model.jnt_qposadr[j]]),
        lower=float(lower),
        upper=float(upper),
    )


def _turned(model: Any, j: int, angle: float) -> NDArray[np.float64]:
    """What a hinge does to its link's pose at an angle [rad], or a slide at a length [m], (4, 4)."""
    if model.jnt_type[j] == SLIDE:
        return pose_matrix(np.eye(3), (angle - float(model.qpos0[model.jnt_qposadr[j]])) * model.jnt_axis[j])
    turn = np.empty(4)
    mujoco.mju_axisAngle2Quat(turn, model.jnt_axis[j], angle - float(model.qpos0[model.jnt_qposadr[j]]))
    there, rotation = model.jnt_pos[j], rotation_from_wxyz(turn)
    return pose_matrix(rotation, there - rotation @ there)


def _solids(
    model: Any, link_of_body: dict[int, int], description: HandDescription
) -> tuple[tuple[Solid, ...], tuple[Solid, ...]]:
    """What collides and what is drawn; where a model has only one of them, it is both."""
    collision: list[Solid] = []
    visuals: list[Solid] = []
    numbers: dict[int, int] = {}
    for g in range(model.ngeom):
        body = int(model.geom_bodyid[g])
        if body not in link_of_body:
            continue
        numbers[body] = numbers.get(body, 0) + 1
        name = model.geom(g).name or f"{_body_name(model, body)}_{numbers[body]}"
        groups = description.shapes.groups
        collides = (
            (model.geom_contype[g] | model.geom_conaffinity[g]) != 0
            if groups is None
            else model.geom_group[g] in groups
        )
        passive = (model.geom_contype[g] | model.geom_conaffinity[g]) == 0
        solid = _solid(model, g, name, link_of_body[body])
        if collides:
            collision.append(solid)
        elif passive and model.geom_group[g] < 3:  # MuJoCo's viewer hides groups from 3 on
            visuals.append(solid)
    if not collision:
        if description.shapes.groups is not None:
            raise HandError(f"No geom of the hand is in the groups {description.shapes.groups} of [shapes].")
        collision = list(visuals)
    if not collision:
        raise HandError("The hand has no geoms; give its links collision shapes.")
    return tuple(collision), tuple(visuals or collision)


def _solid(model: Any, g: int, name: str, link: int) -> Solid:
    pose = pose_matrix(rotation_from_wxyz(model.geom_quat[g]), model.geom_pos[g])
    material = model.geom_matid[g]
    color = np.array(model.mat_rgba[material] if material >= 0 else model.geom_rgba[g], dtype=np.float64)
    kind = int(model.geom_type[g])
    if kind != MESH:
        return Solid(name, link, kind, model.geom_size[g].copy(), pose, color)
    mesh = model.geom_dataid[g]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    first_face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return Solid(
        name,
        link,
        kind,
        np.zeros(3),
        pose,
        color,
        vertices=model.mesh_vert[first : first + count].astype(np.float64),
        faces=model.mesh_face[first_face : first_face + faces].astype(np.int64),
    )


def _subtree(model: Any, palm: int) -> list[int]:
    bodies = {palm}
    for body in range(palm + 1, model.nbody):
        if model.body_parentid[body] in bodies:
            bodies.add(body)
    return sorted(bodies)


def _angles_by_id(model: Any, named: dict[str, Any], table: str) -> dict[int, Any]:
    found = {}
    for name, value in named.items():
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0:
            known = ", ".join(_joint_name(model, j) for j in range(model.njnt))
            raise HandError(f"[{table}] names the joint {name!r}, which the model does not have; its joints: {known}.")
        found[joint] = value
    return found


def _body_name(model: Any, body: int) -> str:
    return "palm" if body == 0 else str(model.body(body).name) or f"body{body}"


def _joint_name(model: Any, j: int) -> str:
    return str(model.joint(j).name) or f"{_body_name(model, int(model.jnt_bodyid[j]))}_joint{j}"
