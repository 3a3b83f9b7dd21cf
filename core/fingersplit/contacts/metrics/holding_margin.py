"""How much friction a grasp has to spare while it carries the object."""

import math

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _margin(state: GraspState) -> float | None:
    if state.holding is None or not math.isfinite(state.holding.margin):
        return None
    return state.holding.margin


METRIC = Metric(
    name="holding_margin",
    title="margin",
    unit="N",
    meaning="Least friction force that a contact can still take while the fingers carry the object's weight, over all "
    "tested gravity directions; negative when they cannot carry it, null when no forces balance it",
    higher_is_better=True,
    source="Kerr1986, Boyd2007; contacts.holding",
    function=_margin,
    may_be_missing=True,
    recorded_states=0,
    order=0,
)
