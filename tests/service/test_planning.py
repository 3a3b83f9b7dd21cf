"""The result of a job as JSON text."""

import json
import math

import pytest

from fingersplit_service.jobs.outcome import strict_json


@pytest.mark.parametrize("name", ["mug", "Infinity of NaN", 'with "quotes"', "\u00f6l"])
def test_json_reads_back_as_it_was(name):
    document = {"name": name, "joints": {"a": 0.1, "b": -1e-17}, "grasps": [1, None, True, (2.5, 3)], "empty": {}}
    assert json.loads(strict_json(document)) == json.loads(json.dumps(document))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_numbers_that_json_does_not_have_are_no_result(number):
    with pytest.raises(ValueError, match="not JSON compliant"):
        strict_json({"grasps": [{"quality": number}]})
