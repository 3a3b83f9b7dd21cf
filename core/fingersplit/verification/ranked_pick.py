"""Picks of the grasps of a result: the scene and the ways that it states, run and reported like any verification."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fingersplit.errors import SettingsError
from fingersplit.grasp import Grasp
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult
from fingersplit.result.verification import GripReport, Reason, TrialReport, Verification, explanation, is_firm
from fingersplit.scene.attaching import attach_bodies
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.verification.controllers import PositionServo
from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.pick import verify_pick
from fingersplit.verification.pick_frames import PickCamera
from fingersplit.verification.pick_world import PickWorld
from fingersplit.verification.picking import PickReport, PickWays
from fingersplit.verification.protocols import load_protocol
from fingersplit.verification.protocols.noisy_pick import NoisyPick
from fingersplit.verification.protocols.pick import Pick
from fingersplit.verification.published import Execution
from fingersplit.verification.verifying import SIMULATOR

__all__ = ["ResultPicks"]


class ResultPicks:
    """Picks the grasps of one result.

    Args:
        result: The result.
        model: The object that it was planned for.
        hand: The hand that it was planned for.
        pieces: The object for the simulation.
        obstacle: Gives the model of an obstacle that is named by its id; None where there are none.
    """

    def __init__(
        self,
        result: PlanResult,
        model: ObjectModel,
        hand: Hand,
        pieces: ConvexPieces,
        obstacle: Callable[[str], ObjectModel] | None,
    ) -> None:
        self._result, self._model, self._hand, self._pieces, self._obstacle = result, model, hand, pieces, obstacle

    @cached_property
    def _scene(self) -> PreparedScene:
        constraints = Constraints.from_document(self._result.provenance.constraints)
        if self._obstacle is not None:
            constraints = constraints.resolved(self._obstacle)
        hand = attach_bodies(self._hand, constraints.end_effector.attached_bodies)
        return prepare_scene(constraints, self._model, hand)

    def verify(self, grasp: GraspResult, protocol: Pick, friction: float | None) -> Verification:
        """Pick one grasp, or as often as the protocol asks for.

        Raises:
            SettingsError: The result's scene has no support surface.
            SceneError: An obstacle's model is not there.
        """
        began, planned = perf_counter(), self._result.friction
        grip, ways = grasp.grip_plan(self._hand), self._ways(grasp)
        simulated = planned if friction is None else friction
        if ways is None:
            raise SettingsError(
                f"Protocol {protocol.name!r} needs a free approach; the grasp of rank {grasp.rank} has none."
            )
        reports = [self._pick(grasp, ways, moved, protocol, simulated) for moved in self._draws(protocol)]
        failures = [report for report in reports if report.reason != "held"]
        enough = protocol.least_share if isinstance(protocol, NoisyPick) else 1.0
        held = len(failures) <= (1.0 - enough) * len(reports) + 1e-9
        reason: Reason = "held" if held else Counter(report.reason for report in failures).most_common(1)[0][0]
        slip, turn = (max(getattr(report, name) for report in reports) for name in ("displacement", "rotation"))
        names = ["pick"] if len(reports) == 1 else [f"draw {draw}" for draw in range(1, len(reports) + 1)]
        return Verification(
            protocol=protocol.name,
            passed=held,
            held_firmly=held and is_firm(slip, turn),
            slip=slip,
            turn=turn,
            reason=reason,
            explanation=explanation(reason),
            simulator=SIMULATOR,
            settings={
                "protocol": protocol.to_document(),
                "controller": PositionServo().to_document(),
                "execution": Execution.of_result(grasp, self._hand).to_document(self._hand),
                "friction": simulated,
                "planned_friction": planned,
                "mass": self._model.mass,
                "pick": _numbers(reports[0], self._hand),
                "draws": [_numbers(report, self._hand) for report in reports[1:]],
            },
            initial_penetration=0.0,
            grip=GripReport.of(grip),
            squeeze=None,
            trials=tuple(
                TrialReport(name, report.reason == "held", report.reason, ())
                for name, report in zip(names, reports, strict=True)
            ),
            time_ms=1e3 * (perf_counter() - began),
        )

    def frames(self, grasp: GraspResult, report: Verification) -> SimulationFrames | None:
        """The pick of a report again, frame by frame; of several draws the first.

        Raises:
            SettingsError: The report names a protocol or numbers that this version does not know.
        """
        protocol, ways = load_protocol(report.protocol, report.settings["protocol"]), self._ways(grasp)
        assert isinstance(protocol, Pick)
        if ways is None:
            return None
        moved = self._draws(protocol)[0]
        palm = _seen_from(moved, grasp.for_hand(self._hand)).object_from_palm
        camera = PickCamera(protocol, self._scene.world_from_object, palm)
        self._pick(grasp, ways, moved, protocol, report.settings["friction"], camera.watch)
        return camera.frames()

    def _draws(self, protocol: Pick) -> list[NDArray[np.float64]]:
        """Where the object is in the frame that it was said to have, (4, 4), for each pick."""
        if isinstance(protocol, NoisyPick):
            return list(protocol.displacements(self._model.center_of_mass))
        return [np.eye(4)]

    def _pick(
        self,
        grasp: GraspResult,
        ways: PickWays,
        object_moved: NDArray[np.float64],
        protocol: Pick,
        friction: float,
        watch: Callable[[PickWorld], None] | None = None,
    ) -> PickReport:
        return verify_pick(
            _seen_from(object_moved, grasp.for_hand(self._hand)),
            self._hand,
            self._model,
            self._pieces,
            self._scene,
            ways.seen_from(object_moved),
            protocol,
            friction=friction,
            planned_friction=self._result.friction,
            grip=grasp.grip_plan(self._hand),
            watch=watch,
        )

    def _ways(self, grasp: GraspResult) -> PickWays | None:
        pregrasp, way_in, way_out = grasp.pregrasp_pose(self._hand), grasp.approach_path, grasp.retreat_path
        if pregrasp is None or way_in is None or way_out is None:
            return None
        return PickWays(
            approach=np.array(way_in.direction),
            approach_distance=way_in.distance,
            opened=pregrasp.joints,
            retreat=np.array(way_out.direction),
            retreat_distance=way_out.distance,
        )


def _seen_from(object_moved: NDArray[np.float64], grasp: Grasp) -> Grasp:
    """The same grasp of the hand, in the frame of an object that stands at a pose (4, 4) of its planned frame."""
    planned = np.linalg.inv(object_moved)
    return replace(grasp, object_from_palm=planned @ grasp.object_from_palm)


def _numbers(report: PickReport, hand: Hand) -> dict[str, object]:
    """What happened, as plain JSON data; lengths in metres, times in seconds since the approach began."""
    fingers = [finger.name for finger in hand.fingers]
    return {
        "settling": report.settling,
        "first_touches": dict(zip(fingers, report.first_touches, strict=True)),
        "pushed": report.pushed,
        "touched": list(report.touched),
        "displacement": report.displacement,
        "rotation": report.rotation,
        "lifted": report.lifted,
        "lost_contacts": list(report.lost_contacts),
    }
