"""For whoever operates the service: logs, metrics, traces, retention, and a check of the installation."""
