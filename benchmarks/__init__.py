"""Speed and quality of the planner over a folder of objects; run with ``make bench``."""
