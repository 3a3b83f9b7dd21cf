"""The objective of finger splitting."""

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _quality(state: GraspState) -> float:
    return float(state.scores[0])


METRIC = Metric(
    name="quality",
    title="quality Q",
    unit="",
    meaning="What finger splitting climbs: Q = w1 Q_o + w2 Q_h, no unit",
    higher_is_better=True,
    source="Fan2018",
    function=_quality,
    symbol="Q",
    in_tables=False,
    recorded_states=0,
    order=10,
)
