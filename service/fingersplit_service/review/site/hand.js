// One hand: looked at, moved by its drivers, checked, corrected, tried.

import * as api from "./api.js";
import { card, find, forgive, h, report, show } from "./dom.js";
import { sentence } from "./format.js";
import { viewHand } from "./handview.js";

const name = location.pathname.split("/").at(-1);
const millimetres = (metres) => `${(1000 * metres).toFixed(1)} mm`;

function draw(hand) {
  document.title = `${hand.title} · Fingersplit`;
  const own = hand.origin === "uploaded";
  find("h1").textContent = hand.title;
  const badge = find("#hand .badge");
  badge.className = hand.drafted ? "badge warn" : "badge good";
  badge.textContent = hand.drafted ? "Draft" : "Yours";
  show(badge, own);
  show(find("#delete"), own);
  find(".lead").textContent = `${hand.fingers.length} fingers, ${hand.joints.length} joints, ${hand.report.drivers?.length ?? 0} drivers. In a job: "hand": "${hand.name}"`;
  find("#plan").href = `/review/new?hand=${encodeURIComponent(hand.name)}`;
  find("#sections").replaceChildren(
    card("What to change", {}, advice(hand.report)),
    card("Trial", {}, trial(hand)),
    card("Joints and drivers", {}, drivers(hand.report)),
    ...(hand.report.grips ?? []).map((grip, index) => card(`Grip ${index + 1}`, {}, gripFacts(grip))),
    card("Description", { wide: true }, correction(hand, own)),
  );
  show(find("#hand"));
}

function advice({ advice: found = [], notes = [] }) {
  return h(
    "div",
    {},
    found.length ? h("ul", { class: "violations" }, found.map((text) => h("li", {}, withCode(text)))) : h("p", {}, "Nothing to change."),
    notes.length ? h("details", {}, h("summary", {}, "Notes on the model"), h("ul", {}, notes.map((text) => h("li", {}, withCode(text))))) : null,
  );
}

// What stands between backticks is to be typed.
function withCode(text) {
  return text.split("`").map((part, index) => (index % 2 ? h("code", {}, part) : part));
}

function table(heads, rows, label) {
  return h(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": label },
    h("table", {}, h("thead", {}, h("tr", {}, heads.map((head) => h("th", { scope: "col" }, head)))), h("tbody", {}, rows.map((row) => h("tr", {}, row.map((cell) => h("td", {}, cell)))))),
  );
}

function drivers({ drivers: all = [], couplings = [] }) {
  const rows = all.map(({ name: driver, lower, upper, torque, torque_backwards: back }) => [
    driver,
    `${lower.toFixed(2)} to ${upper.toFixed(2)}`,
    torque === back ? torque.toPrecision(3) : `${(-back).toPrecision(3)} to ${torque.toPrecision(3)}`,
  ]);
  const terms = ({ ratios, offset }) => `${Object.entries(ratios).map(([driver, ratio]) => `${ratio.toPrecision(3)} ${driver}`).join(" + ")} ${offset < 0 ? "−" : "+"} ${Math.abs(offset).toPrecision(3)}`;
  return h(
    "div",
    {},
    table(["Driver", "Range, rad", "Torque, N m"], rows, "Drivers"),
    couplings.length ? table(["Driven joint", "Angle, rad"], couplings.map((one) => [one.joint, terms(one)]), "Couplings") : null,
  );
}

function gripFacts(grip) {
  const openings = grip.opposition.openings;
  const closest = [...grip.self_collision].sort((a, b) => a.distance - b.distance)[0];
  const pairs = [
    ["Jaws", grip.jaws.map((jaw) => jaw.join(", ")).join(" | ")],
    ["Jaws can face each other", `in ${(1e6 * grip.opposition.volume).toFixed(0)} cm³${openings ? `, ${(1000 * openings[0]).toFixed(0)} to ${(1000 * openings[1]).toFixed(0)} mm apart` : ""}`],
    ...grip.reach.map((reach) => [`Reach of ${reach.finger}`, `${millimetres(reach.nearest)} to ${millimetres(reach.farthest)} from the palm`]),
    ["Nearest links at the preshapes", closest ? `${closest.shapes.join(" and ")}: ${millimetres(closest.distance)}` : "none that may meet"],
    ["Kinematics against MuJoCo", `${grip.kinematics_error.toExponential(1)} m`],
  ];
  return h("dl", { class: "facts" }, pairs.flatMap(([label, value]) => [h("dt", {}, label), h("dd", {}, value)]));
}

function trial(hand) {
  const run = h("button", { type: "button", on: { click: () => tryOut(run) } }, hand.trial ? "Tried" : "Try it on simple objects");
  run.disabled = Boolean(hand.trial);
  const rows = (hand.trial ?? []).map((one) => [
    one.object,
    one.jaws.map((jaw) => jaw.join(", ")).join(" | "),
    h("span", { class: `badge ${one.feasible ? "good" : "bad"}` }, `${one.feasible} of ${one.starts}`),
    [Object.entries(one.terminations).map(([end, count]) => `${sentence(end)} ${count}`).join(", "), ...one.advice].join(". "),
  ]);
  return h(
    "div",
    {},
    h("p", { class: "hint" }, "A sphere, a box and a cylinder in three sizes: how many starts end in a feasible grasp, and how the others end."),
    rows.length ? table(["Object", "Jaws", "Feasible", "Ends"], rows, "Trial") : run,
  );
}

async function tryOut(button) {
  button.disabled = true;
  button.textContent = "Planning …";
  try {
    draw(await api.tryHand(name));
  } catch (error) {
    report(error);
    button.disabled = false;
    button.textContent = "Try it again";
  }
}

function correction(hand, own) {
  if (!own) return h("pre", { tabindex: "0", "aria-label": "Description, TOML" }, hand.description);
  const text = h("textarea", { id: "description", rows: 22, spellcheck: "false", value: hand.description });
  const keep = h("button", { class: "primary", type: "button", on: { click: () => correct(text, keep) } }, "Keep the correction");
  return h(
    "div",
    { class: "stack" },
    h("label", { for: "description", class: "hint" }, "hand.toml. A corrected description makes another hand; results of this one stay what they are."),
    text,
    h("div", {}, keep),
  );
}

async function correct(text, button) {
  forgive();
  button.disabled = true;
  try {
    const corrected = await api.correctHand(name, text.value);
    location.assign(api.links.hand(corrected.name));
  } catch (error) {
    report(error);
    find("#problem").scrollIntoView({ block: "center" });
  }
  button.disabled = false;
}

find("#delete").addEventListener("click", async () => {
  if (!confirm("Delete this hand? Results that were planned with it stay.")) return;
  try {
    await api.deleteHand(name);
    location.assign("/review/hands");
  } catch (error) {
    report(error);
  }
});

viewHand(find("#view"), name);
api.hand(name).then(draw, report);
