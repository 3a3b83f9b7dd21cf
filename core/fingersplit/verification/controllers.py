"""Controllers of a held grasp, as actuators inside the simulation: no step of theirs leaves the compiled loop.

A scene carries the actuators of what a controller moves, the joints or the fingertips; the controller sets their gains
and says what goes into their control inputs. `PositionServo` and `JointTorque` execute what is published with a grasp;
`VirtualFrame` computes a grip of its own for the loads of the protocol.
"""

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip
from fingersplit.contacts.grip_plan import GripPlan
from fingersplit.errors import SettingsError, suggestion
from fingersplit.ranges import check_known, check_settings, setting
from fingersplit.registry import first_line
from fingersplit.verification.scene import Driven, Scene

__all__ = [
    "Controller",
    "JointTorque",
    "PositionServo",
    "PublishedGrip",
    "VirtualFrame",
    "available_controllers",
    "closing_path",
    "load_controller",
]


@dataclass(frozen=True)
class Controller(ABC):
    """How a hand is controlled.

    Raises:
        SettingsError: A value outside its range.
    """

    name: ClassVar[str]
    """How requests call it."""
    driven: ClassVar[Driven] = "joints"
    """What it moves."""

    def __post_init__(self) -> None:
        check_settings(self, f"{{}} of controller {self.name!r}")

    def to_document(self) -> dict[str, Any]:
        """Name and numbers as plain JSON data."""
        return {"name": self.name, **asdict(self)}

    def info(self) -> dict[str, Any]:
        """Name, meaning and numbers, for lists of what there is."""
        return {"name": self.name, "meaning": first_line(type(self)), "numbers": asdict(self)}


def closing_path(
    opened: NDArray[np.float64], closed: NDArray[np.float64], targets: NDArray[np.float64], steps: tuple[int, int]
) -> NDArray[np.float64]:
    """Angles (T, A) [rad] that servos are sent while a hand closes and squeezes.

    Args:
        opened: Drivers to begin with, (A,) [rad].
        closed: Drivers of the planned grasp, (A,) [rad].
        targets: Drivers of the squeeze, (A,) [rad].
        steps: Steps from ``opened`` to ``closed``, and on to ``targets``; of the latter the last third lets the hand
            come to rest.
    """
    shares = np.arange(1, steps[0] + 1) / steps[0]
    closing = shares**3 * (10 - 15 * shares + 6 * shares**2)  # the curve of least jerk ends without velocity
    pressing = np.clip(np.linspace(0.0, 1.5, steps[1]), 0.0, 1.0)
    return np.vstack([opened + np.outer(closing, closed - opened), closed + np.outer(pressing, targets - closed)])


@dataclass(frozen=True)
class PublishedGrip(Controller):
    """Executes what stands in the answer: joints from pre-grasp to grasp and on, by servos of the stated stiffness."""

    def close(
        self,
        scene: Scene,
        grip: GripPlan,
        opened: NDArray[np.float64],
        closed: NDArray[np.float64],
        steps: tuple[int, int],
    ) -> NDArray[np.float64]:
        """Controls (T, n_controls) that close the hand.

        Args:
            scene: The scene.
            grip: What is published.
            opened: Joints to begin with, (N,) [rad].
            closed: Joints of the planned grasp, (N,) [rad].
            steps: As ``closing_path`` takes them.
        """
        scene.set_gains(scene.joint_controls, grip.stiffness, grip.damping)
        first, planned, last = (scene.drivers_of(joints) for joints in (opened, closed, grip.targets))
        path = closing_path(first, planned, last, steps)
        controls = np.zeros((len(path), scene.model.nu))
        controls[:, scene.joint_controls] = path
        return controls

    @abstractmethod
    def hold(self, scene: Scene, grip: GripPlan, closing: NDArray[np.float64]) -> NDArray[np.float64]:
        """Controls (n_controls,) that hold on, given the last of the closing; the scene stands as that left it."""


@dataclass(frozen=True)
class PositionServo(PublishedGrip):
    """For hands that take positions: the published targets, come what may."""

    name: ClassVar[str] = "position_servo"

    def hold(self, _scene: Scene, _grip: GripPlan, closing: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same targets."""
        return closing


@dataclass(frozen=True)
class JointTorque(PublishedGrip):
    """For hands that take torques: the published torques, and stiffness about where the fingers came to rest.

    Until they have closed it is the position servos' stiffness about the same path.
    """

    name: ClassVar[str] = "joint_torque"

    def hold(self, scene: Scene, grip: GripPlan, closing: NDArray[np.float64]) -> NDArray[np.float64]:
        """Targets off the measured angles by torque over stiffness, which is the torque plus stiffness about them."""
        controls = closing.copy()
        controls[scene.joint_controls] = scene.data.qpos[scene.driver_qpos] + grip.torques / grip.stiffness
        return controls


@dataclass(frozen=True)
class VirtualFrame(Controller):
    """The virtual-frame controller of [Tahara2010] and [Li2016], torques J^T f plus gravity compensation.

    Grip: the tips of every pair of fingers pull towards each other in proportion to their distance,
    f_i = sum_j k_ij (x_j - x_i). With k_ij = K_g / F this is the papers' K_g (o - x_i) about the mean o; other weights
    move the point the fingers pull to. Forces and moments sum to zero exactly.

    Object: each tip is drawn to its place x_i^d in the palm by K (x_i^d - x_i). Summed over the fingers that is
    F K (o^d - o) on the virtual frame's origin and K sum r_i x r_i^d on its axes, that is K_t = F K and K_r = K; what
    is left are the fingertips' stiffnesses about their places in the virtual frame. Once the fingers have closed, the
    places where they came to rest are the ones to keep, so that the grip is all of the internal force.
    """

    name: ClassVar[str] = "virtual_frame"
    driven: ClassVar[Driven] = "fingertips"

    load_margin: float = setting(1.5, "1", "The grip carries this many times the load.", 0.1, 10.0)
    friction_margin: float = setting(0.8, "1", "Share of the planned friction that the grip relies on.", 0.1, 1.0)
    least_force: float = setting(1.0, "N", "Every finger presses with at least this.", 0.0, 30.0)
    stiffness: float = setting(1000.0, "N/m", "Stiffness K of a fingertip about its place.", 0.0, 1e4)
    closing_stiffness: float = setting(50.0, "N/m", "The same while the fingers close.", 0.0, 1e4)
    damping: float = setting(30.0, "N s/m", "Damping of a fingertip.", 0.0, 1e3)

    def prepare(self, scene: Scene) -> None:
        """Fingertip servos at their closing stiffness."""
        scene.set_gains(scene.servo_controls.ravel(), self.closing_stiffness, self.damping)

    def close(self, scene: Scene, grip: Grip, ramp: NDArray[np.float64]) -> NDArray[np.float64]:
        """Controls (T, n_controls) that pull the fingertips together about their planned places.

        They do so more and more, as ``ramp`` (T,) goes from 0 to 1. The scene stands in the planned grasp.
        """
        controls = np.zeros((len(ramp), scene.model.nu))
        controls[:, scene.servo_controls] = scene.grips_in_palm()
        a, b = scene.pairs.T
        tips = scene.grips_in_palm()
        controls[:, scene.pair_controls] = np.outer(ramp, grip.pulls / np.linalg.norm(tips[a] - tips[b], axis=1))
        return controls

    def hold(self, scene: Scene, closing: NDArray[np.float64]) -> NDArray[np.float64]:
        """Keep the grip, and the fingertips where they are."""
        scene.set_gains(scene.servo_controls.ravel(), self.stiffness, self.damping)
        controls = closing.copy()
        controls[scene.servo_controls] = scene.grips_in_palm()
        return controls


def available_controllers() -> dict[str, Controller]:
    """Every controller by name, with its usual numbers, the default one first."""
    return {kind.name: kind() for kind in (PositionServo, JointTorque, VirtualFrame)}


def load_controller(name: str, values: dict[str, Any] | None = None) -> Controller:
    """A controller, with some of its numbers replaced.

    Raises:
        SettingsError: No such controller or no such number; the message lists the known ones.
    """
    known = available_controllers()
    if name not in known:
        raise SettingsError(f"Unknown controller {name!r}; {suggestion(name, known)}")
    check_known(values or {}, known[name], f"Controller {name!r} has no number {{}}")
    return replace(known[name], **(values or {}))
