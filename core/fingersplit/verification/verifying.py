"""Verify one grasp: place it, close, squeeze, do what the protocol says, judge."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from threading import local
from time import perf_counter
from typing import Any, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.friction import DEFAULT_FRICTION
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
from fingersplit.verification.frame_grip import frame_grip
from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.judging import is_decided, judge_trial, measure_phase, motion_in_hand, simulation_frames
from fingersplit.verification.protocol import Protocol, Trial, torsion_in
from fingersplit.verification.protocols import load_protocol
from fingersplit.verification.protocols.pick import Pick
from fingersplit.verification.published import Execution
from fingersplit.verification.scene import Driven, Scene
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
    began = perf_counter()
    task = _Task.of(grasp, hand, model, pieces, protocol, friction, planned_friction, mass, controller, execution)
    return _report(task, _outcome(task, threads), perf_counter() - began)


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
    task = _Task.of(grasp, hand, model, pieces, protocol, friction, planned_friction, mass, controller, execution)
    outcome = _outcome(task, threads)
    frames = None if outcome.frames is None else outcome.frames()
    return Simulated(_report(task, outcome, perf_counter() - began), frames)


@dataclass(frozen=True, eq=False)
class _Task:
    """What is to be verified, with every number checked.

    Attributes:
        planned_mass: Mass that the grip is planned for where none is published [kg].
        mass: Mass in the simulation [kg].
        friction: Sliding friction of each finger in the simulation, (F,).
    """

    grasp: Grasp
    hand: Hand
    model: ObjectModel
    pieces: ConvexPieces
    protocol: Protocol
    controller: Controller
    execution: Execution | None
    friction: NDArray[np.float64]
    planned_friction: float
    planned_mass: float
    mass: float

    @classmethod
    def of(
        cls,
        grasp: Grasp,
        hand: Hand,
        model: ObjectModel,
        pieces: ConvexPieces,
        protocol: str | Protocol,
        friction: float | Sequence[float],
        planned_friction: float,
        mass: float | None,
        controller: str | Controller,
        execution: Execution | None,
    ) -> Self:
        protocol = load_protocol(protocol) if isinstance(protocol, str) else protocol
        controller = load_controller(controller) if isinstance(controller, str) else controller
        if isinstance(protocol, Pick):
            raise SettingsError(
                f"Protocol {protocol.name!r} needs the scene and the ways of a planned grasp; use verify_ranked."
            )
        sliding = np.broadcast_to(np.asarray(friction, np.float64), len(hand.fingers))
        if not (np.isfinite(sliding).all() and sliding.min() >= 0.0):
            raise SettingsError(f"friction is {friction!r}; give numbers of at least 0, one or one a finger.")
        planned_mass = model.mass if mass is None else mass
        for name, value in (("planned_friction", planned_friction), ("mass", planned_mass)):
            if not (np.isfinite(value) and value > 0.0):
                raise SettingsError(f"{name} is {value!r}; it must be above 0.")
        simulated_mass = planned_mass if protocol.mass is None else protocol.mass
        return cls(
            grasp,
            hand,
            model,
            pieces,
            protocol,
            controller,
            execution,
            sliding,
            planned_friction,
            planned_mass,
            simulated_mass,
        )


def _outcome(task: _Task, threads: int) -> "_Outcome":
    """Set the scene and simulate."""
    protocol, model, mass, grasp = task.protocol, task.model, task.mass, task.grasp
    scene = _scenes.get(task.hand, task.pieces, task.controller.driven)
    scene.set_object(mass, model.center_of_mass, mass / model.mass * model.inertia)
    scene.place(grasp)
    penetration = float(scene.penetrations().max())
    execution: Execution | None = None
    close: Callable[[], ClosedHand]
    if isinstance(task.controller, PublishedGrip):
        execution = with_opening(_execution(task), scene, grasp)
        pressed = GripReport.of(execution.grip)
        close = partial(close_published, scene, grasp, protocol, task.controller, execution)
    else:
        assert isinstance(task.controller, VirtualFrame)
        grip = frame_grip(scene, grasp, protocol, task.controller, mass, task.planned_friction)
        pressed = GripReport.of(grip)
        close = partial(close_by_frame, scene, grasp, protocol, task.controller, grip)
    torsional = torsion_in(protocol, task.friction, pressed.normal_forces(grasp.normals), task.hand)
    scene.set_friction(protocol.friction_scale * task.friction, torsional)
    setting = _Setting(
        scene.solver_document(protocol.time_step), penetration, pressed, execution, tuple(torsional.tolist())
    )
    if penetration > protocol.largest_initial_penetration:
        return _Outcome("initial_penetration", setting)
    return _simulate(scene, task, setting, close, threads)


def _execution(task: _Task) -> Execution:
    """What is published, or what would be."""
    if task.execution is not None:
        return task.execution
    center = task.model.center_of_mass
    grip = plan_grip(
        task.grasp, task.hand, friction=task.planned_friction, mass=task.planned_mass, center_of_mass=center
    )
    return Execution(None, grip)


def _report(task: _Task, outcome: "_Outcome", seconds: float) -> Verification:
    setting, held = outcome.setting, outcome.reason == "held"
    slip, turn = slip_and_turn(outcome.trials)
    return Verification(
        protocol=task.protocol.name,
        passed=held,
        held_firmly=held and is_firm(slip, turn) and outcome.firm_closing,
        slip=slip,
        turn=turn,
        reason=outcome.reason,
        explanation=explanation(outcome.reason),
        simulator=SIMULATOR,
        settings={
            "protocol": task.protocol.to_document(),
            "controller": task.controller.to_document(),
            "execution": None if setting.execution is None else setting.execution.to_document(task.hand),
            "friction": task.friction.tolist(),
            "torsional_friction": list(setting.torsional_friction),
            "planned_friction": task.planned_friction,
            "mass": task.mass,
            "center_of_mass": task.model.center_of_mass.tolist(),
            "pieces": {"count": len(task.pieces.pieces), "method": task.pieces.method},
            "torque_limits": task.hand.named(task.hand.torque_ranges[0]),
            "torque_limits_backwards": task.hand.named(task.hand.torque_ranges[1]),
            "solver": setting.solver,
        },
        initial_penetration=setting.penetration,
        grip=setting.grip,
        squeeze=outcome.squeeze,
        trials=outcome.trials,
        time_ms=1e3 * seconds,
        closing=outcome.closing,
        touching=outcome.touching(task.hand),
    )


def repeat_simulation(
    report: Verification, grasp: Grasp, hand: Hand, model: ObjectModel, pieces: ConvexPieces
) -> Simulated:
    """Simulate a grasp again by the protocol, controller, friction and mass of an earlier report.

    Raises:
        SettingsError: The report names a protocol, a controller or one of their numbers that this version does not
            know.
    """
    settings = report.settings
    if isinstance(load_protocol(report.protocol), Pick):
        return Simulated(report, None)  # needs what stands around: see ``ResultPicks.frames``
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
class _Setting:
    """What a simulation begins with, as reports state it."""

    solver: dict[str, Any]
    penetration: float
    grip: GripReport
    execution: Execution | None
    torsional_friction: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Outcome:
    reason: Reason
    setting: _Setting
    closing: PhaseReport | None = None
    squeeze: PhaseReport | None = None
    trials: tuple[TrialReport, ...] = ()
    frames: Callable[[], SimulationFrames] | None = None

    def touching(self, hand: Hand) -> tuple[str, ...] | None:
        """Fingers that touched when the hand had closed."""
        if self.squeeze is None:
            return None
        return tuple(finger.name for finger in hand.fingers if finger.name not in self.squeeze.lost_contacts)

    @property
    def firm_closing(self) -> bool:
        """Whether the object stayed where it was while the hand closed."""
        phases = [phase for phase in (self.closing, self.squeeze) if phase is not None]
        return all(is_firm(phase.displacement, phase.rotation) for phase in phases)


def _simulate(scene: Scene, task: _Task, setting: _Setting, close: Callable[[], ClosedHand], threads: int) -> _Outcome:
    """Close, run every trial, judge."""
    protocol, closed = task.protocol, close()
    if not closed.track.stable:
        return _Outcome("unstable_simulation", setting)
    mass, center = task.mass, scene.model.body_ipos[scene.object_body].copy()
    motions = motion_in_hand(closed.track, center)
    phases = {
        name: measure_phase(scene.hand, name, closed.track, rows, motions, np.zeros(3))
        for name, rows in closed.rows.items()
    }
    pairs: list[tuple[Trial, SimulationTrack]] = []
    reports: tuple[TrialReport, ...] = ()
    pushed = motions[0].max() > protocol.largest_displacement or motions[1].max() > protocol.largest_rotation
    reason: Reason = "object_pushed"
    if not pushed:
        scene.model.opt.timestep = protocol.time_step
        decided = partial(is_decided, protocol, center)
        tracks = run_trials(scene, closed.held, protocol.trials, mass, protocol.decided_after, decided, threads)
        pairs = list(zip(protocol.trials, tracks, strict=True))
        limited = setting.grip.limited
        reports = tuple(judge_trial(scene.hand, protocol, *pair, mass, center, limited) for pair in pairs)
        reason = next((trial.reason for trial in reports if trial.reason != "held"), "held")
    palm = task.grasp.object_from_palm
    frames = partial(simulation_frames, palm, closed.track, closed.rows, pairs)
    return _Outcome(reason, setting, phases.get("close"), phases["squeeze"], reports, frames)


@lru_cache(maxsize=SCENES_KEPT)
def _compiled(hand: Hand, pieces: ConvexPieces, driven: Driven) -> Scene:
    return Scene.build(hand, pieces, driven)


class _Scenes(local):
    """Each thread's own copies of the latest compiled scenes."""

    def __init__(self) -> None:
        self.get = lru_cache(maxsize=SCENES_KEPT)(lambda *parts: _compiled(*parts).copy())


_scenes = _Scenes()
