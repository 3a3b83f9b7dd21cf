"""The planned friction: request before object before default, and everything that plans with it says which it was."""

import math
import re

import pytest

from fingersplit.contacts.friction import DEFAULT_FRICTION, planned_friction, without_friction
from fingersplit.errors import SettingsError
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan


@pytest.mark.parametrize(
    ("requested", "known", "expected"),
    [(None, None, DEFAULT_FRICTION), (None, 0.9, 0.9), (0.3, 0.9, 0.3), (0.3, None, 0.3), (1, None, 1.0)],
)
def test_request_comes_before_object_before_default(requested, known, expected):
    assert planned_friction(requested, known) == expected


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (True, r"'friction' must be a number, got True"),
        ("0.5", r"'friction' must be a number, got '0.5'"),
        (0.0, r"'friction' is 0.0; allowed: 0.01 to 5"),
        (math.nan, r"'friction' is nan; allowed"),
        (math.inf, r"'friction' is inf; allowed"),
    ],
)
def test_what_is_no_friction_is_refused(value, message):
    for decide in (planned_friction, lambda friction: without_friction({"friction": friction})):
        with pytest.raises(SettingsError, match=message):
            decide(value)


def test_a_friction_among_the_settings_is_taken_from_them():
    assert without_friction({"fidelity": "paper", "friction": 0.4}) == ({"fidelity": "paper"}, 0.4)
    assert without_friction({"fidelity": "paper"}) == ({"fidelity": "paper"}, None)
    with pytest.raises(SettingsError, match="got None"):
        without_friction({"friction": None})


def test_plan_names_the_friction_it_used(barrett):
    slippery = prepare_object(cylinder(), "can", ObjectOptions(friction=0.25))
    known, asked = plan(slippery, barrett, starts=4), plan(slippery, barrett, starts=4, friction=0.8)
    assert (known.friction, asked.friction) == (0.25, 0.8)
    effective = [float(re.findall(r"coefficient: ([\d.]+)", result.grasps[0].reason)[0]) for result in (known, asked)]
    assert 0.2 < effective[0] <= 0.25 < effective[1] <= 0.8
