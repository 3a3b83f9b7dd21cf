"""A grasp in three dimensions on its run's page: drawn, moved through its moments, addressed, and not drawn at all."""

import re

import pytest
from playwright.sync_api import expect

DRAWN_WITHIN = 120_000  # [ms]; the renderer is software
NO_WEBGL = "HTMLCanvasElement.prototype.getContext = () => null;"


def drawn(page):
    """The view of a page, once it is drawn."""
    view = page.locator("#view")
    expect(view).to_have_attribute("data-state", re.compile("drawn|failed"), timeout=DRAWN_WITHIN)
    expect(view).to_have_attribute("data-state", "drawn")
    return view


def test_a_grasp_is_drawn_and_moved_through_its_moments(visit, keep, cornered):
    page = visit(f"/review/runs/{cornered}")
    page.emulate_media(reduced_motion="reduce")
    view = drawn(page)
    canvas, slider, moment = view.locator("canvas"), view.get_by_label("Moment"), view.locator(".moment")
    expect(canvas).to_have_attribute("data-pictures", re.compile(r"^[1-9]"))
    keep(page, "view-laptop-light", full=False)
    at_first = moment.text_content()
    slider.fill("0")
    expect(moment).to_have_text(re.compile("^Map"))
    assert moment.text_content() != at_first
    assert slider.get_attribute("aria-valuetext") == moment.text_content()
    last = int(slider.get_attribute("max"))
    slider.fill(str(last - 4))
    play = view.get_by_role("button", name="Play")
    play.click()
    expect(view.get_by_role("button", name="Play")).to_be_visible(timeout=DRAWN_WITHIN)  # it ends by itself
    assert int(slider.input_value()) == int(slider.get_attribute("max"))
    view.get_by_role("button", name="Play").click()  # from the beginning
    view.get_by_role("button", name="Pause").click()
    stopped = slider.input_value()
    pictures = canvas.get_attribute("data-pictures")
    page.wait_for_timeout(500)
    assert slider.input_value() == stopped
    assert canvas.get_attribute("data-pictures") == pictures  # what stands still is not drawn again


def test_collision_shapes_and_forces_are_shown_on_demand(visit, keep, cornered):
    page = visit(f"/review/runs/{cornered}")
    page.emulate_media(reduced_motion="reduce")
    view = drawn(page)
    canvas = view.locator("canvas")
    for name in ("Collision shapes", "Forces", "Friction cones"):
        before = canvas.screenshot()
        view.get_by_label(name).click()
        page.wait_for_timeout(300)  # a frame
        assert canvas.screenshot() != before, name
        keep(page, f"view-{name.split()[0].lower()}", full=False)


TO_THE_END = """
() => {
  const slider = document.querySelector("#view input[type=range]");
  slider.value = slider.max;
  slider.dispatchEvent(new Event("input"));
  return document.querySelector("#view .moment").textContent.startsWith("Simulation");
}
"""


def test_the_slider_goes_on_through_the_pick(visit, keep, cornered):
    page = visit(f"/review/runs/{cornered}")
    page.emulate_media(reduced_motion="reduce")
    view = drawn(page)
    page.wait_for_function(TO_THE_END)
    expect(view.locator(".moment")).to_have_text(re.compile(r"^Simulation · hold, [\d.]+ s$"))
    keep(page, "view-picked", full=False)
    forces = page.get_by_role("region", name="Verification").get_by_role("img", name=re.compile("^Contact force"))
    expect(forces.locator(".line")).to_have_count(3)


FADED_AROUND = """
async (canvas) => {
  const seen = new Set();
  for (let turn = 0; turn < 2 * Math.PI; turn += 0.48) {
    for (let step = 0; step < 4; step++) canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
    await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
    seen.add(canvas.dataset.faded);
  }
  return [...seen].sort();
}
"""
"""How many obstacles are faded at one place or another of a turn around the grasp."""


def test_a_wall_is_faded_only_while_it_hides_the_grasp(visit, cornered):
    page = visit(f"/review/runs/{cornered}")
    page.emulate_media(reduced_motion="reduce")
    assert drawn(page).locator("canvas").evaluate(FADED_AROUND) == ["0", "1"]  # never the table, seen from above


@pytest.mark.parametrize("assumed", [None, [False, True, False]])
def test_contacts_on_an_assumed_surface_are_explained(visit, cornered, assumed):
    """As a scene says it that was kept by an older version, and one of a completed cloud."""
    page = visit("/review")

    def changed(route):
        answer = route.fetch()
        scene = answer.json()
        del scene["assumed"]
        route.fulfill(response=answer, json=scene if assumed is None else scene | {"assumed": assumed})

    page.route(re.compile(rf"/v1/jobs/{cornered}/grasps/\d+/scene$"), changed)
    page.goto(f"/review/runs/{cornered}")
    expect(drawn(page).get_by_text("Contact where the surface is assumed")).to_have_count(0 if assumed is None else 1)


def test_a_grasp_has_an_address(visit, cornered):
    page = visit(f"/review/runs/{cornered}?grasp=3")
    drawn(page)
    expect(page.locator(".grasps tr[data-rank='3']")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#view canvas")).to_have_attribute("aria-label", re.compile("^Grasp 3 of "))
    page.get_by_role("button", name="Show grasp 2").click()
    drawn(page)
    assert page.url.endswith("?grasp=2")


def test_without_webgl_the_still_picture_stays_and_the_reason_is_said(visit, keep, cornered):
    page = visit("/review", tolerates="WebGL")
    page.add_init_script(NO_WEBGL)
    page.goto(f"/review/runs/{cornered}")
    view = page.locator("#view")
    expect(view).to_have_attribute("data-state", "failed", timeout=DRAWN_WITHIN)
    still = view.locator("img.still")
    expect(still).to_be_visible()
    expect(still).not_to_have_js_property("naturalWidth", 0, timeout=DRAWN_WITHIN)
    expect(view.get_by_role("alert")).to_contain_text("WebGL")
    expect(view.get_by_role("button", name="Try again")).to_be_visible()
    expect(view.locator("canvas")).to_have_count(0)
    keep(page, "view-without-webgl", full=False)


def test_the_page_says_what_stands_around_and_what_was_reckoned_with(visit, cornered):
    page = visit(f"/review/runs/{cornered}")
    rejected = page.request.get(f"/v1/jobs/{cornered}").json()["result"]["scene"]["rejected_by"]
    assert rejected
    around = page.get_by_role("region", name="Scene")
    for name, count in rejected.items():
        expect(around.locator(".bar", has_text=name).locator("output")).to_have_text(str(count))
    chosen = page.get_by_role("region", name="The chosen grasp")
    expect(chosen.get_by_text("Probability of holding", exact=True)).to_be_visible()
    expect(chosen.get_by_text(re.compile(r"^[\d.]+ mm and [\d.]+°$"))).to_be_visible()
    expect(chosen.get_by_text("Nearest obstacle")).to_be_visible()


@pytest.mark.parametrize("firmly", [True, False])
def test_an_infeasible_grasp_that_held_is_not_called_good(visit, cornered, firmly):
    """As the answer of the service would say it; our own grasps of this run are feasible."""
    page = visit("/review")

    def infeasible(route):
        answer = route.fetch()
        job = answer.json()
        grasp = next(one for one in job["result"]["grasps"] if one["verification"])
        grasp["feasible"], grasp["violations"] = False, ["The thumb is 3 mm inside the object."]
        grasp["verification"]["passed"], grasp["verification"]["held_firmly"] = True, firmly
        route.fulfill(response=answer, json=job)

    page.route(re.compile(rf"/v1/jobs/{cornered}(\?.*)?$"), infeasible)
    page.goto(f"/review/runs/{cornered}")
    badge = page.locator(".grasps .badge", has_text="held")
    expect(badge).to_have_text("held, but infeasible" if firmly else "held, not firmly, but infeasible")
    expect(badge).to_have_class("badge warn")
    expect(page.get_by_text("The thumb is 3 mm inside the object. Do not execute it.")).to_be_visible()
