"""From object to ranked grasps."""
