"""Grasps of a data set's gripper as starts for a hand: python other_starts.py OBJECT GRASPS [GRIPPER [SCALE]].

GRASPS is a file of ACRONYM, Dex-Net, GraspGen, graspnetAPI or Isaac; its jaws are closed on the mesh, and the two
contacts of each grasp become starts. SCALE is what the data set multiplies its mesh by.
"""

import sys

from fingersplit_client import Client

mesh, grasps, *more = sys.argv[1:]
gripper, scale = (*more, None, None)[:2]
with Client() as client:
    uploaded = client.objects.upload(mesh, scale=float(scale or 1.0))
    starts = client.parallel_grasps.import_file(uploaded.id, grasps, gripper=gripper)
    print(starts.message)
    print(client.plan(uploaded, parallel_grasp_set=starts.id, starts=16))
