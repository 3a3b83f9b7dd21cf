"""The loads of a task decide the holding margin, and so the ranks."""

import numpy as np
import pytest

from fingersplit.hands.hand import load_hand
from fingersplit.objects.parametric import box
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit.scene import Constraints, Scene, Task, Wrench


@pytest.fixture(scope="module")
def search():
    model, hand = prepare_object(box((0.06, 0.05, 0.12)), "carton"), load_hand("barrett")

    def plan(task):
        return find_grasps(model, hand, starts=12, seed=1, top_k=12, constraints=Constraints(scene=Scene(), task=task))

    return plan


def margins(found):
    return {tuple(np.round(one.run.last.palm_position, 9)): one.holding.margin for one in found.grasps}


def test_wrenches_lower_the_margin_and_are_named(search):
    usual, loaded = search(Task()), search(Task(wrenches=(Wrench(force=(0.0, 0.0, -6.0)), Wrench(torque=(0.1, 0, 0)))))

    before, after = margins(usual), margins(loaded)
    same = before.keys() & after.keys()
    assert same
    assert all(after[one] <= before[one] + 1e-9 for one in same)
    assert any(after[one] < before[one] - 0.1 for one in same)
    assert "wrench" in loaded.grasps[0].reason
    carries = [one.holding.margin >= 0.0 for one in loaded.grasps if one.run.feasible]
    assert carries == sorted(carries, reverse=True)


def test_one_direction_of_gravity_is_easier_than_all(search):
    before, after = margins(search(Task())), margins(search(Task(gravity="scene")))
    same = before.keys() & after.keys()
    assert same
    assert all(after[one] >= before[one] - 1e-9 for one in same)
    assert "scene's gravity" in search(Task(gravity="scene")).grasps[0].reason
