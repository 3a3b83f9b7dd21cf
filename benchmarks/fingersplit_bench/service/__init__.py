"""What the service adds to planning, what it bears, and what it survives: ``python -m fingersplit_bench.service``."""
