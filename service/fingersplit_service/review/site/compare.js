// Two runs side by side: what was asked differently, how the best grasps differ, and both quality curves.

import * as api from "./api.js";
import { qualityChart } from "./chart.js";
import { absent, card, find, h, show } from "./dom.js";
import { ago, brief, duration, exact, heading, number, sentence, standing, took } from "./format.js";
import { flat, shown } from "./request.js";

const KEYS = ["first", "second"];
const NAMES = ["Before", "After"];

async function load() {
  const asked = new URLSearchParams(location.search);
  const ids = [asked.get("a"), asked.get("b")];
  if (ids.some((id) => !id)) throw new Error("Tick two runs in the list of runs, then choose Compare.");
  const [known, ...jobs] = await Promise.all([api.metrics(), ...ids.map(api.job)]);
  jobs.sort((a, b) => new Date(a.created_at) - new Date(b.created_at));
  const unfinished = jobs.find((job) => !job.result);
  if (unfinished) throw new Error(`The run of ${unfinished.object_name} has no result to compare.`);
  const best = jobs.map((job) => job.result.grasps[0]);
  find(".lead").textContent = summary(jobs, best);
  const place = find("#comparison");
  place.append(
    h("div", { class: "pair" }, jobs.map(head)),
    h("div", { class: "columns" }, card("Quality of the best grasps", { wide: true }, await curves(jobs, best)), card("Outcome", {}, metrics(jobs, best, known)), card("Request", {}, parameters(jobs))),
  );
  show(place);
}

function summary(jobs, best) {
  if (best.some((grasp) => !grasp)) return "One of the runs found no grasp.";
  const [before, after] = best.map((grasp) => grasp.metrics.holding_margin);
  const same = jobs[0].object_id === jobs[1].object_id ? "" : " The objects differ.";
  if (before === null || after === null) return same.trim();
  if (before === after) return `The best grasps hold with the same margin, ${number(before)} N.${same}`;
  const change = `${number(Math.abs(after - before))} N ${after > before ? "more" : "less"}`;
  return `The later run's best grasp holds with ${change} to spare: ${number(after)} N instead of ${number(before)} N.${same}`;
}

function head(job, index) {
  const [kind, label] = standing(job);
  return h(
    "section",
    { class: "card", "aria-label": NAMES[index] },
    job.result.grasps.length ? h("img", { class: "thumbnail", src: api.links.thumbnail(job.id), alt: `Best grasp of ${job.object_name}` }) : h("span", { class: "thumbnail" }),
    h(
      "div",
      {},
      h("p", { class: `key ${KEYS[index]}` }, NAMES[index]),
      h("h2", {}, h("a", { href: api.links.run(job.id) }, job.object_name)),
      h("p", {}, h("span", { class: `badge ${kind}` }, label)),
      h("p", { class: "hint" }, h("time", { datetime: job.created_at, title: exact(job.created_at) }, ago(job.created_at))),
    ),
  );
}

async function curves(jobs, best) {
  const series = [];
  for (const [index, job] of jobs.entries()) {
    if (!best[index]) continue;
    try {
      series.push({ name: NAMES[index], ...(await api.curve(job.id, best[index].rank)) });
    } catch (error) {
      return h("p", { class: "hint" }, error.message);
    }
  }
  return series.length ? qualityChart(series, "Quality of the best grasps", true) : h("p", { class: "hint" }, "Neither run found a grasp.");
}

function metrics(jobs, best, known) {
  const value = (pick) => best.map((grasp) => (grasp ? pick(grasp) : null));
  const rows = [
    ...known.map((metric) => [heading(metric), value((grasp) => grasp.metrics[metric.name] ?? null), metric.higher_is_better ? 1 : -1, number]),
    ["Largest pad angle, rad", value((grasp) => Math.max(...grasp.contacts.map((contact) => contact.pad_angle))), -1, number],
    ["Q gained over the start", value((grasp) => grasp.metrics.quality - grasp.initial.quality), 1, number],
    ["Feasible starts", jobs.map((job) => job.result.summary.feasible), 1, String],
    ["Held in simulation", jobs.map((job) => (job.request.verified ? job.verified : null)), 1, String],
    ["CPO iterations", value((grasp) => grasp.iterations.cpo), 0, String],
    ["PPO iterations", value((grasp) => grasp.iterations.ppo), 0, String],
    ["Planning", jobs.map((job) => job.result.timings_ms.total), -1, duration],
    ["Total time", jobs.map(took), -1, duration],
  ];
  return grid(["", ...NAMES, "Change"], rows.map(([label, pair, sense, text]) => deltaRow(label, pair, sense, text)));
}

// sense: 1 where more is better, -1 where less is better, 0 where neither is.
function deltaRow(label, [before, after], sense, text) {
  const known = before !== null && after !== null;
  const change = known ? after - before : 0;
  const sign = change > 0 ? "+" : "−";
  const share = known && before && change ? h("span", { class: "share" }, ` (${sign}${brief(Math.abs((100 * change) / before), 2)} %)`) : null;
  const kind = change * sense > 0 ? "better" : change * sense < 0 ? "worse" : null;
  const said = !known ? "–" : change === 0 ? "same" : `${sign}${text(Math.abs(change))}`;
  const cells = [before, after].map((value) => h("td", { class: "number" }, value === null ? "–" : text(value)));
  return h("tr", {}, h("th", { scope: "row" }, label), ...cells, h("td", { class: kind ? `number ${kind}` : "number" }, said, share, kind ? h("span", { class: "visually-hidden" }, `, ${kind}`) : null));
}

function parameters(jobs) {
  const asked = jobs.map((job) => {
    const { planner, parallel_grasps: grasps, ...rest } = job.request;
    return Object.fromEntries(flat({ object: job.object_name, ...rest, parallel_grasps: grasps ? `${grasps.length} given` : "found", ...planner }));
  });
  const names = [...new Set(asked.flatMap(Object.keys))];
  const text = (value) => (value === undefined ? "default" : shown(value));
  const rows = names.map((name) => {
    const [before, after] = asked.map((one) => text(one[name]));
    const changed = before !== after;
    return [changed, h("tr", { class: changed ? "changed" : null }, h("th", { scope: "row" }, sentence(name)), h("td", { class: "mono" }, before), h("td", { class: "mono" }, after), h("td", { class: "note-of-change" }, changed ? "changed" : ""))];
  });
  const table = (changed) => grid(["Parameter", ...NAMES, ""], rows.filter((row) => row[0] === changed).map(([, row]) => row));
  const equal = rows.filter(([changed]) => !changed).length;
  return [
    equal < rows.length ? table(true) : h("p", { class: "hint" }, "The same was asked for."),
    h("details", {}, h("summary", {}, `${equal} parameters that are the same`), table(false)),
  ];
}

function grid(heads, rows) {
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": heads[0] || "Outcome" }, h("table", { class: "pairs" }, h("thead", {}, h("tr", {}, heads.map((head, index) => h("th", { scope: "col", class: index && heads[0] === "" ? "number" : null }, head)))), h("tbody", {}, rows)));
}

load().catch((error) => absent(error, "run"));
