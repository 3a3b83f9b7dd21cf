// The list of runs: filters in the address, pages by cursor, two runs to compare.

import * as api from "./api.js";
import { find, forgive, h, report, show } from "./dom.js";
import { ago, duration, exact, number, standing, took } from "./format.js";

const PAGE = 25;
const BUSY_AGAIN = 3000; // [ms]
const form = find(".filters");
const body = find(".runs tbody");
const chosen = new Map();
let cursors = [""];
let asked = 0;
let timer = 0;

function filters() {
  return Object.fromEntries([...new FormData(form)].map(([name, value]) => [name, value.trim()]).filter(([, value]) => value));
}

async function load() {
  clearTimeout(timer);
  const mine = ++asked;
  const section = find("section.card");
  section.setAttribute("aria-busy", "true");
  try {
    const page = await api.jobs({ ...filters(), limit: PAGE, cursor: cursors.at(-1) });
    if (mine !== asked) return; // a later question has been asked
    forgive();
    draw(page);
  } catch (error) {
    if (mine === asked) report(error);
  } finally {
    section.setAttribute("aria-busy", "false");
  }
}

function draw(page) {
  body.replaceChildren(...page.items.map(row));
  show(find(".pager"), page.items.length > 0 || cursors.length > 1);
  find("#newer").disabled = cursors.length === 1;
  find("#older").disabled = !page.next_cursor;
  find("#older").dataset.cursor = page.next_cursor ?? "";
  const filtered = Object.keys(filters()).length > 0;
  show(find(".runs"), page.items.length > 0);
  show(find(".empty"), page.items.length === 0);
  find(".empty h2").textContent = filtered ? "No run matches" : "No runs yet";
  find(".empty p").textContent = filtered
    ? "Change or clear the filters to see more."
    : "Give a mesh and see how a hand would take it. The run appears here with everything the planner did.";
  const first = (cursors.length - 1) * PAGE;
  find(".count").textContent = page.items.length ? `Runs ${first + 1} to ${first + page.items.length}` : "";
  if (page.items.some((job) => !api.hasEnded(job.state))) timer = setTimeout(load, BUSY_AGAIN);
}

function row(job) {
  const [kind, label] = standing(job);
  const known = job.state === "succeeded";
  const picture = known && job.grasps > 0
    ? h("img", { class: "thumbnail", src: api.links.thumbnail(job.id), alt: "", loading: "lazy", width: 88, height: 66 })
    : h("span", { class: "thumbnail" });
  const box = h("input", {
    type: "checkbox",
    checked: chosen.has(job.id),
    disabled: !known,
    "aria-label": `Compare the run of ${job.object_name} from ${exact(job.created_at)}`,
    on: { change: (event) => choose(job, event.target) },
  });
  const picked = known && job.feasible > 0;
  const none = picked && job.verified === 0 && job.verification === "done";
  const verified = picked && job.verified ? h("span", { class: "badge good" }, `${job.verified} held`) : none ? h("span", { class: "badge bad" }, "none held") : null;
  return h(
    "tr",
    { "data-job": job.id },
    h("td", { class: "picture" }, picture),
    h("td", { class: "name" }, h("a", { class: "object", href: api.links.run(job.id) }, job.object_name)),
    h("td", { class: "state" }, h("span", { class: `badge ${kind}` }, label)),
    h("td", { class: "optional" }, job.hand),
    h("td", { class: "number", "data-label": "Holding margin" }, job.holding_margin === null ? "–" : `${number(job.holding_margin)} N`),
    h("td", { class: "number optional" }, job.feasible ?? "–"),
    h("td", { class: "optional verdict" }, verified),
    h("td", { class: "number optional" }, duration(took(job))),
    h("td", { class: "when", "data-label": "Queued" }, h("time", { datetime: job.created_at, title: exact(job.created_at) }, ago(job.created_at))),
    h("td", { class: "choose" }, box),
  );
}

function choose(job, box) {
  if (box.checked) chosen.set(job.id, job.object_name);
  else chosen.delete(job.id);
  if (chosen.size > 2) {
    const [oldest] = chosen.keys();
    chosen.delete(oldest);
    const other = body.querySelector(`[data-job="${oldest}"] input`);
    if (other) other.checked = false;
  }
  drawChoice();
}

function drawChoice() {
  show(find(".compare-bar"), chosen.size > 0);
  const names = [...chosen.values()];
  find(".compare-bar p").textContent = names.length === 2 ? `${names[0]} and ${names[1]}` : `${names[0] ?? ""}: choose one more run`;
  const [a, b] = chosen.keys();
  const link = find("#compare");
  show(link, chosen.size === 2);
  link.href = `/review/compare?a=${a}&b=${b}`;
}

function restart() {
  cursors = [""];
  const query = new URLSearchParams(filters());
  history.replaceState(null, "", query.size ? `?${query}` : location.pathname);
  load();
}

async function start() {
  const asks = new URLSearchParams(location.search);
  for (const name of ["object_name", "state"]) form.elements[name].value = asks.get(name) ?? "";
  let typing = 0;
  form.addEventListener("input", () => {
    clearTimeout(typing);
    typing = setTimeout(restart, 200);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(restart));
  find("#older").addEventListener("click", (event) => {
    cursors.push(event.target.dataset.cursor);
    load();
  });
  find("#newer").addEventListener("click", () => {
    cursors.pop();
    load();
  });
  find("#forget").addEventListener("click", () => {
    chosen.clear();
    for (const box of body.querySelectorAll("input")) box.checked = false;
    drawChoice();
  });
  load();
  try {
    const known = await api.hands();
    form.elements.hand.append(...known.map((hand) => h("option", { value: hand.name }, hand.name)));
    if (asks.get("hand")) {
      form.elements.hand.value = asks.get("hand");
      restart();
    }
  } catch {
    // the filter by hand stays empty while the workers start
  }
}

start();
