"""Why a run ended: values for programs, a sentence of advice for people."""

from enum import IntEnum

__all__ = ["Termination"]


class Termination(IntEnum):
    """How a finger splitting ended; ``advice`` says what to do about it.

    The first four and those that begin with ``STOPPED`` end a run whose grasp is feasible, the others name the
    constraint that the grasp violates.
    """

    CONVERGED = 0
    STOPPED_BY_COLLISION = 1
    STOPPED_BY_PAD_ANGLE = 2
    ITERATION_LIMIT = 3
    CONTACT_OFF_SURFACE = 4
    PAD_ANGLE_VIOLATED = 5
    IN_COLLISION = 6
    JOINT_LIMIT_VIOLATED = 7
    STOPPED_BY_OBSTACLE = 8
    STOPPED_BY_REGION = 9
    NEAR_OBSTACLE = 10
    OUTSIDE_WORKSPACE = 11
    OUTSIDE_REGION = 12
    NO_FREE_APPROACH = 13
    NO_FREE_RETREAT = 14
    IN_SELF_COLLISION = 15

    @property
    def label(self) -> str:
        """Name in documents, such as ``"converged"``."""
        return self.name.lower()

    @property
    def advice(self) -> str:
        """What this end means and what may help."""
        return _ADVICE[self]


_ADVICE = {
    Termination.IN_SELF_COLLISION: "Two links of the hand lie inside each other; try more starts or other preshapes.",
    Termination.CONVERGED: "Neither the contacts nor the palm can move so that quality rises; nothing to do.",
    Termination.STOPPED_BY_COLLISION: "A link met the object before quality stopped rising; another approach "
    "direction or a contact nearer to the outside leaves more room.",
    Termination.STOPPED_BY_PAD_ANGLE: "A pad reached its largest tilt against the surface before quality stopped "
    "rising; raise pad_angle_limit if your pads tolerate more.",
    Termination.ITERATION_LIMIT: "Quality was still rising at the last allowed iteration; raise max_outer_iterations.",
    Termination.CONTACT_OFF_SURFACE: "Not all pads come to touch the surface at once; try other parallel grasps or "
    "more starts.",
    Termination.PAD_ANGLE_VIOLATED: "A pad faces away from the surface it touches; try other approach directions or "
    "more starts.",
    Termination.IN_COLLISION: "A link or the palm lies inside the object; try other approach directions or "
    "more starts.",
    Termination.JOINT_LIMIT_VIOLATED: "A joint is outside its range; try more starts.",
    Termination.STOPPED_BY_OBSTACLE: "A link came as near to an obstacle as the clearance allows before quality "
    "stopped rising; more room around the object leaves more choice.",
    Termination.STOPPED_BY_REGION: "A contact met the border of its region before quality stopped rising; a wider "
    "region leaves more choice.",
    Termination.NEAR_OBSTACLE: "A link is too near to an obstacle or support; try more starts, a smaller clearance, "
    "or move the obstacle.",
    Termination.OUTSIDE_WORKSPACE: "The palm lies outside the workspace or the arm's reach; widen them or move the "
    "object.",
    Termination.OUTSIDE_REGION: "A contact lies where none is allowed; try more starts or wider regions.",
    Termination.NO_FREE_APPROACH: "No allowed straight way in is free; widen the approach cones, shorten "
    "approach.min_distance, or set approach.required to false.",
    Termination.NO_FREE_RETREAT: "An obstacle is in the way of the retreat; change approach.retreat.",
}
