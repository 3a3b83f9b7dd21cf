// Data sets and batches with their progress, and a form that asks for a data set.

import * as api from "./api.js";
import { find, forgive, h, report, show } from "./dom.js";
import { ago, exact, words } from "./format.js";

const AGAIN = 2000; // [ms]
const MAX_OBJECTS = 100;
const form = find("form");
const KINDS = { complete: "good", running: "busy", cancelled: "" };

const share = (done, all) => h("progress", { max: all, value: done, "aria-label": `${done} of ${all}` });

function line(one) {
  return h(
    "tr",
    { "data-set": one.id },
    h("td", { class: "name" }, h("a", { class: "object", href: api.links.dataset(one.id) }, one.name), h("p", { class: "hint" }, one.hand)),
    h("td", {}, h("span", { class: `badge ${KINDS[one.state]}` }, words(one.state))),
    h("td", {}, share(one.selected, one.wanted), h("span", { class: "hint" }, `${one.selected} of ${one.wanted}`)),
    h("td", { class: "number" }, `${one.done} of ${one.objects}`),
    h("td", { class: "number" }, one.failed),
    h("td", {}, h("time", { datetime: one.created_at, title: exact(one.created_at) }, ago(one.created_at))),
  );
}

function batch(one) {
  const all = Object.values(one.states).reduce((sum, count) => sum + count, 0);
  const ended = ["succeeded", "failed", "cancelled"].reduce((sum, state) => sum + (one.states[state] ?? 0), 0);
  const said = Object.entries(one.states).map(([state, count]) => `${count} ${state}`).join(", ");
  return h("li", {}, h("a", { href: api.links.batch(one.id) }, `${all} ${all === 1 ? "job" : "jobs"}`), h("p", { class: "hint" }, said), share(ended, all));
}

async function load() {
  try {
    const [sets, batches] = await Promise.all([api.datasets(), api.batches()]);
    forgive();
    find("#sets tbody").replaceChildren(...sets.items.map(line));
    show(find(".scroll"), sets.items.length > 0);
    show(find("#no-sets"), sets.items.length === 0);
    const shown = batches.items.map(batch);
    find(".batches").replaceChildren(...(shown.length ? shown : [h("li", { class: "hint" }, "No batches yet.")]));
    const busy = sets.items.some((one) => one.state === "running") || batches.items.some((one) => one.states.queued || one.states.running);
    if (busy) setTimeout(load, AGAIN);
  } catch (error) {
    report(error);
  }
}

async function choices() {
  const [objects, hands] = await Promise.all([api.objects(MAX_OBJECTS), api.hands()]);
  const boxes = objects.items.map((one) =>
    h("label", { class: "check" }, h("input", { type: "checkbox", name: "object", value: one.id }), one.name),
  );
  find("#objects").append(...(boxes.length ? boxes : [h("p", { class: "hint" }, "No objects yet; upload one with a new run.")]));
  form.elements.hand.append(...hands.map((hand) => h("option", { value: hand.name }, hand.name)));
  form.elements.hand.value = "barrett";
}

async function ask(event) {
  event.preventDefault();
  forgive();
  const said = new FormData(form);
  try {
    if (!said.has("object")) throw new Error("Choose at least one object.");
    const job = { hand: said.get("hand"), starts: Number(said.get("starts")) };
    if (said.has("table")) job.scene = { support_surfaces: [{ id: "table" }] };
    const asked = { name: said.get("name"), objects: said.getAll("object"), per_object: Number(said.get("per_object")), verified: said.has("verified"), job };
    const made = await api.createDataset(asked);
    location.assign(api.links.dataset(made.id));
  } catch (error) {
    report(error);
    find("#problem").scrollIntoView({ block: "center" });
  }
}

form.addEventListener("submit", ask);
choices().catch(report);
load();
