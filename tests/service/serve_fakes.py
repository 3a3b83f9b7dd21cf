"""The service with the fakes in place of the planner, as a process: data directory, port, and `work` for an agent."""

import os
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "support"))

import fake_workers

from fingersplit_service.app import create_app, create_worker_app
from fingersplit_service.listening import serve_app
from fingersplit_service.settings import ServiceSettings

if __name__ == "__main__":
    workers = int(os.environ.get("FINGERSPLIT_WORKERS", "2"))
    settings = ServiceSettings(data_dir=Path(sys.argv[1]), port=int(sys.argv[2]), workers=workers, log_level="warning")
    create = create_worker_app if sys.argv[3:] == ["work"] else create_app
    serve_app(create(settings, fake_workers.FUNCTIONS), settings)
