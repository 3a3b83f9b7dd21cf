"""docs/scenes.md: the scene that it shows is one."""

import json
import re
from pathlib import Path

from fingersplit.scene import Constraints

PAGE = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text()


def test_the_scene_of_the_page_is_read():
    (block,) = re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
    constraints = Constraints.from_document(json.loads(block))
    assert [obstacle.id for obstacle in constraints.scene.obstacles] == ["bottle"]
    assert constraints.approach.min_distance == 0.05
