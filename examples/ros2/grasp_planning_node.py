"""A ROS 2 node that serves moveit_msgs/GraspPlanning with a Fingersplit service.

    ros2 run demo_nodes_cpp ...            # any workspace with moveit_msgs sourced
    FINGERSPLIT_SERVER=http://host:8000 python grasp_planning_node.py --ros-args -p verified:=1

The target needs a mesh; movable obstacles and the first support surface become the scene. Where the target's pose is
known in its header frame, grasps come back in that frame.
"""

import rclpy
from conversions import FAILURE, SUCCESS, grasp_fields, mesh_of, scene_of
from moveit_msgs.msg import Grasp
from moveit_msgs.srv import GraspPlanning
from rclpy.node import Node
from rosidl_runtime_py import set_message_fields

from fingersplit_client import Client, FingersplitClientError


class GraspPlanner(Node):
    """Answers ``plan_grasps``."""

    def __init__(self) -> None:
        super().__init__("fingersplit")
        options = {"hand": "barrett", "starts": 64, "top_k": 10, "verified": 0, "mass": 0.0, "friction": 0.0}
        for name, value in options.items():
            self.declare_parameter(name, value)
        self._names, self._client = tuple(options), Client()
        self.create_service(GraspPlanning, "plan_grasps", self.plan)

    def plan(self, request: GraspPlanning.Request, response: GraspPlanning.Response) -> GraspPlanning.Response:
        """Plan for the target of a request."""
        given = {name: self.get_parameter(name).value for name in self._names}
        told = {name: value for name, value in given.items() if name not in ("mass", "friction") or value > 0}
        try:
            scene = scene_of(request.target, request.movable_obstacles, request.support_surfaces)
            result = self._client.plan(mesh_of(request.target), name=request.target.id, scene=scene, **told)
            for fields in grasp_fields(result.export("moveit"), request.target):
                grasp = Grasp()
                set_message_fields(grasp, fields)
                response.grasps.append(grasp)
            response.error_code.val = SUCCESS
        except (FingersplitClientError, ValueError) as error:
            self.get_logger().error(str(error))
            response.error_code.val = FAILURE
        return response


def main() -> None:
    """Run the node until it is stopped."""
    rclpy.init()
    rclpy.spin(GraspPlanner())


if __name__ == "__main__":
    main()
