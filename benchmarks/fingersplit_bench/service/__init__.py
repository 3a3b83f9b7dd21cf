"""What the service adds to planning, what it bears, and what it survives; run with ``python -m fingersplit_bench.service``."""
