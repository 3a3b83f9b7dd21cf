"""Grasp planning over HTTP: endpoints, the job table and worker processes around the planner."""
