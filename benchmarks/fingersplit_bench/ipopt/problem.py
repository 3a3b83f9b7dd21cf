"""The general grasp planning problem (1) of [Fan2018] as a nonlinear program in CasADi [Andersson2019], for IPOPT.

IPOPT is an interior-point solver [Waechter2006]; it gets exact first and second derivatives.
"""

from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.splitting.settings import PlannerSettings
from fingersplit.transforms import pose_matrix, rotation_from_wxyz, wxyz_from_rotation
from fingersplit_bench.ipopt.implicit_surface import ImplicitSurface
from fingersplit_bench.ipopt.kinematics import manipulability, object_quality, pads_in_palm

__all__ = ["GeneralProblem", "Solution", "build_problem"]

MAX_ITERATIONS = 500
OBJECTIVE_SCALE = 100.0
"""Q is of the order 0.01; IPOPT's tolerances are meant for numbers about 1."""
SLOPE_FLOOR = 1e-6
"""Added under the root of the squared slope of the signed distance, which is 1 but where the object is thin."""


@dataclass(frozen=True)
class Solution:
    """What IPOPT made of one start.

    Attributes:
        status: IPOPT's own word for how it ended.
        converged: Whether IPOPT calls it solved, to its tolerance or to its acceptable one.
        iterations: Iterations that it took.
        seconds: CPU time of the call [s]; it is long enough that on a busy machine wall time would count others' work.
        object_from_palm: Palm pose, (4, 4).
        joints: Joint angles, (N,) [rad].
    """

    status: str
    converged: bool
    iterations: int
    seconds: float
    object_from_palm: NDArray[np.float64]
    joints: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GeneralProblem:
    """Problem (1) for one object and hand; unknowns are palm position, palm quaternion, joints and contacts.

    The contacts' ball joints E leave eq. (1b) as three equations a finger: the pad's centre, a radius off its contact.

    Attributes:
        solver: CasADi's interface to IPOPT.
        surface: The implicit surface that eq. (1c) puts the contacts on.
        lower_unknowns: Bounds of the unknowns; joint limits, eq. (1d), among them.
        upper_unknowns: Likewise.
        seconds: Time to write the program and its derivatives [s].
    """

    solver: casadi.Function
    surface: ImplicitSurface
    lower_unknowns: NDArray[np.float64]
    upper_unknowns: NDArray[np.float64]
    seconds: float

    def solve(self, start: Grasp) -> Solution:
        """Run IPOPT from a start."""
        wxyz = wxyz_from_rotation(start.object_from_palm[:3, :3])
        unknowns = np.concatenate([start.object_from_palm[:3, 3], wxyz, start.joints, start.contacts.ravel()])
        began = thread_time()
        answer = self.solver(x0=unknowns, lbx=self.lower_unknowns, ubx=self.upper_unknowns, lbg=0, ubg=0)
        seconds = thread_time() - began
        found, statistics = np.asarray(answer["x"]).ravel(), self.solver.stats()
        count = len(start.joints)
        return Solution(
            status=statistics["return_status"],
            converged=bool(statistics["success"]),
            iterations=int(statistics["iter_count"]),
            seconds=seconds,
            object_from_palm=pose_matrix(rotation_from_wxyz(found[3:7] / np.linalg.norm(found[3:7])), found[:3]),
            joints=np.clip(
                found[7 : 7 + count], self.lower_unknowns[7 : 7 + count], self.upper_unknowns[7 : 7 + count]
            ),
        )


def build_problem(surface: ImplicitSurface, hand: Hand, settings: PlannerSettings) -> GeneralProblem:
    """Write problem (1) for an object and a hand of three fingers."""
    began = perf_counter()
    fingers, count = len(hand.fingers), len(hand.joint_names)
    t, wxyz = casadi.MX.sym("t", 3), casadi.MX.sym("wxyz", 4)
    q, c = casadi.MX.sym("q", count), casadi.MX.sym("c", 3, fingers)
    R, pads = _rotation(wxyz), pads_in_palm(hand, q)
    constraints = [casadi.sumsqr(wxyz) - 1]
    for f in range(fingers):
        phi = surface.distance(c[:, f])
        slope = casadi.gradient(phi, c)[:, f]
        normal = slope / casadi.sqrt(casadi.sumsqr(slope) + SLOPE_FLOOR)
        constraints += [phi, R @ pads[f] + t - (c[:, f] + hand.fingers[f].pad_radius * normal)]
    Q = settings.object_weight * object_quality(c) + settings.hand_weight * manipulability(hand, q)
    program = {
        "x": casadi.vertcat(t, wxyz, q, casadi.vec(c)),
        "f": -OBJECTIVE_SCALE * Q,
        "g": casadi.vertcat(*constraints),
    }
    solver = casadi.nlpsol("grasp", "ipopt", program, _OPTIONS)
    unbounded = np.full(7, np.inf)
    return GeneralProblem(
        solver,
        surface,
        np.concatenate([-unbounded, hand.lower, np.tile(surface.lower, fingers)]),
        np.concatenate([unbounded, hand.upper, np.tile(surface.upper, fingers)]),
        perf_counter() - began,
    )


_OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": MAX_ITERATIONS,
    # Of the settings that were tried, these two converged most often on the apple, the bunny and the mug.
    "ipopt.tol": 1e-6,
    "ipopt.mu_init": 1e-3,
}


def _rotation(wxyz: casadi.MX) -> casadi.MX:
    """Rotation matrix of a unit quaternion (4,), (3, 3)."""
    w, axis = wxyz[0], wxyz[1:]
    cross = casadi.skew(axis)
    return casadi.MX.eye(3) + 2 * w * cross + 2 * cross @ cross
