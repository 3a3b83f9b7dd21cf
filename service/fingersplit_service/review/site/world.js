// What a run says of the world around the object, and of the noise that its grasps were judged under.

import { facts, h } from "./dom.js";
import { brief, fixed, number, words } from "./format.js";

const DEGREES = 180 / Math.PI;
const vector = (values, digits = 2) => values.map((value) => fixed(value, digits)).join(", ");

// The scene of a result: what rejected how many grasps, and what would have to give.
export function world({ scene }) {
  const rejected = Object.entries(scene.rejected_by);
  const most = Math.max(...rejected.map(([, count]) => count), 1);
  return h(
    "div",
    {},
    scene.warnings.map((warning) => h("p", { class: "note" }, warning)),
    h("h3", {}, "What rejected grasps"),
    rejected.length
      ? h("div", { class: "bars" }, rejected.map(([name, count]) => h("div", { class: "bar" }, h("span", {}, name), h("meter", { min: 0, max: most, value: count, "aria-label": `Grasps that ${name} rejected` }), h("output", {}, String(count)))))
      : h("p", { class: "hint" }, "No support surface or obstacle rejected a grasp."),
    scene.relaxations.length ? [h("h3", {}, "What would allow grasps"), h("ul", { class: "relaxations" }, scene.relaxations.map((one) => h("li", {}, one.message)))] : null,
    facts([
      ["Frame of the scene", scene.frame],
      ["Tool frame", scene.tool_frame],
      ["Object position, m", vector(scene.object_pose.position, 3)],
      ["Object orientation, wxyz", vector(scene.object_pose.wxyz, 4)],
      ...(scene.stable_pose_share === null ? [] : [["Comes to rest in this pose", `${Math.round(100 * scene.stable_pose_share)} % of drops`]]),
    ]),
  );
}

// How probably a grasp holds, and the noise that was reckoned with.
export function noise({ provenance }, { p_hold: hold }) {
  if (!hold) return [];
  const { friction_factors: friction, mass_factors: mass } = provenance.ranking?.noise ?? {};
  const times = (name, factors) => (factors ? [[`${name} factor`, factors.map((factor) => brief(factor, 2)).join(" to ")]] : []);
  return [
    ["Probability of holding", `${number(hold.value)}, ${hold.tier}: ${hold.robustness}`],
    ["Object pose error, RMS", `${(1000 * hold.position_noise).toFixed(1)} mm and ${(DEGREES * hold.rotation_noise).toFixed(1)}°`],
    ...times("Friction", friction),
    ...times("Mass", mass),
  ];
}

// The ways in and out, and where the hand comes nearest to something else.
export function ways({ approach_path: into, retreat_path: out, clearance, self_clearance: own }) {
  const way = (one) => `${(1000 * one.distance).toFixed(0)} mm along ${vector(one.direction_in_world)}${one.blocked_by ? `, blocked by ${one.blocked_by}` : ""}`;
  return [
    ...(into ? [["Approach", way(into)]] : []),
    ...(out ? [["Retreat", way(out)]] : []),
    ...(clearance ? [["Nearest obstacle", `${fixed(1000 * clearance.distance, 1)} mm, ${words(clearance.link)} to ${clearance.obstacle}`]] : []),
    ...(own === null || own === undefined ? [] : [["Nearest links of the hand, mm", (1000 * own).toFixed(1)]]),
  ];
}
