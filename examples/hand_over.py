"""Hand-over files for motion planners: python hand_over.py mug.ply FOLDER.

Plans for an object on a table, from above. `grasps.json` has moveit_msgs/Grasp messages, one of which a stage
`GenerateGraspPose` of MoveIt Task Constructor sends on; `curobo.json` is the goal set of cuRobo's `plan_grasp`.
"""

import sys
from pathlib import Path

from fingersplit_client import Client

mesh, folder = sys.argv[1], Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
table = {"support_surfaces": [{"id": "table"}]}
above = {"directions": [{"axis": [0, 0, -1], "max_angle": 0.6}]}
with Client() as client:
    result = client.plan(mesh, mass=0.3, scene=table, approach=above, starts=32)
    (folder / "grasps.json").write_bytes(result.export("moveit"))
    (folder / "curobo.json").write_bytes(result.export("curobo"))
    print(result, result.best.tool_pose, sep="\n")
