"""Why a run ended: values for programs, a sentence of advice for people."""

from enum import IntEnum

__all__ = ["Termination"]


class Termination(IntEnum):
    """How a finger splitting ended; ``advice`` says what to do about it.

    The first four end a run whose grasp is feasible, the others name the constraint that the grasp violates.
    """

    CONVERGED = 0
    STOPPED_BY_COLLISION = 1
    STOPPED_BY_PAD_ANGLE = 2
    ITERATION_LIMIT = 3
    CONTACT_OFF_SURFACE = 4
    PAD_ANGLE_VIOLATED = 5
    IN_COLLISION = 6
    JOINT_LIMIT_VIOLATED = 7

    @property
    def label(self) -> str:
        """Name in documents, such as ``"converged"``."""
        return self.name.lower()

    @property
    def advice(self) -> str:
        """What this end means and what may help."""
        return _ADVICE[self]


_ADVICE = {
    Termination.CONVERGED: "Neither the contacts nor the palm can move so that quality rises; nothing to do.",
    Termination.STOPPED_BY_COLLISION: "A link met the object before quality stopped rising; another approach "
    "direction or a contact nearer to the outside leaves more room.",
    Termination.STOPPED_BY_PAD_ANGLE: "A pad reached its largest tilt against the surface before quality stopped "
    "rising; raise pad_angle_limit if your pads tolerate more.",
    Termination.ITERATION_LIMIT: "Quality was still rising at the last allowed iteration; raise max_outer_iterations.",
    Termination.CONTACT_OFF_SURFACE: "A fingertip cannot reach the surface from this palm pose; try other parallel "
    "grasps or more starts.",
    Termination.PAD_ANGLE_VIOLATED: "A pad faces away from the surface it touches; try other approach directions or "
    "more starts.",
    Termination.IN_COLLISION: "A link or the palm lies inside the object; try other approach directions or "
    "more starts.",
    Termination.JOINT_LIMIT_VIOLATED: "A joint is outside its range; try more starts.",
}
