"""The hand's part of the objective."""

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _manipulability(state: GraspState) -> float:
    return float(state.scores[2])


METRIC = Metric(
    name="manipulability",
    title="joint term",
    unit="",
    meaning="w2 Q_h: minus the weighted squared distance of the joints from mid-range, no unit",
    higher_is_better=True,
    source="Liegeois1977, Fan2018",
    function=_manipulability,
    in_tables=False,
    recorded_states=0,
    order=12,
)
