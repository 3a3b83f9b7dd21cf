"""What makes a grasp good: the objective, metrics and the forces that hold."""
