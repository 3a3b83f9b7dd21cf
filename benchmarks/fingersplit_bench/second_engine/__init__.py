"""Section `second_engine`: the same grasps executed in Drake, with hydroelastic contact."""
