"""Verify one grasp: place it, close, squeeze, do what the protocol says, judge."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from threading import local
from time import perf_counter
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.friction import DEFAULT_FRICTION
from fingersplit.contacts.grip import GripProblem, least_grip
from fingersplit.contacts.grip_plan import plan_grip
from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.result.verification import (
    GripReport,
    PhaseReport,
    Reason,
    TrialReport,
    Verification,
    explanation,
    is_firm,
    slip_and_turn,
)
from fingersplit.verification.closing import ClosedHand, close_by_frame, close_published, with_opening
from fingersplit.verification.controllers import Controller, PublishedGrip, VirtualFrame, load_controller
from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.judging import is_decided, judge_trial, measure_phase, simulation_frames
from fingersplit.verification.protocol import REFERENCE_FRICTION, Phase, Protocol, Trial
from fingersplit.verification.protocols import load_protocol
from fingersplit.verification.protocols.pick import Pick
from fingersplit.verification.published import Execution
from fingersplit.verification.scene import Scene
from fingersplit.verification.simulation import SimulationTrack, run_trials

__all__ = ["Simulated", "repeat_simulation", "simulate", "verify"]

SIMULATOR = f"MuJoCo {mujoco.__version__}"
SCENES_KEPT = 4


class Simulated(NamedTuple):
    """The report of a verification, and what happened frame by frame; None where nothing was simulated."""

    report: Verification
    frames: SimulationFrames | None


def verify(
    grasp: Grasp,
    hand: Hand,
    model: ObjectModel,
    pieces: ConvexPieces,
    protocol: str | Protocol = "lift",
    *,
    friction: float | Sequence[float] = DEFAULT_FRICTION,
    planned_friction: float = DEFAULT_FRICTION,
    mass: float | None = None,
    controller: str | Controller = "position_servo",
    execution: Execution | None = None,
    threads: int = 1,
) -> Verification:
    """Simulate a grasp and judge it: the same arguments give the same verdict and the same numbers.

    From the pre-grasp the hand closes on the free object, squeezes, and does what the protocol says. The grip is
    planned for ``planned_friction``; the world has ``friction``. A hand cannot feel how slippery an object
    is before it slips, so it does not press harder on one that is more slippery than planned.

    Args:
        grasp: The grasp; what it says of contacts, normals and fingertips is believed for the grip force only.
        hand: Its hand.
        model: The object: centre of mass, and inertia at even density.
        pieces: The same object as the simulation collides it, from ``decompose``.
        protocol: Name of a preset, or a protocol with numbers of one's own.
        friction: Sliding friction between hand and object in the simulation, one number or one a finger.
        planned_friction: Sliding friction that the grip force is planned for.
        mass: Mass of the object [kg]; None for ``model.mass``. A protocol that sets a mass overrules both.
        controller: ``"position_servo"`` and ``"joint_torque"`` execute what is published, ``"virtual_frame"`` plans a
            grip for the protocol's loads; or one with numbers of one's own.
        execution: What is published of how the grasp is executed; None to plan it for ``planned_friction`` and
            ``mass``.
        threads: Trials simulated at a time.

    Raises:
        SettingsError: An unknown protocol or controller, or a friction or mass out of range.
    """
    return simulate(
        grasp,
        hand,
        model,
        pieces,
        protocol,
        friction=friction,
        planned_friction=planned_friction,
        mass=mass,
        controller=controller,
        execution=execution,
        threads=threads,
    ).report


def simulate(
    grasp: Grasp,
    hand: Hand,
    model: ObjectModel,
    pieces: ConvexPieces,
    protocol: str | Protocol = "lift",
    *,
    friction: float | Sequence[float] = DEFAULT_FRICTION,
    planned_friction: float = DEFAULT_FRICTION,
    mass: float | None = None,
    controller: str | Controller = "position_servo",
    execution: Execution | None = None,
    threads: int = 1,
) -> Simulated:
    """What ``verify`` does, with the frames of the simulation; arguments and errors are the same."""
    began = perf_counter()
    protocol = load_protocol(protocol) if isinstance(protocol, str) else protocol
    controller = load_controller(controller) if isinstance(controller, str) else controller
    if isinstance(protocol, Pick):
        raise SettingsError("Protocol 'pick' needs the scene and the ways of a planned grasp; use verify_ranked.")
    sliding = np.broadcast_to(np.asarray(friction, np.float64), len(hand.fingers))
    if not (np.isfinite(sliding).all() and sliding.min() >= 0.0):
        raise SettingsError(f"friction is {friction!r}; give numbers of at least 0, one or one a finger.")
    planned_mass = mass or model.mass
    mass = protocol.mass or planned_mass
    for name, value in (("planned_friction", planned_friction), ("mass", mass)):
        if not (np.isfinite(value) and value > 0.0):
            raise SettingsError(f"{name} is {value!r}; it must be above 0.")
    scene = _scenes.get(hand, pieces)
    scene.set_object(mass, model.center_of_mass, mass / model.mass * model.inertia)
    scene.set_friction(protocol.friction_scale * sliding, protocol.torsional_friction * sliding / REFERENCE_FRICTION)
    scene.model.opt.timestep = protocol.time_step
    scene.place(grasp)
    penetration = float(scene.penetrations().max())
    close: Callable[[], ClosedHand]
    if isinstance(controller, PublishedGrip):
        if execution is None:
            grip = plan_grip(
                grasp, hand, friction=planned_friction, mass=planned_mass, center_of_mass=model.center_of_mass
            )
            execution = Execution(None, grip)
        execution = with_opening(execution, scene, grasp)
        pressed = GripReport.of(execution.grip)
        close = partial(close_published, scene, grasp, protocol, controller, execution)
    else:
        assert isinstance(controller, VirtualFrame)
        frame_grip = least_grip(_grip_problem(scene, grasp, protocol, controller, mass, planned_friction))
        pressed, execution = GripReport.of(frame_grip), None
        close = partial(close_by_frame, scene, grasp, protocol, controller, frame_grip)
    if penetration > protocol.largest_initial_penetration:
        outcome = _Outcome("initial_penetration")
    else:
        outcome = _simulate(scene, grasp, protocol, close, pressed.limited, threads)
    held, (slip, turn) = outcome.reason == "held", slip_and_turn(outcome.trials)
    report = Verification(
        protocol=protocol.name,
        passed=held,
        held_firmly=held and is_firm(slip, turn) and outcome.firm_closing,
        slip=slip,
        turn=turn,
        reason=outcome.reason,
        explanation=explanation(outcome.reason),
        simulator=SIMULATOR,
        settings={
            "protocol": protocol.to_document(),
            "controller": controller.to_document(),
            "execution": None if execution is None else execution.to_document(hand),
            "friction": sliding.tolist(),
            "planned_friction": planned_friction,
            "mass": mass,
            "center_of_mass": model.center_of_mass.tolist(),
            "pieces": {"count": len(pieces.pieces), "method": pieces.method},
            "torque_limits": hand.named(hand.torque_limits),
            "solver": scene.solver_document(),
        },
        initial_penetration=penetration,
        grip=pressed,
        squeeze=outcome.squeeze,
        trials=outcome.trials,
        time_ms=1e3 * (perf_counter() - began),
        closing=outcome.closing,
    )
    return Simulated(report, outcome.frames)


def repeat_simulation(
    report: Verification, grasp: Grasp, hand: Hand, model: ObjectModel, pieces: ConvexPieces
) -> Simulated:
    """Simulate a grasp again by the protocol, controller, friction and mass of an earlier report.

    Raises:
        SettingsError: The report names a protocol, a controller or one of their numbers that this version does not
            know.
    """
    settings = report.settings
    if report.protocol == Pick.name:
        return Simulated(report, None)  # its frames are in another frame than those of grasps held in the hand
    controller, execution = dict(settings["controller"]), settings["execution"]
    return simulate(
        grasp,
        hand,
        model,
        pieces,
        load_protocol(report.protocol, settings["protocol"]),
        friction=settings["friction"],
        planned_friction=settings["planned_friction"],
        mass=settings["mass"],
        controller=load_controller(controller.pop("name"), controller),
        execution=None if execution is None else Execution.from_document(execution, hand),
    )


@dataclass(frozen=True, eq=False)
class _Outcome:
    reason: Reason
    closing: PhaseReport | None = None
    squeeze: PhaseReport | None = None
    trials: tuple[TrialReport, ...] = ()
    frames: SimulationFrames | None = None

    @property
    def firm_closing(self) -> bool:
        """Whether the object stayed where it was while the hand closed."""
        return all(
            phase is None or is_firm(phase.displacement, phase.rotation) for phase in (self.closing, self.squeeze)
        )


def _simulate(
    scene: Scene, grasp: Grasp, protocol: Protocol, close: Callable[[], ClosedHand], limited: bool, threads: int
) -> _Outcome:
    """Close, run every trial, judge."""
    closed = close()
    if not closed.track.stable:
        return _Outcome("unstable_simulation")
    mass, center = float(scene.model.body_mass[scene.object_body]), scene.model.body_ipos[scene.object_body].copy()
    phases = {
        name: measure_phase(scene.hand, name, closed.track, rows, center, np.zeros(3))
        for name, rows in closed.rows.items()
    }
    pairs: list[tuple[Trial, SimulationTrack]] = []
    reports: tuple[TrialReport, ...] = ()
    pushed = any(
        phase.displacement > protocol.largest_displacement or phase.rotation > protocol.largest_rotation
        for phase in phases.values()
    )
    reason: Reason = "object_pushed"
    if not pushed:
        decided = partial(is_decided, protocol, center)
        tracks = run_trials(scene, closed.held, protocol.trials, mass, protocol.decided_after, decided, threads)
        pairs = list(zip(protocol.trials, tracks, strict=True))
        reports = tuple(judge_trial(scene.hand, protocol, *pair, mass, center, limited) for pair in pairs)
        reason = next((trial.reason for trial in reports if trial.reason != "held"), "held")
    frames = simulation_frames(grasp.object_from_palm, protocol.time_step, closed.track, closed.rows, pairs)
    return _Outcome(reason, phases.get("close"), phases["squeeze"], reports, frames)


def _grip_problem(
    scene: Scene, grasp: Grasp, protocol: Protocol, controller: VirtualFrame, mass: float, planned_friction: float
) -> GripProblem:
    """What the grip must do in the scene: carry the object, and keep the fingers on it although they are heavy, too."""
    loads, fastest = [np.zeros(3)], 0.0
    for trial in protocol.trials:
        for phase in trial.phases:
            steady = np.asarray(trial.gravity) + np.asarray(phase.pull)
            accelerations = _extreme_accelerations(phase)
            loads += [steady - acceleration for acceleration in accelerations]
            fastest = max(fastest, float(np.linalg.norm(accelerations, axis=1).max()))
    return GripProblem(
        contacts=grasp.contacts,
        normals=grasp.normals,
        jacobians=scene.finger_jacobians(),
        torque_limits=scene.hand.torque_limits,
        center_of_mass=scene.model.body_ipos[scene.object_body],
        friction=controller.friction_margin * planned_friction,
        least_forces=controller.least_force + controller.load_margin * fastest * scene.finger_masses(),
        loads=controller.load_margin * mass * np.unique(np.round(loads, 6), axis=0),
    )


def _extreme_accelerations(phase: Phase) -> list[NDArray[np.float64]]:
    """Largest palm accelerations of a phase both ways along each axis [m/s^2]; zero alone when it does not move."""
    times = np.linspace(0.0, phase.duration, 201)
    path = phase.motion(times)
    acceleration = np.gradient(np.gradient(path, times, axis=0), times, axis=0)
    extremes = [
        acceleration[row, axis] * np.eye(3)[axis]
        for axis in range(3)
        for row in (acceleration[:, axis].argmin(), acceleration[:, axis].argmax())
    ]
    return [extreme for extreme in extremes if np.abs(extreme).max() > 1e-6] or [np.zeros(3)]


@lru_cache(maxsize=SCENES_KEPT)
def _compiled(hand: Hand, pieces: ConvexPieces) -> Scene:
    return Scene.build(hand, pieces)


class _Scenes(local):
    """Each thread's own copies of the latest compiled scenes."""

    def __init__(self) -> None:
        self.get = lru_cache(maxsize=SCENES_KEPT)(lambda hand, pieces: _compiled(hand, pieces).copy())


_scenes = _Scenes()
