"""A hand's model as a MuJoCo specification of our own making: what is simulated is what was read."""

from typing import Any

import mujoco
import numpy as np

from fingersplit.hands.model import HandModel, Solid
from fingersplit.transforms import wxyz_from_rotation

__all__ = ["hand_spec"]


def hand_spec(model: HandModel) -> Any:
    """An ``MjSpec`` of links, hinges, solids and couplings, the palm's frame at the world's; no actuators.

    Driven joints are held to their drivers by equality constraints. Bodies, joints and solids have their model's names.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = 0
    spec.compiler.autolimits = 0
    bodies: list[Any] = []
    for link in model.links:
        parent = spec.worldbody if link.parent < 0 else bodies[link.parent]
        body = parent.add_body(name=link.name, pos=link.pose[:3, 3], quat=wxyz_from_rotation(link.pose[:3, :3]))
        moments, axes = np.linalg.eigh(link.inertia)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        body.explicitinertial = 1
        body.mass, body.ipos = link.mass, link.center_of_mass
        body.inertia, body.iquat = moments, wxyz_from_rotation(axes)
        for j in link.joints:
            joint = model.joints[j]
            hinge = body.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis, pos=joint.anchor)
            hinge.limited, hinge.range, hinge.ref = 1, [joint.lower, joint.upper], joint.reference
        bodies.append(body)
    for solid in model.solids:
        _add_solid(spec, bodies[solid.link], solid)
    for a, b in sorted(model.excluded):
        spec.add_exclude(bodyname1=model.links[a].name, bodyname2=model.links[b].name)
    _add_couplings(spec, model)
    return spec


def _add_solid(spec: Any, body: Any, solid: Solid) -> None:
    pose = {"pos": solid.pose[:3, 3], "quat": wxyz_from_rotation(solid.pose[:3, :3])}
    if solid.vertices is None or solid.faces is None:
        body.add_geom(name=solid.name, type=mujoco.mjtGeom(solid.kind), size=solid.size, mass=0, **pose)
        return
    spec.add_mesh(
        name=solid.name,
        uservert=solid.vertices.ravel(),
        userface=solid.faces.ravel().astype(np.int32),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # not used, and never refused
    )
    body.add_geom(name=solid.name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=solid.name, mass=0, **pose)


def _add_couplings(spec: Any, model: HandModel) -> None:
    coupling, names = model.coupling, model.joint_names
    places = [names.index(driver) for driver in coupling.drivers]
    for j, joint in enumerate(model.joints):
        (columns,) = np.nonzero(coupling.matrix[j])
        if j in places:
            continue
        if len(columns) < 2:
            data = np.zeros(12)
            data[0] = coupling.offset[j] - joint.reference
            equality = spec.add_equality(name=f"{joint.name}_coupling", type=mujoco.mjtEq.mjEQ_JOINT, name1=joint.name)
            equality.objtype = mujoco.mjtObj.mjOBJ_JOINT
            if len(columns):
                ratio, driver = coupling.matrix[j, columns[0]], model.joints[places[columns[0]]]
                equality.name2, data[1] = driver.name, ratio
                data[0] += ratio * driver.reference
            equality.data = data
            continue
        tendon = spec.add_tendon(name=f"{joint.name}_coupling")
        tendon.wrap_joint(joint.name, 1.0)
        length = joint.reference
        for column in columns:
            driver, ratio = model.joints[places[column]], coupling.matrix[j, column]
            tendon.wrap_joint(driver.name, -ratio)
            length -= ratio * driver.reference
        data = np.zeros(12)
        data[0] = coupling.offset[j] - length
        equality = spec.add_equality(name=f"{joint.name}_coupling", type=mujoco.mjtEq.mjEQ_TENDON, name1=tendon.name)
        equality.objtype, equality.data = mujoco.mjtObj.mjOBJ_TENDON, data
