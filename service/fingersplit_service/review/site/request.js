// What a run was asked for, as a table; what has parts of its own is folded away below it.

import { card, facts, h } from "./dom.js";
import { sentence } from "./format.js";

const isPlain = (value) => value === null || typeof value !== "object";

// Numbers and words as they are; null is what the service chooses by itself.
export const shown = (value) => (value === undefined || value === null ? "–" : value === true ? "yes" : value === false ? "no" : String(value));

// Members of members by their path, so that two requests can be laid side by side.
export function flat(value, path = "") {
  if (Array.isArray(value) && value.every(isPlain)) return [[path, value.join(", ") || null]];
  if (isPlain(value)) return [[path, value]];
  return Object.entries(value).flatMap(([name, one]) => flat(one, path ? `${path}: ${name}` : name));
}

export function requestCard(job) {
  const text = JSON.stringify(job.request, null, 2);
  const copy = h("button", { type: "button", class: "quiet", on: { click: () => navigator.clipboard.writeText(text).then(() => (copy.textContent = "Copied")) } }, "Copy as JSON");
  const parts = Object.entries(job.request).filter(([, value]) => value !== null && !(typeof value === "object" && !Object.keys(value).length));
  const plain = parts.filter(([name, value]) => isPlain(value) && name !== "object_id");
  const folded = parts.filter(([, value]) => !isPlain(value));
  return card(
    "Request",
    { actions: [copy], wide: true },
    facts([["Object", job.object_name], ["Object id", h("code", {}, job.object_id)], ...plain.map(([name, value]) => [sentence(name), shown(value)])], "facts spread"),
    folded.map(([name, value]) => h("details", {}, h("summary", {}, sentence(name)), facts(flat(value).map(([path, one]) => [sentence(path), shown(one)])))),
  );
}
