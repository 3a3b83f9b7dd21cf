"""Pages of data sets and batches, from the form to the downloaded shard; and `/docs` in the system's colours."""

import h5py
from playwright.sync_api import expect

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_client import Client, JobCreate
from pages import PHONE

FILLED_WITHIN = 240_000  # [ms]


def test_a_data_set_is_asked_for_followed_and_downloaded(visit, service, keep, tmp_path):
    PARAMETRIC_OBJECTS["cylinder"]().trimesh.export(tmp_path / "can.ply")
    with Client(service) as client:
        can = client.objects.upload(tmp_path / "can.ply", name="a tin for sets")
        client.batches.create([JobCreate(object_id=can.id, starts=4, seed=seed) for seed in range(2)])
    page = visit("/review/datasets")
    page.get_by_label("Name", exact=True).fill("cans")
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("alert")).to_have_text("Choose at least one object.")
    page.get_by_label("a tin for sets").check()
    page.get_by_label("Grasps per object").fill("2")
    page.get_by_label("Starts per round").fill("6")
    page.get_by_label("Count only grasps that held").uncheck()
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("heading", level=1)).to_have_text("cans")
    expect(page.locator(".title-row .badge")).to_have_text("complete", timeout=FILLED_WITHIN)
    expect(page.locator("[role=status]")).to_have_text("2 of 2 grasps")
    keep(page, "set-laptop-light")
    with page.expect_download() as downloaded:
        page.get_by_role("link", name="Download: Round 0").first.click()
    with h5py.File(downloaded.value.path()) as shard:
        assert shard.attrs["object_file"] == "a tin for sets"
    page.get_by_role("link", name="All data sets").click()
    expect(page.locator("#sets tbody tr").first).to_contain_text("cans")
    keep(page, "sets-laptop-light")
    page.locator(".batches a").first.click()
    expect(page.locator("tbody tr")).to_have_count(2)
    expect(page.locator("[role=status]")).to_have_text("2 of 2 jobs have ended", timeout=FILLED_WITHIN)
    keep(page, "batch-laptop-light")
    for scheme in ("light", "dark"):
        narrow = visit("/review/datasets", size=PHONE, scheme=scheme)
        narrow.wait_for_load_state("networkidle")
        assert narrow.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        keep(narrow, f"sets-phone-{scheme}")
        narrow.locator("#sets a").first.click()
        expect(narrow.locator("#set tbody tr")).to_have_count(1)
        assert narrow.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        keep(narrow, f"set-phone-{scheme}")


def test_the_interactive_documentation_follows_the_colour_scheme(visit, keep):
    grounds = {}
    for scheme in ("light", "dark"):
        page = visit("/docs", scheme=scheme)
        expect(page.locator(".opblock").first).to_be_visible()
        grounds[scheme] = page.evaluate("() => getComputedStyle(document.documentElement).backgroundColor")
        keep(page, f"docs-laptop-{scheme}", full=False)
    assert grounds["light"] != grounds["dark"]
    changed = visit("/docs", scheme="light")
    expect(changed.locator(".opblock").first).to_be_visible()
    changed.emulate_media(color_scheme="dark")
    expect(changed.locator("html")).to_have_class("dark-mode")
