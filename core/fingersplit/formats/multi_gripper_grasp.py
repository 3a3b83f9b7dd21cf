"""MultiGripperGrasp files: JSON with one gripper, one object, poses and joint values side by side."""

import json

from fingersplit.formats.results import Results

__all__ = ["write_multi_gripper_grasp"]


def write_multi_gripper_grasp(results: Results) -> bytes:
    """``gripper, object_ID, pose`` (xyz [m], wxyz; palm in the object frame) and ``dofs`` [rad], one row a grasp."""
    document = {
        "gripper": results.hand.name,
        "object_ID": results.object_name,
        "pose": [[*grasp.grasp.position.tolist(), *grasp.grasp.wxyz.tolist()] for grasp in results.grasps],
        "dofs": [grasp.grasp.joints.tolist() for grasp in results.grasps],
        "fingersplit": results.provenance,
    }
    return (json.dumps(document, indent=2) + "\n").encode()
