"""Contact mechanics: grasp matrix, friction cones, forces, margins and metrics."""
