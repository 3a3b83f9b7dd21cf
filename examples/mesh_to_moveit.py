"""From a mesh to a MoveIt grasp in the robot's frame: python mesh_to_moveit.py mug.ply mug_grasp.json.

The object stands half a metre before the robot's base. `FINGERSPLIT_SERVER` says where the service listens.
"""

import sys
from pathlib import Path

from fingersplit_client import Client

with Client() as client:
    grasp = client.plan(sys.argv[1], mass=0.3, friction=0.6, verified=1).best
    placed = grasp.in_frame(((0.5, 0.0, 0.0), (1, 0, 0, 0)), "base_link")
    Path(sys.argv[2]).write_bytes(placed.export("moveit"))
    print(placed, placed.matrix, grasp.joint_vector(list(grasp.joints), at="squeeze"), sep="\n")
