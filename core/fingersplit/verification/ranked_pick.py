"""Picks of the grasps of a result: the scene and the ways that it states, run and reported like any verification."""

from collections.abc import Callable
from functools import cached_property
from time import perf_counter

import numpy as np

from fingersplit.errors import SettingsError
from fingersplit.hands.hand import Hand
from fingersplit.objects.convex_pieces import ConvexPieces
from fingersplit.objects.model import ObjectModel
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult
from fingersplit.result.verification import GripReport, TrialReport, Verification, explanation, is_firm
from fingersplit.scene.attaching import attach_bodies
from fingersplit.scene.constraints import Constraints
from fingersplit.scene.preparing import PreparedScene, prepare_scene
from fingersplit.verification.controllers import PositionServo
from fingersplit.verification.pick import verify_pick
from fingersplit.verification.picking import PickReport, PickWays
from fingersplit.verification.protocols.pick import Pick
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
        """Pick one grasp.

        Raises:
            SettingsError: The result's scene has no support surface.
            SceneError: An obstacle's model is not there.
        """
        began, planned = perf_counter(), self._result.friction
        controller, grip = PositionServo(), grasp.grip_plan(self._hand)
        simulated = planned if friction is None else friction
        ways = self._ways(grasp)
        if ways is None:
            raise SettingsError(f"Protocol 'pick' needs a free approach; the grasp of rank {grasp.rank} has none.")
        report = verify_pick(
            grasp.for_hand(self._hand),
            self._hand,
            self._model,
            self._pieces,
            self._scene,
            ways,
            protocol,
            friction=simulated,
            planned_friction=planned,
            grip=grip,
        )
        held, (slip, turn) = report.reason == "held", (report.displacement, report.rotation)
        return Verification(
            protocol=protocol.name,
            passed=held,
            held_firmly=held and is_firm(slip, turn),
            slip=slip,
            turn=turn,
            reason=report.reason,
            explanation=explanation(report.reason),
            simulator=SIMULATOR,
            settings={
                "protocol": protocol.to_document(),
                "controller": controller.to_document(),
                "friction": simulated,
                "planned_friction": planned,
                "mass": self._model.mass,
                "pick": _numbers(report, self._hand),
            },
            initial_penetration=0.0,
            grip=GripReport.of(grip),
            squeeze=None,
            trials=(TrialReport("pick", report.reason == "held", report.reason, ()),),
            time_ms=1e3 * (perf_counter() - began),
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
