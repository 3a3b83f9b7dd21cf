"""What changes in a recording from row to row: the planner's states, then the simulation's frames."""

from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import available_metrics
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.objects.model import ObjectModel
from fingersplit.recording import colors
from fingersplit.recording.posing import Poses, points_in_collision, pose_links, reference_points, turn_z_to
from fingersplit.splitting.trace import HAND_QUALITY, OBJECT_QUALITY, PENETRATION, PHASE_NAMES, QUALITY, Trace
from fingersplit.splitting.trace_kernel import CPO
from fingersplit.verification import SimulationFrames

with extra("recording"):
    import rerun as rr

__all__ = [
    "CONE_HEIGHT",
    "RecordedFrames",
    "phases_of",
    "planning_indexes",
    "record_planning",
    "record_simulation",
    "simulation_indexes",
]

CONE_HEIGHT = 0.018
"""Length of the drawn friction cones [m]."""
NORMAL_LENGTH = 0.03
"""[m]"""


def record_planning(stream: rr.RecordingStream, trace: Trace, model: ObjectModel, hand: Hand, friction: float) -> None:
    """Write all that changes from state to state, except where the bodies stand.

    Args:
        stream: The recording.
        trace: The accepted states, T of them.
        model: The object.
        hand: The hand.
        friction: Coulomb friction coefficient.
    """
    _record_contacts(stream, trace)
    _record_contact_steps(stream, trace, model)
    _record_collisions(stream, trace, model, hand)
    _record_quality(stream, trace)
    _record_metrics(stream, trace, model, friction)
    _record_constraints(stream, trace, hand)


def planning_indexes(rows: NDArray[np.int64]) -> list[rr.TimeColumn]:
    """Where planning rows stand in time."""
    return [rr.TimeColumn("step", sequence=rows), rr.TimeColumn("iteration", sequence=rows)]


def phases_of(trace: Trace) -> list[tuple[str, int, int]]:
    """Every stretch of states of one phase: its name, its first row, and the row after its last."""
    stretches, row = [], 0
    for phase, group in groupby(trace.phases.tolist()):
        end = row + len(list(group))
        stretches.append((PHASE_NAMES[phase], row, end))
        row = end
    return stretches


def _send(stream: rr.RecordingStream, entity: str, rows: NDArray[np.int64], *columns: rr.ComponentColumnList) -> None:
    stream.send_columns(entity, planning_indexes(rows), [column for group in columns for column in group])


def _record_contacts(stream: rr.RecordingStream, trace: Trace) -> None:
    """Contacts, outward normals and friction cones: one mesh for all cones, an instance for each contact."""
    rows, contacts, normals = np.arange(len(trace)), trace.contacts, trace.normals
    _send(stream, "world/contacts", rows, rr.Points3D.columns(positions=contacts))
    arrows = rr.Arrows3D.columns(origins=contacts, vectors=NORMAL_LENGTH * normals)
    _send(stream, "world/contacts/normals", rows, arrows)
    cones = rr.InstancePoses3D.columns(translations=contacts, quaternions=turn_z_to(normals))
    _send(stream, "world/contacts/cones", rows, cones)


def _record_contact_steps(stream: rr.RecordingStream, trace: Trace, model: ObjectModel) -> None:
    """Tangent steps of CPO, and the surface points they lead to; the other rows are empty."""
    rows, fingers = np.arange(len(trace)), trace.contacts.shape[1]
    stepped = np.flatnonzero(trace.phases == CPO)
    before, steps = trace.contacts[stepped - 1].reshape(-1, 3), trace.contact_steps[stepped].reshape(-1, 3)
    counts = np.where(trace.phases == CPO, fingers, 0)
    arrows = rr.Arrows3D.columns(origins=before, vectors=steps)
    _send(stream, "world/cpo/tangent_steps", rows, arrows.partition(counts))
    points = rr.Points3D.columns(positions=reference_points(model, before + steps))
    _send(stream, "world/cpo/reference_points", rows, points.partition(counts))


def _record_collisions(stream: rr.RecordingStream, trace: Trace, model: ObjectModel, hand: Hand) -> None:
    """Collision points inside the hand; only states that the planner found penetrating are looked at."""
    rows = np.arange(len(trace))
    looked_at = trace.scores[:, PENETRATION] > 0
    states = trace.joints[looked_at], trace.palm_rotations[looked_at], trace.palm_positions[looked_at]
    found, counts = points_in_collision(hand, model, *states), np.zeros(len(trace), dtype=np.int64)
    counts[looked_at] = [len(points) for points in found]
    points = rr.Points3D.columns(positions=np.vstack([*found, np.empty((0, 3))])).partition(counts)
    _send(stream, "world/collision_points", rows, points)


def _record_quality(stream: rr.RecordingStream, trace: Trace) -> None:
    """Q in the colour of the phase that led to the state, and its two parts."""
    rows = np.arange(len(trace))
    palette = np.array([colors.rgba(colors.PHASES[name]) for name in PHASE_NAMES], dtype=np.uint8)
    lines = rr.SeriesLines.columns(colors=palette[trace.phases])
    _send(stream, "quality/Q", rows, rr.Scalars.columns(scalars=trace.scores[:, QUALITY]), lines)
    for entity, column in (("quality_parts/w1_Q_o", OBJECT_QUALITY), ("quality_parts/w2_Q_h", HAND_QUALITY)):
        _send(stream, entity, rows, rr.Scalars.columns(scalars=trace.scores[:, column]))


def _record_metrics(stream: rr.RecordingStream, trace: Trace, model: ObjectModel, friction: float) -> None:
    """Every metric at as many states as it asks for, spread evenly from the first to the last."""
    states = [
        GraspState(WrenchSpace(contacts, normals, friction, model.center_of_mass, model.radius), scores[:3])
        for contacts, normals, scores in zip(trace.contacts, trace.normals, trace.scores, strict=True)
    ]
    for metric in available_metrics().values():
        count = len(states) if metric.recorded_states is None else metric.recorded_states
        rows = np.unique(np.linspace(0, len(states) - 1, count).round().astype(np.int64))
        values = [metric.function(states[row]) for row in rows]
        known = [value is not None for value in values]
        if any(known):
            scalars = rr.Scalars.columns(scalars=[value for value in values if value is not None])
            _send(stream, f"metrics/{metric.curve}", rows[known], scalars)


def _record_constraints(stream: rr.RecordingStream, trace: Trace, hand: Hand) -> None:
    """What must stay small: gaps between pads and surface, tilts of the pads, penetration."""
    rows = np.arange(len(trace))
    for f, finger in enumerate(hand.fingers):
        for entity, values in (
            (f"constraints/gap_mm/{finger.name}", 1e3 * trace.residuals[:, f]),
            (f"constraints/pad_angle_rad/{finger.name}", trace.pad_angles[:, f]),
        ):
            _send(stream, entity, rows, rr.Scalars.columns(scalars=values))
    penetrations = rr.Scalars.columns(scalars=1e3 * trace.scores[:, PENETRATION])
    _send(stream, "constraints/gap_mm/penetration", rows, penetrations)


ARROW_LENGTH = 0.06
"""Of the largest contact force of a simulation [m]."""
MIN_FORCE = 1e-3
"""Smaller contact forces are not drawn [N]."""
MAX_FRAMES = 500
"""Of longer simulations every second, third ... frame is recorded."""


class RecordedFrames:
    """The usable frames of a simulation: up to the first that is not finite.

    Args:
        series: The verification's time series.
        hand: The hand that was simulated.

    Attributes:
        times: Simulated time of every frame, (T,) [s].
        phases: Name of every frame's phase.
        object_poses: ``world_from_object``, one body.
        hand_poses: ``world_from_link`` of the hand's links, see ``posing.hand_links``.
        contacts: Contact points, (T, F, 3) [m].
        forces: Contact forces on the object, (T, F, 3) [N].
        slips: How far the object has moved in the palm since the hand began to close, (T,) [m].
        turns: How far it has turned in the palm since then, (T,) [rad].
    """

    def __init__(self, series: SimulationFrames, hand: Hand) -> None:
        numbers = (series.palm_positions, series.joints, series.object_positions, series.contact_forces)
        finite = np.logical_and.reduce([np.isfinite(one).reshape(len(one), -1).all(axis=1) for one in numbers])
        usable = len(finite) if finite.all() else int(finite.argmin())
        frames = slice(0, usable, -(-usable // MAX_FRAMES) or None)
        self.times: NDArray[np.float64] = series.times[frames]
        self.phases = [str(series.phase_names[phase]) for phase in series.phases[frames]]
        palms = Rotation.from_quat(series.palm_wxyz[frames], scalar_first=True)
        objects = Rotation.from_quat(series.object_wxyz[frames], scalar_first=True)
        palm_positions, object_positions = series.palm_positions[frames], series.object_positions[frames]
        self.object_poses = Poses(objects.as_quat()[None], object_positions[None])
        self.hand_poses = pose_links(hand, series.joints[frames], palms.as_matrix(), palm_positions)
        self.contacts, self.forces = series.contact_positions[frames], series.contact_forces[frames]
        in_palm = palms.inv().apply(object_positions - palm_positions)
        turned = palms.inv() * objects
        began = int(np.searchsorted(np.arange(usable)[frames], min(series.closing, usable - 1)))
        began = min(began, len(in_palm) - 1)
        self.slips = np.linalg.norm(in_palm - in_palm[began], axis=1)
        self.turns = (turned[began].inv() * turned).magnitude()
        self.slips[:began] = self.turns[:began] = 0.0

    def rows(self, count: int) -> NDArray[np.int64]:
        """Frames for ``count`` rows: in order, then the last one on and on, (count,)."""
        return np.minimum(np.arange(count), len(self.times) - 1)


def simulation_indexes(first_step: int, times: NDArray[np.float64]) -> list[rr.TimeColumn]:
    """Where simulated frames stand in time."""
    steps = first_step + np.arange(len(times))
    return [rr.TimeColumn("step", sequence=steps), rr.TimeColumn("sim_time", duration=times)]


def record_simulation(
    stream: rr.RecordingStream,
    name: str,
    simulated: RecordedFrames,
    hand: Hand,
    indexes: list[rr.TimeColumn],
    frames: NDArray[np.int64],
    offset: NDArray[np.float64],
) -> None:
    """Write the contact forces and what the object did in the hand.

    Args:
        stream: The recording.
        name: What the series are called: ``split`` or ``initial``.
        simulated: The frames.
        hand: The hand.
        indexes: Where the rows stand in time.
        frames: Frame of every row, (R,).
        offset: Where this simulation's world stands in the recording's, (3,) [m].
    """
    contacts, forces = simulated.contacts[frames] + offset, simulated.forces[frames]
    sizes = np.linalg.norm(forces, axis=2)
    drawn = sizes > MIN_FORCE
    vectors = ARROW_LENGTH / max(float(sizes.max()), MIN_FORCE) * forces[drawn]
    arrows = rr.Arrows3D.columns(origins=contacts[drawn] - vectors, vectors=vectors)
    stream.send_columns(f"world/forces/{name}", indexes, arrows.partition(drawn.sum(axis=1)))
    for f, finger in enumerate(hand.fingers):
        scalars = rr.Scalars.columns(scalars=sizes[:, f])
        stream.send_columns(f"simulation/force_N/{name}/{finger.name}", indexes, scalars)
    for series, values in (("slip_mm", 1e3 * simulated.slips), ("turn_deg", np.degrees(simulated.turns))):
        stream.send_columns(f"simulation/{series}/{name}", indexes, rr.Scalars.columns(scalars=values[frames]))
