"""What a robot does around a grasp: pre-grasp, approach, squeeze."""
