"""For whoever operates the service: health, retention, moving data, and a check of the installation."""
