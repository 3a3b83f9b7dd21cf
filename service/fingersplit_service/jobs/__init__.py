"""The queue: a job table, warm worker processes, and a dispatcher that brings the two together."""
