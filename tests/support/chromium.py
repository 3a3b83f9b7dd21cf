"""A Chromium for the browser tests: one that is there, else installed, else a sentence that says what to install.

Run as a program it makes sure that there is one.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
NONE = (
    "The browser tests need Chromium, and none could be installed. Install your system's package 'chromium', or run "
    f"'{sys.executable} -m playwright install --with-deps chromium', or set FINGERSPLIT_CHROMIUM to its path."
)


def find_chromium() -> Path | None:
    """The browser named in FINGERSPLIT_CHROMIUM, the system's, or Playwright's; None when there is none."""
    named = os.environ.get("FINGERSPLIT_CHROMIUM")
    for name in [named] if named else NAMES:
        path = shutil.which(name)
        if path:
            return Path(path)
    with sync_playwright() as playwright:
        path = playwright.chromium.executable_path
    return Path(path) if Path(path).exists() else None


def ensure_chromium() -> Path:
    """As ``find_chromium``, after installing one if need be.

    Raises:
        SystemExit: There is none and none could be installed.
    """
    ways = [[sys.executable, "-m", "playwright", "install", "chromium"]]
    if os.geteuid() == 0 and shutil.which("apt-get"):
        ways += [["apt-get", "update", "--quiet"], ["apt-get", "install", "--yes", "--quiet", "chromium"]]
    for way in ways:
        found = find_chromium()
        if found:
            return found
        subprocess.run(way, check=False)
    found = find_chromium()
    if found is None:
        sys.exit(NONE)
    return found


if __name__ == "__main__":
    print(ensure_chromium())
