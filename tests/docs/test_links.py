"""Files that the pages outside of the site name are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "page", ["README.md", "CONTRIBUTING.md", "REFERENCES.md", "SECURITY.md", "benchmarks/README.md"]
)
def test_every_file_that_a_page_links_to_is_there(page):
    text = (ROOT / page).read_text()
    links = {link.partition("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link}
    assert [link for link in sorted(links - {""}) if not ((ROOT / page).parent / link).exists()] == []
