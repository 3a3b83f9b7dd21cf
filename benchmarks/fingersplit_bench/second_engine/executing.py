"""A published grasp executed in the second engine: pre-grasp, closing, squeeze, gravity, lift; judged as ours are."""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator

from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.verification.controllers import closing_path
from fingersplit.verification.judging import is_decided, judge_trial, motion_in_hand
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.published import Execution
from fingersplit.verification.simulation import SimulationTrack, palm_accelerations, trial_loads
from fingersplit_bench.second_engine.world import World, build_world

__all__ = ["TIME_STEP", "Outcome", "execute"]

TIME_STEP = 4e-3
"""[s]"""
CHECK_INTERVAL = 0.1
"""How often a trial is looked at for a verdict that stands [s]."""


@dataclass(frozen=True)
class Outcome:
    """What became of an execution.

    Attributes:
        reason: ``"held"``, or why not, in the words of our own verification.
        phase: The last phase that was begun.
        closing: Farthest that the object was from its place while the hand closed and squeezed [m].
        closing_turn: Its largest turn then [rad].
        slip: Farthest that it was from where the squeeze had left it [m]; None where it was not lifted.
        turn: Its largest turn since [rad]; None where it was not lifted.
        lost: Fingers that do not touch at the end.
        forces: Mean force of every finger on the object over the last 0.1 s, (F,) [N].
        seconds: CPU time [s].
    """

    reason: str
    phase: str
    closing: float
    closing_turn: float
    slip: float | None
    turn: float | None
    lost: tuple[str, ...]
    forces: tuple[float, ...]
    seconds: float

    @property
    def held(self) -> bool:
        """Whether it counts as held."""
        return self.reason == "held"


def execute(
    grasp: Grasp,
    hand: Hand,
    model: ObjectModel,
    protocol: Protocol,
    execution: Execution,
    *,
    mass: float,
    friction: float,
    step: float = TIME_STEP,
    pieces: ConvexPieces | None = None,
) -> Outcome:
    """Execute a grasp as published and judge it by the protocol's limits.

    Args:
        grasp: The grasp.
        hand: Its hand.
        model: The object.
        protocol: Times, limits, and its first trial.
        execution: What is published, with an opening.
        mass: Of the object [kg].
        friction: Between hand and object.
        step: Time step [s].
        pieces: What the object collides as; None for its own triangles.
    """
    began = process_time()
    protocol = protocol.with_values({"time_step": step, "closing_step": step})
    world = build_world(hand, model, grasp, execution, mass=mass, friction=friction, step=step, pieces=pieces)
    run = _Run(world, step)
    assert execution.opened is not None
    names = hand.joint_names
    opened, closed, targets = (
        joints[[names.index(name) for name in hand.driver_names]]
        for joints in (execution.opened, grasp.joints, execution.grip.targets)
    )
    steps = round(protocol.closing_time / step), round(protocol.squeeze_time / step)
    run.set_joints(execution.opened)
    still = np.zeros((sum(steps), 3))
    closing = run.advance(closing_path(opened, closed, targets, steps), still, still)
    motions = motion_in_hand(closing, model.center_of_mass)
    moved, turned = float(motions[0].max(initial=0.0)), float(motions[1].max(initial=0.0))
    limits = protocol.largest_displacement, protocol.largest_rotation
    if not closing.stable or moved > limits[0] or turned > limits[1]:
        reason = "object_pushed" if closing.stable else "unstable_simulation"
        return _outcome(hand, reason, "closing", closing, (moved, turned), None, began)

    trial = protocol.trials[0]
    path, pulls = trial_loads(trial, mass, step)
    accelerations = palm_accelerations(path, step)
    loads = pulls + mass * (np.asarray(trial.gravity) - accelerations)

    def ends(track: SimulationTrack) -> bool:
        late = protocol.decided_after is not None and track.times[-1] >= protocol.decided_after
        motions = motion_in_hand(track, model.center_of_mass)
        passed = any(motion.max() > limit for motion, limit in zip(motions, limits, strict=True))
        left = (len(path) - len(track.times)) * step
        return passed or (late and is_decided(protocol, model.center_of_mass, track, left))

    track = run.advance(np.tile(targets, (len(path), 1)), loads, -accelerations, ends)
    report = judge_trial(hand, protocol, trial, track, mass, model.center_of_mass, limited=False)
    phase = report.phases[-1].name if report.phases else trial.phases[0].name
    after = motion_in_hand(track, model.center_of_mass) if track.stable else None
    return _outcome(hand, report.reason, phase, track, (moved, turned), after, began)


def _outcome(
    hand: Hand,
    reason: str,
    phase: str,
    track: SimulationTrack,
    closing: tuple[float, float],
    after: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
    began: float,
) -> Outcome:
    last = slice(-round(0.1 / TIME_STEP), None)
    forces = np.linalg.norm(track.contact_forces[last, :-1], axis=2).mean(axis=0)
    touching: list[bool] = np.any(track.touching[last], axis=0).tolist()
    return Outcome(
        reason=reason,
        phase=phase,
        closing=closing[0],
        closing_turn=closing[1],
        slip=None if after is None else float(after[0].max()),
        turn=None if after is None else float(after[1].max()),
        lost=tuple(finger.name for finger, touches in zip(hand.fingers, touching, strict=True) if not touches),
        forces=tuple(forces.tolist()),
        seconds=process_time() - began,
    )


class _Run:
    """A world in motion."""

    def __init__(self, world: World, step: float) -> None:
        self.world, self.step, self.steps = world, step, 0
        self.simulator = Simulator(world.diagram)
        self.context = world.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        plant, hand = world.plant, world.hand
        self.columns = [None if joint is None else joint.position_start() for joint in world.joints]
        self.object_columns = world.object_body.floating_positions_start()
        self.servos = plant.get_desired_state_input_port(world.hand_instance)
        self.references = np.array([joint.reference for joint in hand.model.joints])
        self.driver_references = self.references[[hand.joint_names.index(name) for name in hand.driver_names]]
        self.bodies = [*world.links[1:], world.object_body]
        self.forces = plant.get_applied_spatial_force_input_port()

    def set_joints(self, joints: NDArray[np.float64]) -> None:
        """Joint angles (N,) [rad], everything at rest; the object where it was planned."""
        positions = np.zeros(self.world.plant.num_positions())
        for column, angle in zip(self.columns, joints - self.references, strict=True):
            if column is not None:
                positions[column] = angle
        positions[self.object_columns] = 1.0  # the unit quaternion comes first
        self.world.plant.SetPositions(self.context, positions)
        self.simulator.Initialize()

    def advance(
        self,
        drivers: NDArray[np.float64],
        loads: NDArray[np.float64],
        inertial: NDArray[np.float64],
        ends: Callable[[SimulationTrack], bool] = lambda _: False,
    ) -> SimulationTrack:
        """Simulate rows of servo angles (T, A) [rad].

        Args:
            drivers: What the servos are sent.
            loads: Force on the object's centre of mass, (T, 3) [N].
            inertial: Force for each kg of the hand's moving links, (T, 3) [N/kg].
            ends: Whether a track may end here; asked every ``CHECK_INTERVAL``.
        """
        start, rows, stable = self._object_pose(), [], True
        every = max(1, round(CHECK_INTERVAL / self.step))
        for number, (angles, load, force) in enumerate(zip(drivers, loads, inertial, strict=True), 1):
            values = np.concatenate([angles - self.driver_references, np.zeros(len(angles))])
            self.servos.FixValue(self.context, values)
            self.forces.FixValue(self.context, self._applied(load, force))
            self.steps += 1
            try:
                self.simulator.AdvanceTo(self.steps * self.step)
            except RuntimeError:  # the contact solver did not converge
                stable = False
                break
            rows.append(self._row())
            if number % every == 0 and number < len(drivers) and ends(self._track(start, rows, stable)):
                break
        return self._track(start, rows, stable)

    def _applied(self, load: NDArray[np.float64], inertial: NDArray[np.float64]) -> list[Any]:
        applied = []
        for body in self.bodies:
            each = ExternallyAppliedSpatialForce()
            each.body_index = body.index()
            each.p_BoBq_B = body.default_com()
            force = load if body is self.world.object_body else body.default_mass() * inertial
            each.F_Bq_W = SpatialForce(np.zeros(3), force)
            applied.append(each)
        return applied

    def _object_pose(self) -> NDArray[np.float64]:
        """Position [m] and quaternion of the object, (7,)."""
        quaternion_first = self.world.plant.GetPositions(self.context)[self.object_columns : self.object_columns + 7]
        return np.concatenate([quaternion_first[4:], quaternion_first[:4]])

    def _row(self) -> tuple[Any, ...]:
        """Joints, object pose, forces and positions by finger, then palm, and the servos' torques."""
        world, count = self.world, len(self.world.hand.fingers)
        positions = world.plant.GetPositions(self.context)
        joints = self.references + [0.0 if column is None else positions[column] for column in self.columns]
        forces, weighted, weights = np.zeros((count + 1, 3)), np.zeros((count + 1, 3)), np.zeros(count + 1)
        results = world.plant.get_contact_results_output_port().Eval(self.context)
        for number in range(results.num_hydroelastic_contacts()):
            info = results.hydroelastic_contact_info(number)
            surface = info.contact_surface()
            first, second = surface.id_M(), surface.id_N()
            sign = 1.0 if first in world.surfaces else -1.0  # the force is that on the first of the two
            part = world.parts.get(second if sign > 0.0 else first)
            if part is None or not {first, second} & world.surfaces:
                continue
            force = sign * info.F_Ac_W().translational()
            size = float(np.linalg.norm(force))
            forces[part] += force
            weighted[part] += size * surface.centroid()
            weights[part] += size
        places = weighted / np.maximum(weights, 1e-12)[:, None]
        torques = world.plant.get_net_actuation_output_port(world.hand_instance).Eval(self.context)
        return joints, self._object_pose(), forces, places, weights[:-1] > 0.0, torques

    def _track(self, start: NDArray[np.float64], rows: list[tuple[Any, ...]], stable: bool) -> SimulationTrack:
        joints, poses, forces, places, touching, torques = (np.array(column) for column in zip(*rows, strict=True))
        return SimulationTrack(
            times=self.step * np.arange(1, len(rows) + 1, dtype=np.float64),
            stable=stable and bool(np.isfinite(poses).all()),
            start=start,
            palm_offsets=np.zeros((len(rows), 3)),
            joints=joints,
            object_positions=poses[:, :3],
            object_wxyz=poses[:, 3:],
            touching=touching,
            contact_forces=forces,
            contact_positions=places,
            penetrations=np.zeros(len(rows)),
            torques=torques,
        )
