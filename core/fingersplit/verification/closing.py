"""How a hand closes on the free object, by what is published or by the virtual frame, and what it holds on with."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.grip import Grip
from fingersplit.grasp import Grasp
from fingersplit.verification.controllers import PublishedGrip, VirtualFrame
from fingersplit.verification.protocol import Protocol
from fingersplit.verification.published import Execution
from fingersplit.verification.scene import Scene
from fingersplit.verification.simulation import SimulationTrack, keep_clear, open_fingers, run_closing

__all__ = ["ClosedHand", "close_by_frame", "close_published", "with_opening"]


class ClosedHand(NamedTuple):
    """A hand that has closed; the scene stands so.

    Attributes:
        track: What happened.
        rows: Rows of the track that belong to each phase, by its name.
        held: Controls that hold on, (n_controls,).
    """

    track: SimulationTrack
    rows: dict[str, slice]
    held: NDArray[np.float64]


def with_opening(execution: Execution, scene: Scene, grasp: Grasp) -> Execution:
    """The same with an opening; where none is published, the pads open along the normals. The scene is in the grasp."""
    return execution if execution.opened is not None else replace(execution, opened=open_fingers(scene, grasp.normals))


def close_published(
    scene: Scene,
    grasp: Grasp,
    protocol: Protocol,
    controller: PublishedGrip,
    execution: Execution,
    object_moved: NDArray[np.float64] | None = None,
) -> ClosedHand:
    """Close from the published opening through the grasp to the squeeze.

    Args:
        scene: The scene, in the grasp.
        grasp: The planned grasp.
        protocol: Times.
        controller: Executes what is published.
        execution: What is published, with an opening.
        object_moved: Pose of the object in its planned frame, (4, 4), for an object that is not where the planner
            thought; None where it is.
    """
    step = scene.model.opt.timestep = protocol.closing_step
    closing, squeezing = round(protocol.closing_time / step), round(protocol.squeeze_time / step)
    assert execution.opened is not None
    controls = controller.close(scene, execution.grip, execution.opened, grasp.joints, (closing, squeezing))
    if object_moved is not None:
        scene.move_object(object_moved)
    scene.set_joints(execution.opened)
    keep_clear(scene, grasp.normals)
    track = run_closing(scene, controls, opened=closing)
    rows = {"close": slice(0, closing), "squeeze": slice(closing, closing + squeezing)}
    return ClosedHand(track, rows, controller.hold(scene, execution.grip, controls[-1]))


def close_by_frame(scene: Scene, grasp: Grasp, protocol: Protocol, controller: VirtualFrame, grip: Grip) -> ClosedHand:
    """Squeeze by the virtual frame from the planned grasp, in which the scene is."""
    controller.prepare(scene)
    scene.model.opt.timestep = protocol.closing_step
    steps = round(protocol.squeeze_time / protocol.closing_step)
    ramp = np.clip(np.linspace(0.0, 1.5, steps), 0.0, 1.0)  # the last third lets it come to rest
    controls = controller.close(scene, grip, ramp)
    keep_clear(scene, grasp.normals)
    track = run_closing(scene, controls)
    return ClosedHand(track, {"squeeze": slice(0, steps)}, controller.hold(scene, controls[-1]))
