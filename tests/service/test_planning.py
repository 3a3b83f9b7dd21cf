"""What a job can ask of the planner, and its result as JSON text."""

import json
import math
from collections.abc import Callable
from dataclasses import fields
from inspect import signature

import pytest

from fingersplit.planning.planning import plan
from fingersplit.robustness.ranking_order import RankingOrder
from fingersplit.scene.constraints import Constraints
from fingersplit.verification import verify_ranked
from fingersplit_client.schemas import JobCreate
from fingersplit_service.jobs.outcome import strict_json


@pytest.mark.parametrize("name", ["mug", "Infinity of NaN", 'with "quotes"', "\u00f6l"])
def test_json_reads_back_as_it_was(name):
    document = {"name": name, "joints": {"a": 0.1, "b": -1e-17}, "grasps": [1, None, True, (2.5, 3)], "empty": {}}
    assert json.loads(strict_json(document)) == json.loads(json.dumps(document))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_numbers_that_json_does_not_have_are_no_result(number):
    with pytest.raises(ValueError, match="not JSON compliant"):
        strict_json({"grasps": [{"quality": number}]})


RANKING = {"by": "rank_by", "noise": "noise", "simulation_budget": "simulation_budget_ms"}
VERIFICATION = {"friction": "simulated_friction", "initial": "verify_initial"}
"""Options of core that requests call otherwise, as one of another kind has the name."""
OF_THE_SERVICE = {"object_id", "parallel_grasp_set", "recording", "verify_first", "priority", "deadline_s"}
"""What requests say of jobs and of what is stored."""


def options(function: Callable[..., object], *left_out: str) -> set[str]:
    return set(signature(function).parameters) - {"model", "threads", "pieces", *left_out}


def test_a_job_can_ask_for_all_that_planner_and_verification_take_and_for_nothing_else():
    planned = options(plan, "progress") - {"settings", "friction", "constraints", "ranking"}
    ranked = {RANKING[field.name] for field in fields(RankingOrder) if field.name != "pieces"}
    verified = options(verify_ranked, "result", "deadline", "obstacle", "mass")  # the mass is an option of the object
    asked = planned | {field.name for field in fields(Constraints)} | ranked | {"planner"}
    asked |= {VERIFICATION.get(name, name) for name in verified}
    assert JobCreate.model_fields.keys() - OF_THE_SERVICE == asked
