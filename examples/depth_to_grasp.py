"""From a depth camera to a grasp in the world: python depth_to_grasp.py VIEW.npz.

VIEW has `depth` (h, w), `intrinsics` (fx, fy, cx, cy or 3x3) and `mask` (h, w), whose pixels are the object's. The
camera looks down from half a metre.
"""

import sys

from fingersplit_client import Client

POSE = (0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0)
"""world_from_camera: x, y, z [m] and w, x, y, z; the optical axis points down."""

with Client() as client:
    viewed = client.scenes.from_depth(sys.argv[1], camera_pose=POSE)
    result = client.plan(viewed.object, scene=viewed.scene, starts=48)
    print(result, result.best.tool_pose, sep="\n")
