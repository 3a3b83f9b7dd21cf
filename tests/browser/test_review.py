"""The review pages as a person uses them, in a real browser: by mouse and by keyboard, on a laptop and on a phone."""

import re

import pytest
from playwright.sync_api import expect

from fingersplit.objects.parametric import PARAMETRIC_OBJECTS
from fingersplit_client import Client, JobCreate
from pages import LAPTOP, MUG, PHONE

PICTURES_ARE_THERE = """
() => {
  const all = [...document.querySelectorAll(".runs img.thumbnail")];
  return all.length > 0 && all.every((one) => one.naturalWidth === 192);
}
"""
VIEWER_OPENS_WITHIN = 240_000  # [ms]; the renderer is software


def plan_a_mug(page, verified=0):
    """Fill the form and send it."""
    page.get_by_label("Choose a mesh file").set_input_files(MUG)
    page.get_by_label("metres", exact=True).check()
    page.get_by_label("Starts").fill("24")
    page.get_by_label("Seed").fill("3")
    page.get_by_label("Grasps to verify").fill(str(verified))
    page.get_by_role("button", name="Plan", exact=True).click()


def test_a_mesh_becomes_a_verified_grasp_and_a_recording_that_opens(visit, keep):
    page = visit("/review/new")
    keep(page, "new-laptop-light")
    plan_a_mug(page, verified=1)
    expect(page.locator(".steps li.now, .steps li.done").first).to_be_visible()
    see = page.get_by_role("link", name="See the run")
    expect(see).to_be_visible(timeout=180_000)
    expect(page.locator("#verdict")).to_have_text("One grasp held in simulation")
    expect(page.locator(".steps li")).to_have_count(8)
    expect(page.locator(".steps li.done")).to_have_count(8)
    expect(see).to_be_focused()
    expect(page.locator(".outcome img")).to_have_js_property("naturalWidth", 192)
    keep(page, "planned-laptop-light")
    see.click()
    expect(page.get_by_role("heading", level=1)).to_have_text("mug")
    expect(page.get_by_text(re.compile(r"of \d+$"))).to_be_visible()
    assert page.locator(".grasps .badge", has_text="held").count() >= 1
    expect(page.locator(".chart .line").first).to_be_visible()
    assert {"cpo", "ppo"} & set(
        page.locator(".chart .phase").evaluate_all("all => all.flatMap(one => [...one.classList])")
    )
    page.get_by_role("button", name="Open the recording").click()
    recording = page.locator("#recording")
    expect(recording).to_have_attribute("data-state", re.compile("open|failed"), timeout=VIEWER_OPENS_WITHIN)
    expect(recording).to_have_attribute("data-state", "open")
    page.wait_for_timeout(3_000)  # a frame or two
    keep(page, "viewer-laptop-light", full=False)


def test_a_form_that_is_not_complete_says_what_is_missing(visit):
    page = visit("/review/new")
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.get_by_role("alert")).to_have_text("Choose a mesh file first.")
    page.get_by_label("Choose a mesh file").set_input_files(MUG)
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("Say the unit")
    page.get_by_label("metres", exact=True).check()
    page.get_by_label("Starts").fill("0")
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("Starts")


def test_a_file_that_is_no_mesh_is_refused_with_the_reason(visit, tmp_path):
    page = visit("/review/new", tolerates="status of 4")
    faulty = tmp_path / "faulty.stl"
    faulty.write_bytes(b"solid nothing")
    page.get_by_label("Choose a mesh file").set_input_files(faulty)
    page.get_by_label("millimetres").check()
    with page.expect_response("**/v1/objects") as answered:
        page.get_by_role("button", name="Plan", exact=True).click()
    detail = answered.value.json()["detail"]
    expect(page.get_by_role("alert")).to_contain_text(detail)
    expect(page.get_by_role("button", name="Plan", exact=True)).to_be_visible()


def test_the_list_finds_runs_and_two_of_them_are_compared(visit, keep, runs):
    page = visit("/review")
    rows = page.locator(".runs tbody tr")
    expect(rows.first).to_be_visible()
    page.wait_for_function(PICTURES_ARE_THERE)
    keep(page, "list-laptop-light")
    page.get_by_label("Object", exact=True).fill("nothing like it")
    expect(page.get_by_role("heading", name="No run matches")).to_be_visible()
    page.get_by_label("Object", exact=True).fill("A CAN")
    expect(rows).to_have_count(2)
    assert "object_name=A+CAN" in page.url
    for run in runs:
        page.locator(f"[data-job='{run}']").get_by_role("checkbox").check()
    page.get_by_role("link", name="Compare", exact=True).click()
    expect(page.get_by_role("heading", name="Comparison")).to_be_visible()
    changed = page.locator("tr.changed th")
    expect(changed).to_have_text(["Starts", "Friction"])
    expect(page.locator(".chart .line")).to_have_count(2)
    expect(page.locator(".pair h2")).to_have_text(["a can", "a can"])
    keep(page, "compare-laptop-light")


def test_everything_can_be_reached_with_the_keyboard(visit, runs):
    page = visit("/review")
    expect(page.locator(".runs tbody tr").first).to_be_visible()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    page.keyboard.press("Enter")
    reached = set()
    for _ in range(40):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.textContent.trim()"))
    assert {"New run", "search", "state", "hand", "a can"} <= reached
    page.get_by_role("link", name="a can").first.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("a can")
    second = page.get_by_role("button", name="Show grasp 2")
    second.focus()
    page.keyboard.press("Enter")
    expect(page.locator(".grasps tr[data-rank='2']")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_role("heading", name="Recording of grasp 2")).to_be_visible()
    outline = second.evaluate("element => getComputedStyle(element).outlineStyle")
    assert outline == "solid"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_everything_without_scrolling_sideways(visit, keep, runs, scheme):
    for name, path in (
        ("list", "/review"),
        ("run", f"/review/runs/{runs[0]}"),
        ("compare", f"/review/compare?a={runs[0]}&b={runs[1]}"),
        ("new", "/review/new"),
        ("login", "/review/login"),
    ):
        page = visit(path, size=PHONE, scheme=scheme)
        page.wait_for_load_state("networkidle")
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"], name
        assert "[object" not in page.locator("main").inner_text(), name
        if name == "compare":
            assert page.locator(".scroll").evaluate_all("all => all.every(one => one.scrollWidth <= one.clientWidth)")
        keep(page, f"{name}-phone-{scheme}")


def test_light_and_dark_are_readable(visit, keep, runs):
    for scheme in ("light", "dark"):
        page = visit(f"/review/runs/{runs[0]}", scheme=scheme)
        page.wait_for_load_state("networkidle")
        keep(page, f"run-laptop-{scheme}")
        for selector in ("body", ".lead", ".badge", ".tile dt", ".facts dt", "a"):
            assert page.locator(selector).first.evaluate(CONTRAST) >= 4.5, (scheme, selector)


CONTRAST = """
element => {
  const parts = (color) => color.match(/[\\d.]+/g).map(Number);
  let ground = element;
  while (parts(getComputedStyle(ground).backgroundColor)[3] === 0) ground = ground.parentElement;
  const luminance = ([r, g, b]) => {
    const [x, y, z] = [r, g, b].map((v) => ((v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * x + 0.7152 * y + 0.0722 * z;
  };
  const colors = [getComputedStyle(element).color, getComputedStyle(ground).backgroundColor];
  const both = colors.map((color) => luminance(parts(color)));
  return (Math.max(...both) + 0.05) / (Math.min(...both) + 0.05);
}
"""
"""Contrast of an element's text against what lies behind it, as WCAG defines it."""


def test_a_run_is_deleted_with_its_page(visit, service, runs):
    # What the page still loads of the run when that is deleted is answered with 404 or 409, which the console notes.
    page = visit("/review/new", tolerates="Failed to load resource")
    plan_a_mug(page)
    page.get_by_role("link", name="See the run").click(timeout=180_000)
    expect(page.get_by_role("heading", level=1)).to_have_text("mug")
    run = page.url.rpartition("/")[2].partition("?")[0]
    page.once("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Delete").click()
    page.wait_for_url("**/review")
    answer = page.request.get(f"/v1/jobs/{run}")
    assert answer.status == 404


def test_a_name_with_markup_is_text_and_a_long_one_is_broken(visit, service, tmp_path):
    name = f"<img src=x onerror=alert(1)>{'_and_more' * 12}"
    PARAMETRIC_OBJECTS["box"]().trimesh.export(tmp_path / "box.ply")
    with Client(service) as client:
        box = client.objects.upload(tmp_path / "box.ply", unit="m", name=name)
        client.jobs.create(JobCreate(object_id=box.id, starts=1))
    page = visit("/review")
    expect(page.get_by_role("link", name=name).first).to_be_visible()
    assert page.locator("img[src='x']").count() == 0
    for size in (LAPTOP, PHONE):
        for path in ("/review", "/review/datasets"):
            page = visit(path, size=size)
            expect(page.get_by_text(name).first).to_be_visible()
            assert page.evaluate("document.documentElement.scrollWidth") <= size["width"], path


def test_what_is_not_there_is_said_on_a_page(visit):
    page = visit("/review/nothing", tolerates="status of 404")
    expect(page.get_by_role("heading", level=1)).to_have_text("Page not found")
    page = visit(f"/review/runs/{'0' * 32}", tolerates="status of 404")
    expect(page.get_by_role("alert")).to_have_text("There is no such run. It may have been deleted.")


def test_planning_again_keeps_what_the_form_has_no_field_for(visit, runs):
    page = visit("/review", tolerates="ERR_FAILED")  # of the request that is kept from being sent

    def asked_for_more(route):
        answer = route.fetch()
        job = answer.json()
        job["request"].update(top_k=3, protocol="pick")
        route.fulfill(response=answer, json=job)

    page.route(f"**/v1/jobs/{runs[0]}", asked_for_more)
    page.goto(f"/review/new?from={runs[0]}")
    expect(page.get_by_label("Protocol")).to_have_value("pick")
    page.get_by_label("Starts").fill("7")
    page.route("**/v1/jobs", lambda route: route.abort())
    with page.expect_request("**/v1/jobs") as sent:
        page.get_by_role("button", name="Plan", exact=True).click()
    assert {"starts": 7, "top_k": 3, "protocol": "pick"}.items() <= sent.value.post_data_json.items()
