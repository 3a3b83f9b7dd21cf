"""docs/datasets.md: its table of arrays is the schema."""

import re
from pathlib import Path

from fingersplit.dataset.columns import COLUMNS
from fingersplit.dataset.layouts import available_layouts

PAGE = (Path(__file__).parents[2] / "docs" / "datasets.md").read_text()


def test_every_array_is_documented_with_its_unit():
    rows = re.findall(
        r"^\| `(\w+)` \| (?:float64|int32|int8|bool|text) \| [^|]+ \| ([^|]*) \| (.*) \|$", PAGE, re.MULTILINE
    )
    documented = {name: (unit.strip(), meaning) for name, unit, meaning in rows if name != "selected"}
    assert documented == {column.name: (column.unit, column.meaning) for column in COLUMNS}


def test_every_layout_is_documented():
    assert set(re.findall(r"^\| `(\w+)` \| `", PAGE, re.MULTILINE)) == set(available_layouts())
