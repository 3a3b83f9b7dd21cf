"""Benchmarks of the planner: the paper's tables and figures, and our own speed, in one report."""
