"""The documentation site builds without a warning, and is whole without a network."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_site_builds_without_warnings(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", ROOT / "docs", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "plan_grasps" in (tmp_path / "http.html").read_text() or "/v1/plan" in (tmp_path / "http.html").read_text()
    algorithm = (tmp_path / "algorithm.html").read_text()
    assert "fidelity=paper" in algorithm
    assert "<math" in algorithm
    for page in tmp_path.glob("*.html"):
        assert not re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=\"https?:[^>]*>", page.read_text()), page.name
