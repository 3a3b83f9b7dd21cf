"""The simulated part of a recording: the verification's frames, on the steps after the planning rows."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fingersplit.extras import extra
from fingersplit.hands.hand import Hand
from fingersplit.recording.posing import Poses, pose_links
from fingersplit.verification import SimulationFrames

with extra("recording"):
    import rerun as rr

__all__ = ["RecordedFrames", "record_simulation", "simulation_indexes"]

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
        slips: How far the object has moved in the palm, (T,) [m].
        turns: How far it has turned in the palm, (T,) [rad].
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
        self.slips = np.linalg.norm(in_palm - in_palm[:1], axis=1)
        self.turns = (turned[0].inv() * turned).magnitude()

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
