"""The service with the fakes in place of the planner, as a process of its own: data directory and port as arguments."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "support"))

import fake_workers

from fingersplit_service.app import create_app
from fingersplit_service.listening import serve_app
from fingersplit_service.settings import ServiceSettings

if __name__ == "__main__":
    settings = ServiceSettings(data_dir=Path(sys.argv[1]), port=int(sys.argv[2]), workers=2, log_level="warning")
    serve_app(create_app(settings, fake_workers.FUNCTIONS), settings)
