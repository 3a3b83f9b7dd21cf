// Numbers, times and names as people read them.

export const words = (name) => String(name).replace(/_s$/, ", s").replaceAll("_", " ");

export const sentence = (name) => words(name).replace(/^./, (first) => first.toUpperCase());

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const signed = (text) => text.replace("-", "−");

// So many significant digits, the trailing zeros too: numbers of a column end alike.
export function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  if (size < 1e-12) return "0"; // what rounding leaves of nothing
  if (size >= 1e-4 && size < 1e6) return signed(size < 10 ** digits - 0.5 ? value.toPrecision(digits) : value.toFixed(0));
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  return `${signed(mantissa)}·10${[...power.replace("+", "")].map((sign) => RAISED[sign]).join("")}`;
}

// A value where nothing has to line up with it: a tick of an axis, a share.
export const brief = (value, digits = 3) => {
  const text = number(value, digits);
  return text.includes(".") && !text.includes("·") ? text.replace(/\.?0+$/, "") : text;
};

export function duration(milliseconds) {
  if (milliseconds === null || milliseconds === undefined) return "–";
  if (milliseconds < 10) return `${milliseconds.toFixed(1)} ms`;
  if (milliseconds < 1000) return `${Math.round(milliseconds)} ms`;
  if (milliseconds < 60_000) return `${(milliseconds / 1000).toFixed(1)} s`;
  return `${Math.floor(milliseconds / 60_000)} min ${Math.round((milliseconds % 60_000) / 1000)} s`;
}

export function took(job) {
  return job.finished_at && job.started_at ? new Date(job.finished_at) - new Date(job.started_at) : null;
}

const relative = new Intl.RelativeTimeFormat("en", { numeric: "auto" });
const STEPS = [
  [60, "second"],
  [60, "minute"],
  [24, "hour"],
  [7, "day"],
];

export function ago(time) {
  let span = (new Date(time) - Date.now()) / 1000;
  for (const [length, unit] of STEPS) {
    if (Math.abs(span) < length) return relative.format(Math.round(span), unit);
    span /= length;
  }
  return new Date(time).toLocaleDateString("en", { day: "numeric", month: "short", year: "numeric" });
}

// A component of a vector or a table, with so many decimals.
export const fixed = (value, digits) => signed(value.toFixed(digits));

export const exact = (time) => new Date(time).toLocaleString("en");

// What a state looks like: succeeded without a feasible grasp is an answer, but not what was hoped for.
export function standing(job) {
  if (job.state === "succeeded") {
    return job.feasible === 0 ? ["warn", "No feasible grasp"] : ["good", "Succeeded"];
  }
  if (job.state === "failed") return ["bad", "Failed"];
  if (job.state === "running") return ["busy", job.stage ? sentence(job.stage) : "Running"];
  return ["", sentence(job.state)];
}

// A metric of `GET /v1/metrics` as a heading.
export const heading = (metric) => `${metric.title[0].toUpperCase()}${metric.title.slice(1)}${metric.unit ? `, ${metric.unit.replace("^2", "²").replace("^6", "⁶")}` : ""}`;
