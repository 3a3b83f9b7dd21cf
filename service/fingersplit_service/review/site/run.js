// One run: outcome, recording, grasps, quality, times, reasons, verification, request and downloads.

import * as api from "./api.js";
import { qualityChart } from "./chart.js";
import { absent, card, facts, find, forgive, h, report, show } from "./dom.js";
import { duration, exact, fixed, heading, number, sentence, standing, took, words } from "./format.js";
import { invite } from "./recording.js";
import { verdict, verificationReport } from "./report.js";
import { viewStarts } from "./starts3d.js";
import { prepare, viewGrasp } from "./view3d.js";
import { requestCard } from "./request.js";
import { noise, ways, world } from "./world.js";

const id = location.pathname.split("/").at(-1);
const quality = h("div");
const details = h("div");
const verified = card("Verification", { wide: true });
const downloads = h("ul", { class: "downloads" });
let metrics = [];
let formats = [];

async function load() {
  prepare(id, /^[1-9]\d*$/.exec(new URLSearchParams(location.search).get("grasp") ?? "")?.[0] ?? null);
  const known = Promise.all([api.metrics(), api.formats()]);
  let job = await api.job(id);
  if (job.result?.grasps.length) prepare(id, (addressed(job) ?? standard(job)).rank);
  [metrics, formats] = await known;
  draw(job);
  if (!api.hasEnded(job.state)) {
    job = await api.follow(id, drawHead);
    draw(job);
  }
}

function draw(job) {
  forgive();
  drawHead(job);
  find("#again").href = `/review/new?from=${id}`;
  find("#share").onclick = () => navigator.clipboard.writeText(location.href).then(() => (find("#share").textContent = "Link copied"), report);
  show(find("#run"));
  const sections = find("#sections");
  sections.replaceChildren();
  if (job.error) sections.append(card("Why it failed", { wide: true }, h("p", {}, job.error.detail), h("p", { class: "hint" }, words(job.error.code))));
  if (job.warnings?.length) sections.append(card("Warnings", {}, job.warnings.map((warning) => h("p", { class: "note" }, warning))));
  if (job.result?.grasps.length) {
    sections.append(
      card("Grasps", { wide: true }, grasps(job)),
      verified,
      h("div", { class: "stacked" }, card("Quality over the search", {}, quality), card("Planning time", {}, times(job.result))),
      card("The chosen grasp", {}, details),
      card("How the starts ended", { wide: true }, reasons(job)),
    );
    select(job, addressed(job) ?? standard(job));
  } else if (job.result?.summary.started) {
    sections.append(card("How the starts ended", { wide: true }, reasons(job)));
  }
  const scene = job.result && job.request.scene;
  if (scene) sections.append(card("Scene", {}, world(job.result)));
  sections.append(card("Downloads", { wide: !scene }, downloads), requestCard(job));
  if (!job.result?.grasps.length) offer(job, null);
}

// The grasp that the page's address names.
function addressed(job) {
  const rank = new URLSearchParams(location.search).get("grasp");
  return job.result.grasps.find((grasp) => String(grasp.rank) === rank);
}

// The one that stands for the run: the first that held, else the first.
const standard = (job) => job.result.grasps.find((grasp) => grasp.verification?.passed) ?? job.result.grasps[0];

function drawHead(job) {
  document.title = `${job.object_name} · Fingersplit`;
  find("h1").textContent = job.object_name;
  const [kind, label] = standing(job);
  const badge = find("#run .badge");
  badge.className = `badge ${kind}`;
  badge.textContent = label;
  find(".lead").textContent = job.result?.summary.message ?? job.error?.detail ?? lasting(job);
  const { result } = job;
  show(find(".tiles"), Boolean(result) || !api.hasEnded(job.state));
  const tried = result?.grasps.filter((grasp) => grasp.verification).length;
  const tiles = [
    ...metrics.filter((metric) => metric.in_tables).map((metric) => [heading(metric), h("span", {}, number(result?.grasps[0]?.metrics[metric.name]))]),
    ["Feasible starts", result ? h("span", {}, result.summary.feasible, h("small", {}, ` of ${result.summary.started}`)) : "–"],
    ["Held in simulation", tried ? h("span", {}, job.verified, h("small", {}, ` of ${tried} tried`)) : h("small", {}, job.verification === "pending" ? "pending" : "–")],
    ["Planning", duration(result?.timings_ms.total)],
    ["Total time", duration(took(job))],
    ["Hand", h("span", {}, job.hand)],
  ];
  find(".tiles").replaceChildren(...tiles.map(([name, value]) => h("div", { class: "card tile" }, h("dt", {}, name), h("dd", {}, value))));
}

function lasting(job) {
  const [word, time] = api.hasEnded(job.state) ? ["at", job.finished_at] : ["since", job.started_at ?? job.created_at];
  return `${sentence(job.state)} ${word} ${exact(time ?? job.created_at)}.`;
}

// The other metrics stand beside the chosen grasp.
const tabled = () => metrics.filter((metric) => metric.in_tables || metric.name === "quality");

function grasps(job) {
  const numeric = new Set(["P(hold)", ...tabled().map(heading), "Pad angle, rad", "CPO / PPO"]);
  const heads = ["Rank", "Feasible", "Verified", ...numeric, "Ended"];
  const rows = job.result.grasps.map((grasp) => {
    const choose = (event) => {
      select(job, grasp);
      if (event.detail) event.currentTarget.querySelector("button").focus();
    };
    const { iterations } = grasp;
    const tilt = Math.max(...grasp.contacts.map((contact) => contact.pad_angle));
    return h(
      "tr",
      { "data-rank": grasp.rank, "aria-selected": "false", on: { click: choose } },
      h("td", {}, h("button", { type: "button", "aria-pressed": "false", "aria-label": `Show grasp ${grasp.rank}` }, String(grasp.rank))),
      h("td", {}, h("span", { class: `badge ${grasp.feasible ? "good" : "warn"}` }, grasp.feasible ? "yes" : "no")),
      h("td", {}, verdict(grasp)),
      h("td", { class: "number" }, number(grasp.p_hold?.value, 2)),
      ...tabled().map(({ name }) => h("td", { class: "number" }, number(grasp.metrics[name]))),
      h("td", { class: "number" }, tilt.toFixed(2)),
      h("td", { class: "number" }, `${iterations.cpo} / ${iterations.ppo}`),
      h("td", {}, words(grasp.termination)),
    );
  });
  const table = h(
    "table",
    { class: "grasps" },
    h("caption", { class: "visually-hidden" }, "Grasps"),
    h("thead", {}, h("tr", {}, heads.map((head) => h("th", { scope: "col", class: numeric.has(head) ? "number" : null }, head)))),
    h("tbody", {}, rows),
  );
  return h(
    "div",
    {},
    h("p", { class: "hint" }, "Ranked, best first: by the probability of holding, P(hold), where it was estimated. Choose one to see its search, contacts and forces."),
    h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Table of grasps" }, table),
  );
}

async function select(job, grasp) {
  for (const row of document.querySelectorAll(".grasps tbody tr")) {
    const chosen = row.dataset.rank === String(grasp.rank);
    row.setAttribute("aria-selected", chosen);
    row.querySelector("button").setAttribute("aria-pressed", chosen);
  }
  details.replaceChildren(...graspDetails(job, grasp));
  show(verified, Boolean(grasp.verification));
  if (grasp.verification) verified.querySelector(".body").replaceChildren(...verificationReport(job, grasp));
  const address = new URL(location.href);
  address.searchParams.set("grasp", grasp.rank);
  history.replaceState(null, "", address);
  offer(job, grasp);
  invite(job, grasp.rank);
  show(find("#view"));
  viewGrasp(find("#view"), job, grasp.rank, grasp === standard(job) ? api.links.thumbnail(id) : null);
  try {
    const curve = await api.curve(id, grasp.rank);
    quality.replaceChildren(qualityChart([{ name: `Grasp ${grasp.rank}`, ...curve }], "Quality over the search"));
  } catch (error) {
    quality.replaceChildren(h("p", { class: "hint" }, error.message));
  }
}

function graspDetails(job, grasp) {
  const vector = (values, digits) => values.map((value) => fixed(value, digits)).join(", ");
  const millimetres = (values) => vector(values.map((value) => 1000 * value), 1);
  const parts = [
    h("p", {}, grasp.reason),
    h("p", {}, h("strong", {}, sentence(grasp.termination)), `. ${grasp.advice}`),
    grasp.violations.length ? h("ul", { class: "violations" }, grasp.violations.map((violation) => h("li", {}, violation))) : null,
    facts([
      ["Palm position, mm", millimetres(grasp.palm.position)],
      ["Palm orientation, wxyz", vector(grasp.palm.wxyz, 4)],
      ...metrics.map((metric) => [heading(metric), number(grasp.metrics[metric.name], 4)]),
      ["Q at the start", number(grasp.initial.quality, 4)],
      ...noise(job.result, grasp),
      ...ways(grasp),
    ]),
    more("Joints", table(["Joint", "rad", "deg"], Object.entries(grasp.joints).map(([name, angle]) => [name, fixed(angle, 4), fixed((angle * 180) / Math.PI, 1)]))),
    more(
      "Contacts",
      table(
        ["Finger", "Position, mm", "Gap, mm", "Pad angle, rad", "Force, N", "Surface"].slice(0, grasp.contacts.some((contact) => contact.assumed) ? 6 : 5),
        grasp.contacts.map((contact) => [
          ...[contact.finger, millimetres(contact.position), fixed(1000 * contact.residual, 3), contact.pad_angle.toFixed(3), contact.force ? number(Math.hypot(...contact.force)) : "–"],
          ...(grasp.contacts.some((one) => one.assumed) ? [contact.assumed ? "assumed" : "seen"] : []),
        ]),
      ),
    ),
  ];
  return parts.filter(Boolean);
}

const more = (title, ...body) => h("details", {}, h("summary", {}, title), body);

function table(heads, rows) {
  return h(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": heads[0] },
    h("table", {}, h("thead", {}, h("tr", {}, heads.map((head) => h("th", { scope: "col" }, head)))), h("tbody", {}, rows.map((row) => h("tr", {}, row.map((cell) => h("td", {}, cell)))))),
  );
}

function bars(entries, text) {
  const largest = Math.max(...entries.map(([, value]) => value), 1e-9);
  return h("div", { class: "bars" }, entries.map(([name, value]) => h("div", { class: "bar" }, h("span", {}, sentence(name)), h("meter", { min: 0, max: largest, value, "aria-label": sentence(name) }), h("output", {}, text(value)))));
}

function reasons(job) {
  const { result } = job;
  const place = h("div", { class: "view inner" });
  const look = h("button", { type: "button", on: { click: () => viewStarts(place, job) } }, "See each start on the object");
  place.append(look);
  const entries = Object.entries(result.summary.terminations).sort((a, b) => b[1] - a[1]);
  return h("div", {}, h("p", { class: "hint" }, `${result.summary.started} starts were run.`), bars(entries, String), place);
}

function times(result) {
  const { total, ...stages } = result.timings_ms;
  return bars(Object.entries(stages), duration);
}

function offer(job, grasp) {
  const link = (label, href, name) => h("li", {}, h("a", { class: "button quiet", href, download: name || true }, label));
  const files = [link("Result, JSON", api.links.result(id), `${job.object_name}.json`)];
  if (grasp) {
    const name = `${job.object_name}-grasp-${grasp.rank}`;
    files.push(
      link(`Recording of grasp ${grasp.rank}, rrd`, api.links.recording(id, grasp.rank), `${name}.rrd`),
      link("Picture, PNG", api.links.picture(id, grasp.rank), `${name}.png`),
      link("Moving picture, WebP", api.links.animation(id, grasp.rank), `${name}.webp`),
    );
  }
  if (job.result?.summary.feasible) {
    files.push(...formats.filter((format) => format.writes).map(({ name, title }) => link(title, api.links.exported(id, name), "")));
  }
  downloads.replaceChildren(...files);
}

find("#delete").addEventListener("click", async () => {
  if (!confirm("Delete this run with its pictures and recordings?")) return;
  try {
    await api.deleteJob(id);
    location.assign("/review");
  } catch (error) {
    report(error);
  }
});

load().catch((error) => absent(error, "run"));
