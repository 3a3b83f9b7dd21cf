"""Whether a finished grasp keeps every constraint, measured exactly."""
