"""Fills a data set whose rounds are variations of a stored result; killed by the tests, and begun again.

Run as ``program.py FOLDER RESULT OBJECT...``.
"""

import json
import sys
from pathlib import Path

from fingersplit.dataset.planners import ServicePlanner
from fingersplit.dataset.request import DatasetRequest, find_objects
from fingersplit.dataset.running import make_dataset

ORDER = DatasetRequest(per_object=24, starts=12, seed=5)


def main(folder, stored, objects):
    document = json.loads(Path(stored).read_text())

    def plan(path, options):
        """The stored result, its palms moved by object and seed, so that no two grasps are the same."""
        if path.name.startswith("bad"):
            return {"error": "It is no mesh.", "code": "invalid_mesh"}
        varied = json.loads(json.dumps(document)) | {"seed": options["seed"]}
        varied["object"]["id"] = path.name
        for grasp in varied["grasps"]:
            grasp["palm"]["position"][0] += 1e-6 * options["seed"]
        return varied

    items, files, _ = find_objects(map(Path, objects), ORDER.split)
    make_dataset(Path(folder), ORDER, items, files, ServicePlanner(plan, 2))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
