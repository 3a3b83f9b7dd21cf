"""A metric is one file: put into the folder, it is in the document, the table, the client's schema and recordings."""

import io
import json
import sys

import numpy as np
import pytest
from rich.console import Console

from fingersplit.cli.planning import result_table
from fingersplit.contacts import metrics
from fingersplit.contacts.metrics import available_metrics
from fingersplit.planning.planning import plan
from fingersplit.result import PlanResult
from fingersplit.result.schema import client_modules
from fingersplit_client.schemas import PlanResult as ClientResult

SPREAD = '''"""How far apart the contacts are."""

import numpy as np

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _spread(state: GraspState) -> float:
    return float(np.ptp(state.space.contacts, axis=0).max())


METRIC = Metric(
    name="spread",
    title="spread",
    unit="m",
    meaning="Longest edge of the box around the contacts",
    higher_is_better=False,
    source="Fan2018",
    function=_spread,
)
'''


@pytest.fixture
def with_spread(tmp_path, monkeypatch):
    (tmp_path / "spread.py").write_text(SPREAD)
    monkeypatch.setattr(metrics, "__path__", [*metrics.__path__, str(tmp_path)])
    available_metrics.cache_clear()
    yield
    monkeypatch.undo()
    sys.modules.pop(f"{metrics.__name__}.spread", None)  # else the next file of this name is not read
    available_metrics.cache_clear()


@pytest.fixture
def found(with_spread, prepared, barrett):
    return plan(prepared("box"), barrett, starts=4, seed=1, top_k=2)


def test_it_is_in_the_document_and_read_back(found):
    for grasp in found.grasps:
        contacts = np.array([contact.position for contact in grasp.contacts])
        assert grasp.metrics["spread"] == pytest.approx(np.ptp(contacts, axis=0).max())
    document = json.loads(json.dumps(found.to_dict()))
    assert PlanResult.from_dict(document) == found
    read = ClientResult.model_validate(document)
    assert read.grasps[0].metrics.spread == found.grasps[0].metrics["spread"]


def test_the_table_has_a_column_for_it(found):
    text = io.StringIO()
    Console(file=text, width=200).print(result_table(found))
    assert "spread m" in text.getvalue()
    assert f"{found.grasps[0].metrics['spread']:.3f}" in text.getvalue()


def test_the_clients_schema_describes_it(with_spread):
    assert (
        'spread: float = Field(description="Longest edge of the box around the contacts [m].")'
        in (client_modules()["plan"])
    )
    available_metrics.cache_clear()


def test_two_of_one_name_are_refused(with_spread, tmp_path):
    (tmp_path / "again.py").write_text(SPREAD)
    available_metrics.cache_clear()
    with pytest.raises(ImportError, match="two entries called 'spread'"):
        available_metrics()
