// The report of a verification: verdict, phases as a table, forces and slip over time, and the numbers it was run with.

import * as api from "./api.js";
import { h, svg } from "./dom.js";
import { fixed, number, sentence, words } from "./format.js";

const SIZE = { width: 560, height: 170, left: 46, right: 10, top: 10, bottom: 30 };
const DEGREES = 180 / Math.PI;

// Of a grasp that breaks a constraint the simulation says nothing more than that the object stayed in the hand.
export function verdict(grasp) {
  const { verification } = grasp;
  if (!verification) return "–";
  const held = verification.held_firmly === false ? "held, not firmly" : "held";
  const [kind, text] = verification.passed ? (grasp.feasible ? ["good", held] : ["warn", `${held}, but infeasible`]) : ["bad", "not held"];
  return h("span", { class: `badge ${kind}`, title: grasp.feasible ? null : grasp.violations.join(" ") }, text);
}

export function verificationReport(job, grasp) {
  const { verification } = grasp;
  const plots = h("div", { class: "plots" });
  api.motion(job.id, grasp.rank).then(
    (motion) => motion.times.length && plots.replaceChildren(...draw(motion, grasp)),
    (error) => plots.replaceChildren(h("p", { class: "hint" }, error.message)),
  );
  return [
    h("p", {}, verdict(grasp), ` ${sentence(verification.protocol)}. ${verification.explanation ?? words(verification.reason ?? "")}`),
    verification.passed && !grasp.feasible ? h("p", { class: "note" }, "The grasp held, but it is infeasible: ", grasp.violations.join(" "), " Do not execute it.") : null,
    phases(verification),
    plots,
    numbers(verification),
  ].filter(Boolean);
}

function phases(verification) {
  const rows = [
    ...(verification.squeeze ? [["squeeze", verification.squeeze]] : []),
    ...verification.trials.flatMap((trial) => trial.phases.map((phase) => [verification.trials.length > 1 ? `${trial.name}: ${phase.name}` : phase.name, phase])),
  ].map(([name, phase]) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, sentence(name)),
      ...[phase.duration.toFixed(2), (1000 * phase.displacement).toFixed(1), (DEGREES * phase.rotation).toFixed(1), number(phase.largest_force), (1000 * phase.largest_penetration).toFixed(2)].map((text) => h("td", { class: "number" }, text)),
      h("td", {}, phase.lost_contacts.length ? phase.lost_contacts.join(", ") : "none"),
      h("td", {}, phase.saturated_joints.length ? phase.saturated_joints.join(", ") : "none"),
    ),
  );
  if (!rows.length) return whole(verification);
  const heads = ["Phase", "Time, s", "Slip, mm", "Turn, °", "Force, N", "Depth, mm", "Contacts lost", "Joints at their limit"];
  return h(
    "div",
    { class: "scroll", tabindex: "0", role: "region", "aria-label": "Phases of the verification" },
    h(
      "table",
      { class: "phases" },
      h("caption", { class: "visually-hidden" }, "Phases of the verification"),
      h("thead", {}, h("tr", {}, heads.map((head, index) => h("th", { scope: "col", class: index > 0 && index < 6 ? "number" : null }, head)))),
      h("tbody", {}, rows),
    ),
  );
}

// A protocol that is judged as a whole, such as a pick.
function whole({ slip, turn, trials }) {
  const failed = trials.filter((trial) => !trial.passed);
  const pairs = [
    ["Slip in the hand, mm", slip === null ? "–" : fixed(1000 * slip, 1)],
    ["Turn in the hand, °", turn === null ? "–" : fixed(DEGREES * turn, 1)],
    ...(trials.length > 1 ? [["Trials that held", `${trials.length - failed.length} of ${trials.length}`]] : []),
    ...failed.map((trial) => [sentence(trial.name), words(trial.reason)]),
  ];
  return h("dl", { class: "facts" }, pairs.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
}

function draw(motion, grasp) {
  const fingers = grasp.contacts.map((contact) => contact.finger);
  const forces = fingers.map((name, f) => ({ name, values: motion.forces.map((all) => Math.hypot(...all[f])) }));
  const slip = [{ name: "object in the hand", values: slips(motion) }];
  return [plot("Contact force, N", motion, forces), plot("Slip, mm", motion, slip)];
}

// How far the object's origin has moved in the palm's frame since the hand began to close [mm].
function slips({ palm, object, closing = 0 }) {
  const inPalm = palm.map((pose, t) => turnBack(pose.slice(3), object[t].slice(0, 3).map((value, axis) => value - pose[axis])));
  return inPalm.map((place, t) => (t < closing ? 0 : 1000 * Math.hypot(...place.map((value, axis) => value - inPalm[closing][axis]))));
}

// A vector turned by the inverse of a quaternion wxyz.
function turnBack([w, x, y, z], [a, b, c]) {
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const axis = [-x, -y, -z];
  const once = cross(axis, [a, b, c]).map((value) => 2 * value);
  const twice = cross(axis, once);
  return [a, b, c].map((value, i) => value + w * once[i] + twice[i]);
}

function plot(label, { times, phases: names }, lines) {
  const { width, height, left, right, top, bottom } = SIZE;
  const most = Math.max(...lines.flatMap((line) => line.values), 1e-9);
  // Trials begin again at the same time, so frames are drawn one after the other.
  const x = (t) => left + (t / Math.max(times.length - 1, 1)) * (width - left - right);
  const y = (value) => height - bottom - (value / most) * (height - top - bottom);
  const chart = svg("svg", { class: "chart", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${label} over the simulation; at most ${number(most)}` });
  let begun = 0;
  names.forEach((name, t) => {
    if (t < names.length - 1 && names[t + 1] === name) return;
    chart.append(svg("rect", { class: `span ${chart.childElementCount % 2 ? "odd" : "even"}`, x: x(begun), width: Math.max(x(t) - x(begun), 0.5), y: top, height: height - top - bottom }));
    begun = t;
  });
  for (const value of [0, most]) {
    chart.append(svg("text", { class: "tick", x: left - 6, y: y(value) + 4, "text-anchor": "end" }, number(value, 2)), svg("line", { class: "grid", x1: left, x2: width - right, y1: y(value), y2: y(value) }));
  }
  chart.append(svg("text", { class: "tick", x: left, y: height - 8 }, `${times[0].toFixed(2)} s`), svg("text", { class: "tick", x: width - right, y: height - 8, "text-anchor": "end" }, `${times.at(-1).toFixed(2)} s`));
  lines.forEach((line, index) => {
    const points = line.values.map((value, t) => `${x(t).toFixed(1)},${y(value).toFixed(1)}`).join(" ");
    chart.append(svg("polyline", { class: `line finger${index}`, points }));
  });
  const key = lines.length > 1 ? h("ul", { class: "legend" }, lines.map(({ name }, index) => h("li", {}, h("span", { class: `swatch finger${index}` }), name))) : null;
  return h("figure", {}, h("figcaption", {}, label), chart, key);
}

function numbers(verification) {
  const flat = (value, path) => (value !== null && typeof value === "object" && !Array.isArray(value) ? Object.entries(value).flatMap(([name, one]) => flat(one, path ? `${path}, ${words(name)}` : words(name))) : [[path, value]]);
  const { settings, simulator, initial_penetration: depth, grip, time_ms: time } = verification;
  const pairs = [["simulator", simulator], ["depth at the start, mm", (1000 * depth).toFixed(2)], ["planned grip, N", grip.forces.map((force) => number(Math.hypot(...force))).join(", ")], ["simulated in, ms", time.toFixed(0)], ...flat(settings, "")];
  const shown = (value) => (typeof value === "number" ? number(value, 4) : Array.isArray(value) ? value.join(", ") : value === null ? "–" : String(value));
  return h("details", {}, h("summary", {}, "Numbers of the simulation"), h("dl", { class: "facts" }, pairs.flatMap(([name, value]) => [h("dt", {}, sentence(name)), h("dd", {}, shown(value))])));
}
