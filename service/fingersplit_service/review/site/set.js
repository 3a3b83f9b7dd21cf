// One data set: how far it is, its objects, and its shards to download.

import * as api from "./api.js";
import { absent, find, forgive, h, report, show } from "./dom.js";
import { ago, words } from "./format.js";

const AGAIN = 1500; // [ms]
const id = location.pathname.split("/").at(-1);
const KINDS = { complete: "good", running: "busy", cancelled: "" };

function shard(item, one) {
  const name = `Round ${one.round} of ${item.name}, ${one.selected} of ${one.grasps} grasps count`;
  return h(
    "li",
    {},
    h("a", { href: api.links.shard(id, item.index, one.round), download: one.path.split("/").at(-1), "aria-label": `Download: ${name}`, title: name }, `Round ${one.round}`),
    " ",
    h("a", { class: "hint", href: api.links.run(one.job_id), "aria-label": `See the run: ${name}` }, "run"),
  );
}

function line(item, wanted) {
  const bar = h("progress", { max: wanted, value: item.selected, "aria-label": `Grasps of ${item.name}` });
  return h(
    "tr",
    {},
    h("td", { class: "name" }, item.name),
    h("td", {}, item.split),
    h("td", {}, bar, h("span", { class: "hint" }, `${item.selected} of ${wanted}`)),
    h("td", {}, h("ul", { class: "shards" }, item.shards.map((one) => shard(item, one)))),
    h("td", {}, item.error ? [h("span", { class: "badge warn" }, words(item.error.code)), h("p", { class: "hint" }, item.error.detail)] : item.done ? "" : "being planned"),
  );
}

function tile(name, value) {
  return h("div", { class: "card tile" }, h("dt", {}, name), h("dd", {}, value));
}

function draw(found) {
  document.title = `${found.name} · Fingersplit`;
  show(find("#set"));
  find("h1").textContent = found.name;
  const badge = find(".title-row .badge");
  badge.className = `badge ${KINDS[found.state]}`;
  badge.textContent = words(found.state);
  const { per_object: wanted, verified, job, licence } = found.request;
  const what = verified ? `grasps that held in ${words(job.protocol)}` : "feasible grasps";
  find(".lead").textContent = `${wanted} ${what} of ${found.objects === 1 ? "one object" : `each of ${found.objects} objects`} with ${found.hand}, created ${ago(found.created_at)}.`;
  Object.assign(find("#set > progress"), { max: found.wanted, value: found.selected });
  find("[role=status]").textContent = `${found.selected} of ${found.wanted} grasps`;
  find(".tiles").replaceChildren(
    tile("Grasps", `${found.selected} of ${found.wanted}`),
    tile("Objects done", `${found.done} of ${found.objects}`),
    tile("Objects failed", found.failed),
    tile("Feasible in all", found.feasible),
    tile("Held in all", verified ? found.held : "–"),
    tile("Licence", licence),
  );
  find("tbody").replaceChildren(...found.items.map((item) => line(item, wanted)));
  show(find("#cancel"), found.state === "running");
}

async function load() {
  try {
    const found = await api.dataset(id);
    forgive();
    draw(found);
    if (found.state === "running") setTimeout(load, AGAIN);
  } catch (error) {
    absent(error, "data set");
  }
}

find("#manifest").href = api.links.manifest(id);
find("#manifest").download = "dataset.json";
find("#cancel").addEventListener("click", () => api.cancelDataset(id).then(draw, report));
find("#delete").addEventListener("click", () => {
  if (confirm("Delete this data set with all its runs?")) api.deleteDataset(id).then(() => location.assign("/review/datasets"), report);
});
load();
