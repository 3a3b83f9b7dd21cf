// Upload a mesh, plan, and watch: the form, its checks, and the live progress.

import * as api from "./api.js";
import { find, forgive, h, report, show } from "./dom.js";
import { watchDrop } from "./drop.js";
import { sentence } from "./format.js";
import { SAMPLES, sampleFile } from "./samples.js";

const USUAL_HAND = "barrett"; // of a job that names none
const form = find("form");
const earlier = new URLSearchParams(location.search).get("from");
const STAGES = [
  ["upload", "Upload and check the mesh"],
  ["queued", "Wait for a worker"],
  ["preparing", "Prepare the object"],
  ["parallel_grasps", "Find parallel grasps"],
  ["mapping", "Map them to the hand"],
  ["splitting", "Split the fingers"],
  ["ranking", "Rank the grasps"],
  ["verifying", "Verify in simulation"],
];
let object = null;
let current = null;
let before = {}; // of the run that is planned again, also what the form has no field for

function stages() {
  return STAGES.filter(([name]) => (name !== "verifying" || Number(form.elements.verified.value) > 0) && (name !== "upload" || !earlier));
}

function drawStages(now) {
  const names = stages().map(([name]) => name);
  const place = names.indexOf(now);
  if (place < 0 && now !== "done") return;
  find(".steps").replaceChildren(
    ...stages().map(([name, label], index) => {
      const past = now === "done" || index < place;
      return h("li", { class: past ? "done" : index === place ? "now" : null, "aria-current": index === place ? "step" : null }, label);
    }),
  );
  const label = stages()[place]?.[1] ?? "Done";
  if (find("[role=status]").textContent !== label) find("[role=status]").textContent = label;
}

function check() {
  const sample = form.elements.sample.value;
  const file = sample ? sampleFile(sample) : form.elements.file.files[0];
  if (!object && !file) throw new Error("Choose a mesh file first.");
  if (!object && !sample && !form.elements.unit.value) throw new Error("Say the unit of the file; it is never guessed.");
  for (const field of form.querySelectorAll("input[type=number]")) {
    if (!field.checkValidity()) {
      field.focus();
      throw new Error(`${form.querySelector(`label[for=${field.id}]`).textContent}: ${field.validationMessage}`);
    }
  }
  scene();
  json("planner");
  return file;
}

// A field that holds a JSON object, or nothing.
function json(name) {
  const field = form.elements[name];
  if (!field.value.trim()) return {};
  try {
    const value = JSON.parse(field.value);
    if (value && typeof value === "object" && !Array.isArray(value)) return value;
  } catch {
    // said below
  }
  field.closest("details").open = true;
  field.focus();
  throw new Error(`${form.querySelector(`label[for=${field.id}]`).textContent}: this is not a JSON object.`);
}

function scene() {
  const asked = json("scene");
  if (form.elements.table.checked && !asked.support_surfaces) asked.support_surfaces = [{ id: "table" }];
  return Object.keys(asked).length ? asked : null;
}

// What is said of the object beside its file.
function said() {
  const { mass, density, fairing, viewpoint } = form.elements;
  const fields = { mass: mass.value, density: density.value, viewpoint: viewpoint.value.replaceAll(" ", "") };
  if (fairing.value) fields.fairing = String(Number(fairing.value) / 1000);
  return Object.fromEntries(Object.entries(fields).filter(([, value]) => value));
}

function order(objectId) {
  const { hand, starts, seed, verified, protocol, friction, verify_initial: initial } = form.elements;
  return {
    ...before,
    object_id: objectId,
    hand: hand.value,
    starts: Number(starts.value),
    seed: Number(seed.value),
    verified: Number(verified.value),
    protocol: protocol.value,
    verify_initial: initial.checked && Number(verified.value) > 0,
    planner: { ...before.planner, ...json("planner"), friction: Number(friction.value) },
    scene: scene(),
  };
}

async function submit(event) {
  event.preventDefault();
  forgive();
  try {
    const file = check();
    show(form, false);
    show(find("#progress"));
    find("#progress h2").focus();
    drawStages("upload");
    const objectId = object ?? (await api.upload(file, form.elements.sample.value ? "m" : form.elements.unit.value, said())).id;
    drawStages("queued");
    current = await api.createJob(order(objectId));
    const ended = await api.follow(current.id, change);
    finish(ended);
  } catch (error) {
    current = null;
    show(form);
    show(find("#progress"), false);
    report(error);
    find("#problem").scrollIntoView({ block: "center" });
  }
}

function change(job) {
  if (job.state === "queued") drawStages("queued");
  if (job.state === "running" && job.stage) drawStages(job.stage);
  find("#progress progress").value = job.progress;
}

function finish(job) {
  drawStages("done");
  show(find("#cancel"), false);
  find("#progress progress").value = 1;
  const result = job.result;
  const best = result?.grasps[0];
  const outcome = find(".outcome");
  find("#verdict").append(verdict(job));
  find("#message").textContent = result?.summary.message ?? job.error?.detail ?? "";
  find("#open").href = api.links.run(job.id);
  const picture = outcome.querySelector("img");
  show(picture, Boolean(best));
  if (best) {
    picture.alt = `The best grasp of ${job.object_name}`;
    picture.src = api.links.thumbnail(job.id);
  }
  show(find("#compare"), Boolean(earlier));
  find("#compare").href = `/review/compare?a=${earlier}&b=${job.id}`;
  find("#progress h2").textContent = job.state === "succeeded" ? "Done" : sentence(job.state);
  find("[role=status]").textContent = find("#verdict").textContent;
  show(outcome);
  find("#open").focus();
}

function verdict(job) {
  if (job.state === "failed") return h("span", { class: "badge bad" }, "Failed");
  if (job.state === "cancelled") return h("span", { class: "badge" }, "Cancelled");
  if (job.verified > 0) return h("span", { class: "badge good" }, job.verified === 1 ? "One grasp held in simulation" : `${job.verified} grasps held in simulation`);
  if (job.request.verified > 0) return h("span", { class: "badge warn" }, "No grasp held in simulation");
  return job.feasible > 0 ? h("span", { class: "badge good" }, "Grasp found") : h("span", { class: "badge warn" }, "No feasible grasp");
}

// Those that the form does not name, such as a pick from the table.
function offerProtocols(protocols) {
  const select = form.elements.protocol;
  const known = new Set([...select.options].map((option) => option.value));
  select.append(...protocols.filter(({ name }) => !known.has(name)).map(({ name }) => h("option", { value: name }, sentence(name))));
  const about = () => (find("#about-protocol").textContent = protocols.find(({ name }) => name === select.value)?.meaning ?? "");
  select.addEventListener("change", about);
  if (before.protocol) select.value = before.protocol;
  about();
}

async function startAgain() {
  const job = await api.job(earlier);
  object = job.object_id;
  before = job.request;
  show(find("#upload"), false);
  for (const id of ["#units", "#samples", "#about-object"]) show(find(id), false);
  find("#again").textContent = `Plans ${job.object_name} again. Change what you like, then compare the two runs.`;
  show(find("#again"));
  for (const name of ["hand", "starts", "seed", "verified", "protocol"]) form.elements[name].value = job.request[name];
  form.elements.protocol.dispatchEvent(new Event("change"));
  form.elements.verify_initial.checked = job.request.verify_initial;
  form.elements.friction.value = job.request.planner.friction ?? 0.6;
  if (job.request.scene) form.elements.scene.value = JSON.stringify(job.request.scene, null, 2);
}

async function start() {
  watchDrop(find("#drop"), form.elements.file, "Choose a mesh file, or drop it here", "STL, OBJ, PLY, OFF, GLB; point clouds as PLY, PCD, NPZ");
  api.protocols().then(offerProtocols);
  form.elements.sample.append(...Object.entries(SAMPLES).map(([name, [title]]) => h("option", { value: name }, title)));
  form.elements.sample.addEventListener("change", () => show(find("#units"), !form.elements.sample.value));
  form.addEventListener("submit", submit);
  find("#cancel").addEventListener("click", () => current && api.cancelJob(current.id).catch(report));
  try {
    const known = await api.hands();
    const titles = new Map(known.map((hand) => [hand.name, hand.title.split(/, (.*)/)])); // the maker's name, and more
    form.elements.hand.append(...[...titles].map(([name, [maker]]) => h("option", { value: name }, maker)));
    const describe = () => (find("#about-hand").textContent = sentence(titles.get(form.elements.hand.value)?.[1] ?? ""));
    form.elements.hand.addEventListener("change", describe);
    const wanted = new URLSearchParams(location.search).get("hand");
    form.elements.hand.value = titles.has(wanted) ? wanted : USUAL_HAND;
    if (earlier) await startAgain();
    describe();
  } catch (error) {
    report(error);
  }
}

start();
