// One batch: its jobs and how far they are together.

import * as api from "./api.js";
import { absent, find, forgive, h, report, show } from "./dom.js";
import { duration, standing, took } from "./format.js";

const AGAIN = 1500; // [ms]
const id = location.pathname.split("/").at(-1);

function line(job) {
  const [kind, label] = standing(job);
  return h(
    "tr",
    {},
    h("td", { class: "name" }, h("a", { class: "object", href: api.links.run(job.id) }, job.object_name)),
    h("td", {}, h("span", { class: `badge ${kind}`, title: job.error?.detail }, label)),
    h("td", {}, job.hand),
    h("td", { class: "number" }, job.feasible ?? "–"),
    h("td", { class: "number" }, job.verified ?? "–"),
    h("td", { class: "number" }, duration(took(job))),
  );
}

function draw(batch, jobs) {
  show(find("#batch"));
  const all = batch.job_ids.length;
  const ended = all - (batch.states.queued ?? 0) - (batch.states.running ?? 0);
  find(".lead").textContent = `${all} ${all === 1 ? "job" : "jobs"}: ${Object.entries(batch.states).map(([state, count]) => `${count} ${state}`).join(", ")}.`;
  Object.assign(find("#batch > progress"), { max: all, value: ended });
  find("[role=status]").textContent = `${ended} of ${all} ${all === 1 ? "job has" : "jobs have"} ended`;
  find("tbody").replaceChildren(...jobs.items.reverse().map(line));
  show(find("#cancel"), ended < all);
  return ended < all;
}

async function load() {
  try {
    const [batch, jobs] = await Promise.all([api.batch(id), api.jobs({ batch_id: id, limit: 1000 })]);
    forgive();
    if (draw(batch, jobs)) setTimeout(load, AGAIN);
  } catch (error) {
    absent(error, "batch");
  }
}

find("#cancel").addEventListener("click", () => api.cancelBatch(id).catch(report));
load();
