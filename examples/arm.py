"""An arm picks an object by a planned grasp, in MuJoCo: python arm.py [mug.ply] [--hand NAME] [--picture FILE.png].

Plans for an object [m] on a table, from above, and executes the first grasp that the arm reaches: from home to the
pre-grasp, straight on to the grasp, fingers closed and pressed on by servos as published with the grasp, lifted along
the retreat. Ends with exit code 1 if the object was not held. The arm is made up, with lengths as usual; put in yours.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import fingersplit as fs
from fingersplit_client import Client, Grasp, PlanResult, Transform

LINKS = (  # axis, way to the next joint [m], range [rad], largest torque [N m], mass [kg]
    ((0, 0, 1), 0.21, 2.96, 320, 4.0),
    ((0, 1, 0), 0.20, 2.09, 320, 4.0),
    ((0, 0, 1), 0.22, 2.96, 176, 3.0),
    ((0, -1, 0), 0.20, 2.09, 176, 2.7),
    ((0, 0, 1), 0.20, 2.96, 110, 1.7),
    ((0, 1, 0), 0.08, 2.09, 80, 1.8),
    ((0, 0, 1), 0.05, 3.05, 80, 0.3),
)
AXES, LOW, HIGH = len(LINKS), -np.array([link[2] for link in LINKS]), np.array([link[2] for link in LINKS])
HOME = np.array([0, 0.3, 0, -1.4, 0, 1.44, 0])
BASE, SHOULDER, STIFFNESS = (-0.55, 0.0, 0.0), 0.15, 8000.0
"""The arm's foot in the scene, whose origin is below the object; the first joint above it [m]; stiffness [N m/rad]."""
MASS, FRICTION = 0.3, 0.6


def build(planned: PlanResult, grasp: Grasp, hand: fs.Hand, pieces: Any) -> Any:
    """The world as an ``MjModel``: arm, hand, object, table; in joints and controls the arm comes first."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = spec.compiler.autolimits = 0
    spec.option.integrator, spec.option.cone = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio, spec.option.noslip_iterations = 10, 2  # else a held object creeps
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1200, 900
    spec.worldbody.add_light(pos=[-0.5, -1.5, 2.5], dir=[0.2, 0.5, -0.8])
    spec.visual.headlight.ambient = [0.4, 0.4, 0.4]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], rgba=[0.8, 0.78, 0.74, 1])
    flange = _add_arm(spec, *mount(hand))
    spec.attach(_hand(grasp, hand), site=flange, prefix="hand/")
    for one, other in (("foot", "arm0"), ("arm4", "arm6"), ("arm5", f"hand/{hand.palm}")):  # overlap in between
        spec.add_exclude(bodyname1=one, bodyname2=other)
    pose, ((xx, xy, xz), (_, yy, yz), (_, _, zz)) = planned.scene.object_pose, planned.object.inertia
    body = spec.worldbody.add_body(name="object", pos=pose.position, quat=pose.wxyz, explicitinertial=1)
    body.mass, body.ipos, body.fullinertia = MASS, planned.object.center_of_mass, [xx, yy, zz, xy, xz, yz]
    body.add_freejoint()
    for number, (vertices, faces) in enumerate(pieces):
        name, shell, kind = f"piece{number}", mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL, mujoco.mjtGeom.mjGEOM_MESH
        spec.add_mesh(name=name, uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
        body.add_geom(type=kind, meshname=name, mass=0, condim=4, rgba=[0.3, 0.55, 0.9, 1])
    return spec.compile()


def mount(hand: fs.Hand) -> tuple[float, np.ndarray]:
    """How the palm sits on the flange: its distance along the arm's axis [m], and its rotation, a quaternion wxyz.

    The hand approaches along the arm's axis, with all of its palm before the flange. Put in your adapter's.
    """
    approach, turned = hand.gripper.palm_from_gripper[:, 2], np.zeros(4)
    mujoco.mju_quatZ2Vec(turned, np.ascontiguousarray(approach))
    model = hand.spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    signs = np.stack(np.meshgrid(*[(-1, 1)] * 3), axis=-1).reshape(-1, 3)  # (8, 3), corners of a box
    backs = [0.0]
    for geom in np.flatnonzero(model.geom_bodyid == model.body(hand.palm).id):
        corners = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
        backs.append((corners @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]) @ approach)
    return -float(np.min(np.hstack(backs))), turned * [1, -1, -1, -1]


def _add_arm(spec: Any, adapter: float, turned: np.ndarray) -> Any:
    """The arm on its foot, with gravity compensation; the site where the palm is mounted."""
    body, way = spec.worldbody.add_body(name="foot", pos=BASE), SHOULDER
    kind, foot = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_CYLINDER
    body.add_geom(type=foot, size=[0.09, 0.06, 0], pos=[0, 0, 0.065], rgba=[0.3, 0.3, 0.35, 1])
    for number, (axis, length, limit, torque, mass) in enumerate(LINKS):
        name, ends, radius = f"arm{number}", [0, 0, 0, 0, 0, length], 0.055 if length > 0.1 else 0.04
        body = body.add_body(name=name, pos=[0, 0, way], gravcomp=1)
        body.add_joint(name=name, axis=axis, range=[-limit, limit], limited=1, armature=0.1)
        body.add_geom(type=kind, fromto=ends, size=[radius, 0, 0], mass=mass, rgba=[1, 0.6, 0.2, 1])
        _add_servo(spec, name, torque, kp=STIFFNESS, dampratio=1.0)
        way = length
    return body.add_site(name="flange", pos=[0, 0, way + adapter], quat=turned)


def _hand(grasp: Grasp, hand: fs.Hand) -> Any:
    """The hand with its servos; it was planned free of itself and collides with all else."""
    spec, coupling, grip = hand.spec(), hand.model.coupling, grasp.grip
    for body in spec.bodies[1:]:
        body.gravcomp = 1
        for geom in body.geoms:
            geom.conaffinity, geom.condim, geom.priority, geom.friction[0] = 0, 4, 1, FRICTION
    for joint in spec.joints:
        joint.armature, joint.damping[0] = 2e-3, 0.02
    for name, torque in zip(coupling.drivers, coupling.torque_limits, strict=True):  # fingers that rest are held, too
        _add_servo(spec, name, torque, kp=grip.stiffness.get(name, 10.0), kv=grip.damping.get(name, 0.5))
    return spec


def _add_servo(spec: Any, joint: str, torque: float, **gains: float) -> None:
    servo = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(**gains)
    servo.forcelimited, servo.forcerange = 1, [-torque, torque]


class Robot:
    """Arm and hand in a world, at home with the fingers as they approach."""

    def __init__(self, model: Any, grasp: Grasp, hand: fs.Hand) -> None:
        self.model, self.data, self.scratch = model, mujoco.MjData(model), mujoco.MjData(model)
        self.palm, self.object = self.data.body(f"hand/{hand.palm}"), self.data.body("object")
        drivers = list(hand.model.coupling.drivers)
        self.open, self.closed, self.pressed = (
            grasp.joint_vector(drivers, at) for at in ("pregrasp", "grasp", "squeeze")
        )
        for name, angle in grasp.pregrasp.joints.items():
            self.data.joint(f"hand/{name}").qpos = angle
        self.data.qpos[:AXES] = HOME

    def reach(self, pose: Transform, joints: np.ndarray) -> np.ndarray | None:
        """Joints of the arm that bring the palm to a pose, from some near them, by damped least squares."""
        data, palm, jacobian = self.scratch, self.scratch.body(self.palm.id), np.zeros((6, self.model.nv))
        turn, error = np.zeros(4), np.zeros(6)
        for _ in range(100):
            data.qpos[:], data.qpos[:AXES] = self.data.qpos, joints
            mujoco.mj_kinematics(self.model, data)
            mujoco.mj_comPos(self.model, data)
            mujoco.mju_mulQuat(turn, np.array(pose.wxyz), palm.xquat * [1, -1, -1, -1])
            error[:3] = pose.position - palm.xpos
            mujoco.mju_quat2Vel(error[3:], turn, 1.0)
            if np.abs(error).max() < 1e-4:
                return joints
            mujoco.mj_jacBody(self.model, data, jacobian[:3], jacobian[3:], palm.id)
            arm = jacobian[:, :AXES]
            step = arm.T @ np.linalg.solve(arm @ arm.T + 1e-4 * np.eye(6), error)
            joints = np.clip(joints + step * min(1.0, 0.3 / np.abs(step).max()), LOW, HIGH)
        return None

    def follow(self, start: np.ndarray, first: Transform, last: Transform) -> np.ndarray | None:
        """Joints along a straight line of the palm, (T, 7); None where it leaves the reach or the arm would jump."""
        path = [start]
        for share in np.linspace(0.05, 1, 20):
            place = (1 - share) * np.array(first.position) + share * np.array(last.position)
            joints = self.reach(Transform(tuple(place), last.wxyz), path[-1])
            if joints is None or np.abs(joints - path[-1]).max() > 0.3:
                return None
            path.append(joints)
        return np.array(path)

    def free(self, path: np.ndarray, *, at_object: bool) -> bool:
        """Whether arm and hand touch nothing along a path, but the object ``at_object``."""
        for joints in path:
            self.scratch.qpos[:], self.scratch.qpos[:AXES] = self.data.qpos, joints
            mujoco.mj_forward(self.model, self.scratch)
            for pair in self.model.geom_bodyid[self.scratch.contact.geom]:
                if self.object.id not in pair or not (at_object or 0 in pair):  # 0 is the table
                    return False
        return True

    def ways(self, before: Transform, grasp: Transform, after: Transform) -> tuple[np.ndarray, ...] | None:
        """Paths from home to the pre-grasp, in, and out; None where no start of the inverse kinematics gives them."""
        for start in [HOME, *np.random.default_rng(1).uniform(LOW, HIGH, (40, AXES))]:
            joints = self.reach(before, start)
            way_in = None if joints is None else self.follow(joints, before, grasp)
            way_out = None if way_in is None else self.follow(way_in[-1], grasp, after)
            if way_out is not None:
                there = np.linspace(HOME, way_in[0], 60)
                if self.free(there, at_object=False) and self.free(np.vstack([way_in, way_out]), at_object=True):
                    return there, way_in, way_out
        return None

    def move(self, seconds: float, path: np.ndarray, *fingers: list[float]) -> None:
        """Follow a path of the arm and one of the drivers, from rest to rest."""
        ends = np.array([fingers[0], fingers[-1]])
        for share in np.linspace(0, 1, round(seconds / self.model.opt.timestep)):
            smooth = share**3 * (10 - 15 * share + 6 * share**2)
            before, rest = divmod(smooth * (len(path) - 1), 1)
            after = min(int(before) + 1, len(path) - 1)
            self.data.ctrl[:AXES] = (1 - rest) * path[int(before)] + rest * path[after]
            self.data.ctrl[AXES:] = (1 - smooth) * ends[0] + smooth * ends[1]
            mujoco.mj_step(self.model, self.data)

    def in_palm(self) -> np.ndarray:
        """The object's centre in the palm frame, (3,) [m]."""
        return self.palm.xmat.reshape(3, 3).T @ (self.object.xipos - self.palm.xpos)


def pick(planned: PlanResult, hand: fs.Hand, pieces: Any) -> tuple[Robot, bool]:
    """Pick by the first grasp that the arm reaches, those first that held in simulation; and whether it held."""
    feasible = [grasp for grasp in planned.select() if grasp.pregrasp and grasp.retreat_path]
    for grasp in sorted(feasible, key=lambda one: not one.held):
        placed = grasp.in_frame((planned.scene.object_pose.position, planned.scene.object_pose.wxyz))
        rise = grasp.retreat_path.distance * np.array(grasp.retreat_path.direction_in_world)
        robot = Robot(build(planned, grasp, hand, pieces), grasp, hand)
        ways = robot.ways(placed.pregrasp, placed.pose, Transform(tuple(placed.pose.position + rise), placed.pose.wxyz))
        if ways is None:
            print(f"{grasp}: the arm does not reach it")
            continue
        there, way_in, way_out = ways
        robot.move(2.0, there, robot.open)
        robot.move(1.5, way_in, robot.open)
        height = robot.object.xipos[2]
        robot.move(0.8, way_in[-1:], robot.open, robot.closed)
        robot.move(0.8, way_in[-1:], robot.closed, robot.pressed)
        gripped = robot.in_palm()
        robot.move(1.5, way_out, robot.pressed)
        robot.move(1.0, way_out[-1:], robot.pressed)
        lifted, slip = robot.object.xipos[2] - height, np.linalg.norm(robot.in_palm() - gripped)
        held = bool(lifted > 0.8 * rise[2] and slip < 0.02)
        print(f"{grasp}: lifted by {1e3 * lifted:.0f} of {1e3 * rise[2]:.0f} mm, slipped by {1e3 * slip:.1f} mm")
        return robot, held
    sys.exit(f"The arm reaches none of {len(feasible)} grasps. {planned.summary.message}")


def draw(robot: Robot, file: Path) -> None:
    """Write a picture of the end; without a display it needs MUJOCO_GL=egl."""
    from PIL import Image

    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (-0.2, 0, 0.3), 1.4, 115, -15
    with mujoco.Renderer(robot.model, 900, 1200) as renderer:
        renderer.update_scene(robot.data, camera)
        Image.fromarray(renderer.render()).save(file)


def main() -> None:
    """Plan, pick, tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path, nargs="?", default=Path(__file__).parent / "objects" / "mug.ply")
    parser.add_argument("--hand", default="barrett", help="a known hand, mounted so that it approaches along the arm")
    parser.add_argument("--picture", type=Path, help="PNG of the end")
    given = parser.parse_args()
    table = {"support_surfaces": [{"id": "table"}]}
    above = {"directions": [{"axis": [0, 0, -1], "max_angle": 0.6}]}
    asked: dict[str, Any] = {"hand": given.hand, "mass": MASS, "friction": FRICTION, "scene": table, "approach": above}
    with Client() as client:
        planned = client.plan(given.mesh, starts=48, verified=1, protocol="pick", **asked)
    mesh = fs.load_object(given.mesh).mesh
    robot, held = pick(planned, fs.load_hand(given.hand), fs.decompose(mesh).pieces)
    if given.picture:
        draw(robot, given.picture)
    print("The object was held." if held else "The object was not held.")
    sys.exit(0 if held else 1)


if __name__ == "__main__":
    main()
