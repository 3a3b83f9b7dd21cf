"""The object's part of the objective."""

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _object_quality(state: GraspState) -> float:
    return float(state.scores[1])


METRIC = Metric(
    name="object_quality",
    title="area term",
    unit="m^2",
    meaning="w1 Q_o: weight times twice the area of the contact triangle",
    higher_is_better=True,
    source="Fan2018",
    function=_object_quality,
    in_tables=False,
    recorded_states=0,
    order=11,
)
