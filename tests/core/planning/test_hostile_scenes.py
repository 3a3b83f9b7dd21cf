"""Scenes that nobody should send: a clear error that names the entry, or an answer that says why."""

import math

import numpy as np
import pytest

from fingersplit.errors import SceneError
from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.scene import Constraints
from fingersplit.scene.world import MAX_OBSTACLES

HAND = load_hand("barrett")
BOX = {"type": "box", "dimensions": [0.02, 0.02, 0.02]}
POSED = {"object_pose": {"position": [0, 0, 0.06]}, "support_surfaces": [{}]}


@pytest.fixture(scope="module")
def carton():
    return prepare_object(box((0.06, 0.05, 0.12)), "carton")


def answer(carton, document):
    return find_grasps(carton, HAND, starts=6, constraints=Constraints.from_document(document))


@pytest.mark.parametrize(
    ("document", "field"),
    [
        ({"scene": {"object_pose": {"position": [0, math.nan, 0]}}}, "scene.object_pose.position"),
        ({"scene": {"object_pose": {"wxyz": [0, 0, 0, 0]}}}, "scene.object_pose.wxyz"),
        ({"scene": {"gravity": [0, 0, math.inf]}}, "scene.gravity"),
        ({"scene": {"clearance": math.nan}}, "scene.clearance"),
        ({"scene": {"clearance": -0.001}}, "scene.clearance"),
        ({"scene": {"support_surfaces": [{"normal": [0, 0, 0]}]}}, "scene.support_surfaces[0].normal"),
        ({"scene": {"obstacles": [{"id": "a", "points": [[0, 0, math.nan]]}]}}, "scene.obstacles[0].points"),
        ({"scene": {"obstacles": [{"id": "a", "points": []}]}}, "scene.obstacles[0].points"),
        ({"scene": {"obstacles": [{"id": "a"}]}}, "scene.obstacles[0].primitive"),
        (
            {"scene": {"obstacles": [{"id": f"box {k}", "primitive": BOX} for k in range(10_000)]}},
            "scene.obstacles",
        ),
        ({"approach": {"directions": []}}, "approach.directions"),
        ({"approach": {"directions": [{"axis": [0, 0, -1], "max_angle": 0.0}]}}, "approach.directions[0].max_angle"),
        ({"contact_regions": {"allowed": [{"type": "faces", "faces": []}]}}, "contact_regions.allowed[0].faces"),
        ({"scene": {"workspace": {"min": [0, 0, 0], "max": [0, 1, 1]}}}, "scene.workspace.max"),
    ],
)
def test_what_cannot_be_is_refused_by_its_name(document, field):
    with pytest.raises(SceneError) as error:
        Constraints.from_document(document)
    assert error.value.field == field


def test_as_many_obstacles_as_are_allowed_are_planned_with(carton):
    rng = np.random.default_rng(0)
    places = rng.uniform(-1.0, 1.0, (MAX_OBSTACLES, 3))
    places = places[np.linalg.norm(places[:, :2], axis=1) > 0.3]
    obstacles = [
        {"id": f"box {k}", "primitive": BOX, "pose": {"position": place.tolist()}} for k, place in enumerate(places)
    ]
    found = answer(carton, {"scene": POSED | {"obstacles": obstacles}})
    assert found.runs
    assert found.message


@pytest.mark.parametrize(
    ("document", "constraint"),
    [
        (
            {"scene": POSED | {"obstacles": [{"id": "core", "primitive": BOX, "pose": {"position": [0, 0, 0.06]}}]}},
            None,  # the hand keeps clear of what the object encloses by keeping clear of the object
        ),
        (
            {
                "scene": POSED
                | {
                    "obstacles": [
                        {
                            "id": "shell",
                            "primitive": {"type": "box", "dimensions": [0.2, 0.2, 0.3]},
                            "pose": {"position": [0, 0, 0.06]},
                        }
                    ]
                }
            },
            "shell",
        ),
        ({"contact_regions": {"forbidden": [{"type": "sphere", "radius": 1.0}]}}, "contact_regions"),
        ({"scene": POSED | {"workspace": {"min": [5, 5, 5], "max": [6, 6, 6]}}}, "scene.workspace"),
        (
            {"scene": POSED, "approach": {"directions": [{"axis": [0, 0, 1], "max_angle": 0.02}]}},
            "approach.directions",
        ),
    ],
)
def test_what_leaves_nothing_says_why(carton, document, constraint):
    found = answer(carton, document)

    if constraint is None:
        assert found.feasible > 0
        return
    assert found.feasible == 0
    named = [one.constraint for one in found.relaxations]
    assert any(constraint in one for one in named) or constraint in found.message, (named, found.message)
