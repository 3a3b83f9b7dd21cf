"""From what a simulation recorded to numbers, a verdict and the frames worth keeping."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingersplit.hands.hand import Hand
from fingersplit.result.verification import PhaseReport, Reason, TrialReport
from fingersplit.transforms import wxyz_from_rotation
from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.motion_kernel import move_in_hand
from fingersplit.verification.protocol import Phase, Protocol, Trial
from fingersplit.verification.simulation import SimulationTrack

__all__ = ["is_decided", "judge_trial", "measure_phase", "motion_in_hand", "phase_rows", "simulation_frames"]

FRAME_RATE = 100.0
"""[1/s]"""
SETTLED_TIME = 0.1
"""Over which the contact forces at the end of a phase are averaged [s]."""
SATURATED_SHARE = 0.1
"""Joints that spend this share of a phase at their torque limit count as saturated."""


DRIFT_FACTOR = 2.0
"""An object that goes on drifting at this many times its rate must stay inside the limits, for an early verdict."""


def phase_rows(phases: Sequence[Phase], step: float, steps: int) -> list[slice]:
    """Rows of a trial's track of ``steps`` rows that belong to each phase that was begun."""
    ends = np.minimum(np.cumsum([round(phase.duration / step) for phase in phases]), steps)
    return [slice(int(begin), int(end)) for begin, end in zip([0, *ends[:-1]], ends, strict=True) if end > begin]


def is_decided(
    protocol: Protocol, center_of_mass: NDArray[np.float64], track: SimulationTrack, time_left: float
) -> bool:
    """Whether a trial's verdict stands before its end.

    It has failed once a limit is passed. After ``decided_after``, the load having been as large as it gets, it will
    hold when the object's motion in the hand and the force of every finger, changing on at ``DRIFT_FACTOR`` times
    their present rates for the time that is left [s], stay inside the limits and above zero.
    """
    if not track.stable:
        return True
    limits = protocol.largest_displacement, protocol.largest_rotation
    motions = motion_in_hand(track, center_of_mass)
    if any(motion.max() > limit for motion, limit in zip(motions, limits, strict=True)):
        return True
    if protocol.decided_after is None or track.times[-1] < protocol.decided_after - 1e-9:
        return False
    step = float(track.times[0])
    settled = min(round(SETTLED_TIME / step), len(track.times) - 1)
    ahead = DRIFT_FACTOR * time_left / (settled * step)  # in units of the settled time
    forces = np.linalg.norm(track.contact_forces[-settled:, :-1], axis=2)  # (n, F)
    before, after = forces[: settled // 2].mean(axis=0), forces[settled // 2 :].mean(axis=0)
    lasting = after + 2.0 * ahead * np.minimum(after - before, 0.0) > 0.0
    inside = [
        motion[-1] + ahead * max(motion[-1] - motion[-1 - settled], 0.0) <= limit
        for motion, limit in zip(motions, limits, strict=True)
    ]
    return all(inside) and (bool(lasting.all()) or not protocol.all_contacts)


def measure_phase(
    hand: Hand,
    name: str,
    track: SimulationTrack,
    rows: slice,
    motions: tuple[NDArray[np.float64], NDArray[np.float64]],
    load: NDArray[np.float64],
) -> PhaseReport:
    """Numbers of one phase; ``motions`` are the track's, from ``motion_in_hand``."""
    step = float(track.times[0])
    settled = slice(max(rows.start, rows.stop - round(SETTLED_TIME / step)), rows.stop)
    displacements, rotations = motions
    torques, limits = track.torques[rows], 0.999 * hand.torque_ranges
    at_limit = (torques >= limits[0]) | (torques <= -limits[1])
    mean_force = track.contact_forces[settled].sum(axis=1).mean(axis=0)
    return PhaseReport(
        name=name,
        duration=(rows.stop - rows.start) * step,
        displacement=float(displacements[rows].max()),
        rotation=float(rotations[rows].max()),
        lost_contacts=tuple(
            finger.name
            for finger, touches in zip(hand.fingers, np.any(track.touching[settled], axis=0).tolist(), strict=True)
            if not touches
        ),
        contact_force=_vector(mean_force),
        load=_vector(load),
        largest_force=float(np.linalg.norm(track.contact_forces[rows], axis=2).max()),
        largest_penetration=float(track.penetrations[rows].max()),
        saturated_joints=tuple(
            joint
            for joint, share in zip(hand.driver_names, at_limit.mean(axis=0), strict=True)
            if share >= SATURATED_SHARE
        ),
    )


def judge_trial(
    hand: Hand,
    protocol: Protocol,
    trial: Trial,
    track: SimulationTrack,
    mass: float,
    center: NDArray[np.float64],
    limited: bool,
) -> TrialReport:
    """Numbers of every phase of a trial, and the verdict on it; ``limited`` says whether torques cap the grip."""
    if not track.stable:
        return TrialReport(trial.name, passed=False, reason="unstable_simulation", phases=())
    motions = motion_in_hand(track, center)
    reports = tuple(
        measure_phase(
            hand, phase.name, track, rows, motions, mass * (np.asarray(trial.gravity) + np.asarray(phase.pull))
        )
        for phase, rows in zip(
            trial.phases, phase_rows(trial.phases, protocol.time_step, len(track.times)), strict=False
        )
    )
    reason = _verdict(protocol, reports, limited)
    return TrialReport(trial.name, passed=reason == "held", reason=reason, phases=reports)


def _verdict(protocol: Protocol, phases: tuple[PhaseReport, ...], limited: bool) -> Reason:
    reason: Reason = "held"
    if max(phase.displacement for phase in phases) > protocol.largest_displacement:
        reason = "slipped"
    elif max(phase.rotation for phase in phases) > protocol.largest_rotation:
        reason = "rotated"
    elif protocol.all_contacts and phases[-1].lost_contacts:
        reason = "contact_lost"
    if reason != "held" and (limited or any(phase.saturated_joints for phase in phases)):
        return "joint_torque_saturated"
    return reason


def motion_in_hand(
    track: SimulationTrack, center_of_mass: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far the centre of mass is from where the track began, (T,) [m], and the object's turn since, (T,) [rad]."""
    distances, turns = np.empty(len(track.times)), np.empty(len(track.times))
    move_in_hand(track.start, track.object_positions, track.object_wxyz, center_of_mass, distances, turns)
    return distances, turns


def simulation_frames(
    object_from_palm: NDArray[np.float64],
    closing: SimulationTrack,
    closing_rows: dict[str, slice],
    trials: Sequence[tuple[Trial, SimulationTrack]],
) -> SimulationFrames:
    """The tracks one after the other, in the world, thinned to ``FRAME_RATE``."""
    stretches = [(name, closing, rows) for name, rows in closing_rows.items()]
    for trial, track in trials:
        phases = phase_rows(trial.phases, float(track.times[0]), len(track.times))
        for phase, rows in zip(trial.phases, phases, strict=False):
            stretches.append((f"{trial.name}: {phase.name}", track, rows))
    strides = [max(1, round(1 / (FRAME_RATE * float(track.times[0])))) for _, track, _ in stretches]
    kept = [
        (track, range(rows.start + stride - 1, rows.stop, stride))
        for (_, track, rows), stride in zip(stretches, strides, strict=True)
    ]
    counts = [len(rows) for _, rows in kept]

    def column(name: str) -> NDArray[np.float64]:
        return np.concatenate([getattr(track, name)[rows] for track, rows in kept])

    intervals = [stride * float(track.times[0]) for (track, _), stride in zip(kept, strides, strict=True)]
    frames, fingers, offsets = sum(counts), closing.touching.shape[1], column("palm_offsets")
    thinned = SimulationFrames(
        times=np.cumsum(np.repeat(intervals, counts)),
        phases=np.repeat(np.arange(len(kept)), counts),
        phase_names=tuple(name for name, _, _ in stretches),
        palm_positions=object_from_palm[:3, 3] + offsets,
        palm_wxyz=np.tile(wxyz_from_rotation(object_from_palm[:3, :3]), (frames, 1)),
        joints=column("joints"),
        object_positions=column("object_positions") + offsets,
        object_wxyz=column("object_wxyz"),
        contact_positions=column("contact_positions")[:, :fingers] + offsets[:, None],
        contact_forces=column("contact_forces")[:, :fingers],
    )
    for values in vars(thinned).values():
        if isinstance(values, np.ndarray):
            values.setflags(write=False)
    return thinned


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
