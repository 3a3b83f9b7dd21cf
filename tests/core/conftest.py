"""Independent measures that the planner's own code has no part in, and finished runs to look at."""

from collections.abc import Callable, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fingersplit.hands import Hand
from fingersplit.hands.kinematics_kernel import move_fingers
from fingersplit.hands.shapes_kernel import BOX, CAPSULE, CYLINDER
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.model import ObjectModel
from fingersplit.parallel_grasps.sources.antipodal import sample_antipodal
from fingersplit.planning.run import Run
from fingersplit.planning.starts import Start, build_problem, choose_starts, split_starts
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.splitting.state import Problem, new_states
from fingersplit.transforms import rotation_to_axis


class ExactMesh:
    """Distances to the triangles themselves, by brute force over all that can be nearest."""

    def __init__(self, mesh: Mesh) -> None:
        self.triangles = mesh.vertices[mesh.faces]
        self.solid = mesh.trimesh
        self._corners = cKDTree(self.triangles.reshape(-1, 3))
        centers = self.triangles.mean(axis=1)
        self._centers = cKDTree(centers)
        self._reach = np.linalg.norm(self.triangles - centers[:, None], axis=2).max()

    def closest(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Nearest points (n, 3) [m] of the triangles and the distances to them (n,) [m]."""
        points = np.asarray(points, dtype=np.float64)
        bounds = self._corners.query(points)[0] + self._reach + 1e-9
        nearest = np.empty_like(points)
        for i, (point, bound) in enumerate(zip(points, bounds, strict=True)):
            near = self.triangles[self._centers.query_ball_point(point, bound)]
            on_triangles = closest_on_triangles(near, point)
            nearest[i] = on_triangles[np.argmin(np.linalg.norm(on_triangles - point, axis=1))]
        return nearest, np.linalg.norm(points - nearest, axis=1)

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distances (n,) [m] of points (n, 3) [m] to the triangles."""
        return self.closest(points)[1]


def closest_on_triangles(triangles: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Point of each triangle (n, 3, 3) [m] nearest to ``point``: its projection, or else the best on the edges."""
    starts, edges = triangles, np.roll(triangles, -1, axis=1) - triangles
    along = np.einsum("nij,nij->ni", point - starts, edges) / np.einsum("nij,nij->ni", edges, edges)
    on_edges = starts + np.clip(along, 0, 1)[:, :, None] * edges
    best = np.linalg.norm(on_edges - point, axis=2).argmin(axis=1)
    closest = on_edges[np.arange(len(triangles)), best]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    height = np.einsum("nj,nj->n", point - starts[:, 0], normals)
    projected = point - height[:, None] * normals
    sides = np.einsum("nij,nj->ni", np.cross(edges, projected[:, None] - starts), normals)
    inside = (sides >= 0).all(axis=1)
    return np.where(inside[:, None], projected, closest)


class MuJoCoHand:
    """A hand as MuJoCo moves it, in the object frame of a result document."""

    def __init__(self, path: Path) -> None:
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)
        self._rotation, self._position = np.eye(3), np.zeros(3)
        self._balls: tuple[NDArray[np.float64], ...] | None = None

    def move(self, joints: dict[str, float], wxyz: ArrayLike = (1, 0, 0, 0), position: ArrayLike = (0, 0, 0)) -> None:
        for name, angle in joints.items():
            self.data.qpos[self.model.joint(name).qposadr[0]] = angle
        mujoco.mj_kinematics(self.model, self.data)
        self._rotation = Rotation.from_quat(np.asarray(wxyz), scalar_first=True).as_matrix()
        self._position = np.asarray(position, dtype=np.float64)

    def body(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and position (3,) [m] of a body."""
        body = self.data.body(name)
        return self._rotation @ body.xmat.reshape(3, 3), self._rotation @ body.xpos + self._position

    def joint(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and position (3,) [m] of a joint's frame: its body's, turned so that z is the axis."""
        joint = self.model.joint(name)
        rotation, _ = self.body(self.model.body(joint.bodyid[0]).name)
        anchor, axis = self.data.joint(name).xanchor, self.data.joint(name).xaxis
        in_joint = rotation @ rotation_to_axis(joint.axis)
        np.testing.assert_allclose(in_joint[:, 2], self._rotation @ axis, atol=1e-12)
        return in_joint, self._rotation @ anchor + self._position

    def site(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Position (3,) [m] and z axis (3,) of a site."""
        site = self.data.site(name)
        return self._rotation @ site.xpos + self._position, self._rotation @ site.xmat.reshape(3, 3)[:, 2]

    def geom(self, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation (3, 3) and position (3,) [m] of a geom."""
        geom = self.data.geom(name)
        return self._rotation @ geom.xmat.reshape(3, 3), self._rotation @ geom.xpos + self._position

    def geom_distance(self, name: str, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed distances (n,) [m] of points (n, 3) [m] to a geom."""
        geom = self.model.geom(name).id
        in_palm = (points - self._position) @ self._rotation
        local = (in_palm - self.data.geom_xpos[geom]) @ self.data.geom_xmat[geom].reshape(3, 3)
        return signed_distance(self.model.geom_type[geom], self.model.geom_size[geom], local)

    @property
    def collision_shapes(self) -> list[str]:
        """Names of the geoms that collide; the others are what the hand looks like."""
        geoms = map(self.model.geom, range(self.model.ngeom))
        return [geom.name for geom in geoms if geom.contype[0] or geom.conaffinity[0]]

    def depth(self, points: NDArray[np.float64]) -> float:
        """How deep the deepest of these points (n, 3) [m] lies inside any geom [m]; 0 when all are outside."""
        return max(0.0, *(float(-self.geom_distance(name, points).min()) for name in self.collision_shapes))

    def depth_of_triangles(self, triangles: NDArray[np.float64]) -> float:
        """How deep triangles (n, 3, 3) [m] reach into any geom [m], to a micrometre; 0 when all are outside.

        Distances to a convex shape are convex on a triangle, so a search that closes in on its best point finds it.
        """
        if self._balls is None or self._balls[0] is not triangles:  # the same ones are asked for again and again
            middles = triangles.mean(axis=1)
            self._balls = triangles, middles, np.linalg.norm(triangles - middles[:, None], axis=2).max(axis=1)
        _, centers, reach = self._balls
        deepest = 0.0
        for name in self.collision_shapes:
            geom = self.model.geom(name)
            place = self._rotation @ self.data.geom(name).xpos + self._position
            away = centers - place
            around = np.einsum("ij,ij->i", away, away) < (reach + geom.rbound[0]) ** 2
            near = triangles[around]
            near = near[self.geom_distance(name, centers[around]) - reach[around] < -deepest]
            if len(near):
                deepest = max(deepest, self._deepest(name, near))
        return deepest

    def _deepest(self, name: str, triangles: NDArray[np.float64]) -> float:
        """Depth of the deepest point of triangles in one geom, by barycentric grids that halve about the best point."""
        steps = np.linspace(-1, 1, 9)
        offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        places, width, least = np.full((len(triangles), 2), 1 / 3), 1.0, np.inf
        while width * (sizes := np.linalg.norm(np.ptp(triangles, axis=1), axis=1)).max(initial=0.0) > 1e-6:
            tried = np.clip(places[:, None] + width * offsets, 0, 1)  # (n, 81, 2)
            tried[:, :, 1] = np.minimum(tried[:, :, 1], 1 - tried[:, :, 0])
            weights = np.concatenate([tried, 1 - tried.sum(axis=2, keepdims=True)], axis=2)
            points = weights @ triangles  # (n, 81, 3)
            distances = self.geom_distance(name, points.reshape(-1, 3)).reshape(len(triangles), -1)
            places, nearest = tried[np.arange(len(triangles)), distances.argmin(axis=1)], distances.min(axis=1)
            least = min(least, nearest.min())
            # Further steps move a place by less than two widths of its triangle.
            hopeful = nearest - 2 * width * sizes < min(least, 0.0)
            triangles, places = triangles[hopeful], places[hopeful]
            width *= 0.5
        return float(-least)


def signed_distance(kind: int, size: ArrayLike, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (n,) [m] of points (n, 3) [m] to a MuJoCo primitive, negative inside, after its definition."""
    radius, half, _ = np.asarray(size)
    if kind == CAPSULE:
        on_axis = np.clip(points[:, 2], -half, half)
        return np.linalg.norm(points - on_axis[:, None] * (0, 0, 1), axis=1) - radius
    if kind == CYLINDER:
        beyond = np.stack([np.hypot(points[:, 0], points[:, 1]) - radius, np.abs(points[:, 2]) - half], axis=1)
    elif kind == BOX:
        beyond = np.abs(points) - np.asarray(size)
    else:
        return np.linalg.norm(points, axis=1) - radius
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return np.asarray(np.where(outside > 0, outside, beyond.max(axis=1)))


@pytest.fixture(scope="session")
def mujoco_hand() -> Callable[[Path], MuJoCoHand]:
    return MuJoCoHand


@pytest.fixture(scope="session")
def mujoco_barrett() -> MuJoCoHand:
    return MuJoCoHand(Path(str(files("fingersplit.hands"))) / "barrett" / "hand.xml")


@pytest.fixture(scope="session")
def exact_mesh() -> Callable[[Mesh], ExactMesh]:
    return cache(ExactMesh)


def ignore_progress(stage: str, share: float) -> None:
    """Nobody is told."""


@pytest.fixture(scope="session")
def problem_of(barrett: Hand, prepared: Callable[[str], ObjectModel]) -> Callable[..., Problem]:
    """The kernels' problem for a parametric object, with settings (and their fidelity) by name."""

    def build(name: str, fidelity: str = "default", **settings: Any) -> Problem:
        return build_problem(prepared(name), barrett, PlannerSettings.of(fidelity, **settings))

    return build


@pytest.fixture(scope="session")
def starts_of(
    barrett: Hand, prepared: Callable[[str], ObjectModel], problem_of: Callable[..., Problem]
) -> Callable[[str], list[Start]]:
    """The 16 most promising starts of a parametric object."""

    @cache
    def choose_some(name: str) -> list[Start]:
        grasps = sample_antipodal(
            prepared(name), 8, friction=0.6, opening=(0.0, 0.2), approaches=6, rng=np.random.default_rng(5)
        )
        return choose_starts(problem_of(name), barrett, grasps, 16, threads=1, report=ignore_progress)

    return choose_some


@pytest.fixture(scope="session")
def runs_of(
    barrett: Hand,
    prepared: Callable[[str], ObjectModel],
    problem_of: Callable[..., Problem],
    starts_of: Callable[[str], list[Start]],
) -> Callable[..., Sequence[Run]]:
    """Finished runs from those starts, with settings (and their fidelity) by name."""

    @cache
    def split_all(name: str, **settings: Any) -> Sequence[Run]:
        problem = problem_of(name, **settings)
        return split_starts(
            problem, prepared(name).patches, barrett, starts_of(name), threads=1, report=ignore_progress
        )

    return split_all


@pytest.fixture(scope="session")
def verify_grasp(
    barrett: Hand, mujoco_barrett: MuJoCoHand, exact_mesh: Callable[[Mesh], ExactMesh]
) -> Callable[[ObjectModel, dict[str, Any]], None]:
    """Check what a result document claims of a feasible grasp against MuJoCo's kinematics and the exact triangles."""

    def verify(model: ObjectModel, grasp: dict[str, Any]) -> None:
        exact, joints = exact_mesh(model.mesh), grasp["joints"]
        assert set(joints) == set(barrett.joint_names)
        for name, low, high in zip(barrett.joint_names, barrett.lower, barrett.upper, strict=True):
            assert low <= joints[name] <= high, name
        mujoco_barrett.move(joints, grasp["palm"]["wxyz"], grasp["palm"]["position"])
        contacts = grasp["contacts"]
        assert [contact["finger"] for contact in contacts] == [finger.name for finger in barrett.fingers]
        positions = np.array([contact["position"] for contact in contacts])
        normals = np.array([contact["normal"] for contact in contacts])
        sites = [mujoco_barrett.site(f"{finger.name}_pad") for finger in barrett.fingers]
        centers, pad_normals = (np.array(column) for column in zip(*sites, strict=True))
        radii = np.array([finger.pad_radius for finger in barrett.fingers])
        tolerance = 0.3e-3 + 1e-6
        assert exact.distance(positions).max() < tolerance
        assert np.abs(np.linalg.norm(centers - positions, axis=1) - radii).max() < tolerance
        assert np.abs(exact.distance(centers) - radii).max() < tolerance + 0.1e-3  # the pads touch, and do not dive in
        fingertips = np.array([contact["fingertip"] for contact in contacts])
        np.testing.assert_allclose(np.linalg.norm(fingertips - centers, axis=1), radii, atol=1e-9)
        assert np.linalg.norm(fingertips - positions, axis=1).max() < tolerance
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-9)
        angles = np.arccos(np.clip(-(pad_normals * normals).sum(axis=1), -1, 1))
        towards = (positions - centers) / np.linalg.norm(positions - centers, axis=1)[:, None]
        touching = np.arccos(np.clip((pad_normals * towards).sum(axis=1), -1, 1))
        angles = np.maximum(angles, touching)
        assert angles.max() <= 0.6 + 1e-6
        np.testing.assert_allclose(angles, [contact["pad_angle"] for contact in contacts], atol=1e-6)
        assert mujoco_barrett.depth_of_triangles(exact.triangles) < 1e-3 + 0.01e-3

    return verify


@pytest.fixture(scope="session")
def posed_state(barrett: Hand) -> Callable[[ArrayLike, ArrayLike], np.record]:
    """A ``STATE`` record of the Barrett hand with joints (8,) [rad] and a palm pose (4, 4)."""

    def pose(joints: ArrayLike, object_from_palm: ArrayLike) -> np.record:
        state, palm = new_states(1)[0], np.asarray(object_from_palm)
        state.joints[: len(barrett.joint_names)] = state.drivers[: len(barrett.joint_names)] = joints
        state.palm_rotation, state.palm_position = palm[:3, :3], palm[:3, 3]
        move_fingers(barrett.arrays, state)
        return state

    return pose
