"""A hand's solids as MuJoCo poses and collides them: how deep it lies in an object and in itself."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, cKDTree

from fingersplit.hands import Hand
from fingersplit.transforms import pose_matrix

ALWAYS = 50
"""Random postures; links that touch in all of them do so for good."""
TOUCHING = 2e-3
"""[m]"""


class PosedSolids:
    """The simulated model of a hand, moved by joint angles; nothing of the planner's shapes or distances."""

    def __init__(self, hand: Hand) -> None:
        self.model = hand.spec().compile()
        self.model.geom_margin[:] = TOUCHING
        self.data = mujoco.MjData(self.model)
        self._places = [self.model.joint(name).qposadr[0] for name in hand.joint_names]
        self._hulls = {}
        for geom in np.flatnonzero(self.model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
            mesh = self.model.geom_dataid[geom]
            first, count = self.model.mesh_vertadr[mesh], self.model.mesh_vertnum[mesh]
            self._hulls[int(geom)] = ConvexHull(self.model.mesh_vert[first : first + count]).equations
        coupling = hand.model.coupling
        self.move(hand.model.joints_from_drivers(np.clip(0, coupling.lower, coupling.upper)))
        touching = self._touching()
        self._neighbours = {pair for pair in touching if self._carries(*pair)}
        rng = np.random.default_rng(0)
        for _ in range(ALWAYS):
            self.move(hand.model.joints_from_drivers(rng.uniform(coupling.lower, coupling.upper)))
            touching &= self._touching()
        self._neighbours |= touching
        parents = self.model.body_weldid[self.model.body_parentid]
        self._neighbours |= {(int(parents[body]), int(body)) for body in np.unique(self.model.body_weldid)}

    def move(self, joints: ArrayLike) -> None:
        """Stand at joint angles (N,) [rad]."""
        self.data.qpos[self._places] = joints
        mujoco.mj_fwdPosition(self.model, self.data)

    def depth_in_itself(self) -> tuple[float, str]:
        """How deep two links lie in each other that are no neighbours [m], and the names of their geoms."""
        deepest, names = 0.0, ""
        for k in range(self.data.ncon):
            contact = self.data.contact[k]
            if self._bodies(contact.geom1, contact.geom2) not in self._neighbours and -contact.dist > deepest:
                deepest = -float(contact.dist)
                names = f"{self.model.geom(contact.geom1).name} in {self.model.geom(contact.geom2).name}"
        return deepest, names

    def depth_in(self, surface: cKDTree, object_from_palm: NDArray[np.float64]) -> tuple[float, str]:
        """How deep the deepest point of an object's surface lies in a link [m], and the name of the geom."""
        deepest, name = 0.0, ""
        for geom in range(self.model.ngeom):
            turn, place = self.data.geom_xmat[geom].reshape(3, 3), self.data.geom_xpos[geom]
            object_from_geom = object_from_palm @ pose_matrix(turn, place)
            near = surface.query_ball_point(object_from_geom[:3, 3], self.model.geom_rbound[geom], return_sorted=False)
            local = (surface.data[near] - object_from_geom[:3, 3]) @ object_from_geom[:3, :3]
            middle, half = np.split(self.model.geom_aabb[geom], 2)
            local = local[(np.abs(local - middle) < half + 1e-9).all(axis=1)]
            if not len(local):
                continue
            if geom in self._hulls:
                heights = (local @ self._hulls[geom][:, :3].T + self._hulls[geom][:, 3]).max(axis=1)
            else:
                heights = _heights(self.model.geom_type[geom], self.model.geom_size[geom], local)
            if -heights.min() > deepest:
                deepest, name = -float(heights.min()), self.model.geom(geom).name
        return deepest, name

    def _bodies(self, one: int, other: int) -> tuple[int, int]:
        first, second = sorted(self.model.body_weldid[self.model.geom_bodyid[[one, other]]].tolist())
        return first, second

    def _carries(self, one: int, other: int) -> bool:
        """Whether the first of two bodies, the nearer to the palm by number, carries the other."""
        while other > one:
            other = int(self.model.body_parentid[other])
        return other == one

    def _touching(self) -> set[tuple[int, int]]:
        contacts = [self.data.contact[k] for k in range(self.data.ncon)]
        return {self._bodies(contact.geom1, contact.geom2) for contact in contacts if contact.dist < TOUCHING}


def _heights(kind: int, size: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed distances (n,) of points (n, 3) to a primitive's surface [m], exact inside of it."""
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return np.asarray((np.abs(points) - size).max(axis=1))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.maximum(np.hypot(points[:, 0], points[:, 1]) - size[0], np.abs(points[:, 2]) - size[1])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        along = np.clip(points[:, 2], -size[1], size[1])
        return np.hypot(np.hypot(points[:, 0], points[:, 1]), points[:, 2] - along) - size[0]
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return np.linalg.norm(points, axis=1) - size[0]
    raise AssertionError(f"no distance to a geom of kind {kind}")
