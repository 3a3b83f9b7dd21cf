// Quality over the accepted iterations as SVG: phases shaded as in the paper, one line a run, values under the cursor.

import { h, svg } from "./dom.js";
import { brief, number } from "./format.js";

const NARROW = { width: 560, height: 250, left: 62, right: 12, top: 12, bottom: 38 };
const SMALL = { ...NARROW, width: 340, height: 230, left: 52 };
const WIDE = { ...NARROW, width: 1180, height: 300 };
const KEYS = ["first", "second"];
const PHASES = [
  ["cpo", "CPO, contacts move"],
  ["ppo", "PPO, palm moves"],
  ["settle", "settling on the surface"],
];

// series: [{ name, quality, phases }], at most two; phases are shaded when there is one.
export function qualityChart(series, label, wide = false) {
  const size = innerWidth < NARROW.width ? SMALL : wide ? WIDE : NARROW;
  const steps = Math.max(...series.map((one) => one.quality.length - 1), 1);
  const values = series.flatMap((one) => one.quality);
  const ticks = niceTicks(Math.min(...values), Math.max(...values));
  const x = (step) => size.left + (step / steps) * (size.width - size.left - size.right);
  const span = ticks.at(-1) - ticks[0] || 1;
  const y = (value) => size.height - size.bottom - ((value - ticks[0]) / span) * (size.height - size.top - size.bottom);
  const plot = svg("svg", { class: "chart", viewBox: `0 0 ${size.width} ${size.height}`, role: "img", "aria-label": describe(series, label) });
  if (series.length === 1) plot.append(...phaseBands(series[0].phases, size, x));
  plot.append(...axes(ticks, steps, size, x, y));
  series.forEach((one, index) => {
    const points = one.quality.map((value, step) => `${x(step).toFixed(1)},${y(value).toFixed(1)}`).join(" ");
    plot.append(svg("polyline", { class: `line ${KEYS[index]}`, points }));
  });
  const readout = h("p", { class: "readout" });
  watch(plot, readout, series, size, steps, x);
  return h("div", {}, plot, legend(series), readout);
}

function describe(series, label) {
  const ends = series.map((one) => `${one.name} from ${number(one.quality[0])} to ${number(one.quality.at(-1))} in ${one.quality.length - 1} iterations`);
  return `${label}: ${ends.join("; ")}.`;
}

function phaseBands(phases, size, x) {
  const bands = [];
  phases.forEach((phase, step) => {
    if (step === 0) return;
    const last = bands.at(-1);
    if (last && last.phase === phase) last.end = step;
    else bands.push({ phase, start: step - 1, end: step });
  });
  return bands.map(({ phase, start, end }) =>
    svg("rect", { class: `phase ${phase}`, x: x(start), width: x(end) - x(start), y: size.top, height: size.height - size.top - size.bottom }),
  );
}

function axes(ticks, steps, size, x, y) {
  const parts = ticks.flatMap((tick) => [
    svg("line", { class: "grid", x1: size.left, x2: size.width - size.right, y1: y(tick), y2: y(tick) }),
    svg("text", { x: size.left - 8, y: y(tick) + 4, "text-anchor": "end" }, brief(tick)),
  ]);
  for (const step of niceTicks(0, steps).filter((one) => Number.isInteger(one) && one <= steps)) {
    parts.push(svg("text", { x: x(step), y: size.height - 14, "text-anchor": "middle" }, String(step)));
  }
  parts.push(svg("text", { x: size.width - size.right, y: size.height - 1, "text-anchor": "end" }, "accepted iteration"));
  return parts;
}

function niceTicks(low, high) {
  const room = high - low || Math.abs(high) || 1;
  const rough = room / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].find((one) => one * power >= rough) * power;
  const ticks = [];
  for (let i = Math.floor(low / step + 1e-9); i <= Math.ceil(high / step - 1e-9); i += 1) ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

function legend(series) {
  const phases = series.length === 1 ? PHASES.filter(([phase]) => series[0].phases.includes(phase)) : [];
  const keys = [...series.map((one, index) => [KEYS[index], one.name]), ...phases];
  return h("ul", { class: "legend" }, keys.map(([key, name]) => h("li", {}, h("span", { class: `swatch ${key}` }), name)));
}

function watch(plot, readout, series, size, steps, x) {
  const cursor = svg("line", { class: "cursor", y1: size.top, y2: size.height - size.bottom, visibility: "hidden" });
  plot.append(cursor);
  plot.addEventListener("pointermove", (event) => {
    const box = plot.getBoundingClientRect();
    const place = ((event.clientX - box.left) / box.width) * size.width;
    const share = (place - size.left) / (size.width - size.left - size.right);
    const step = Math.min(steps, Math.max(0, Math.round(share * steps)));
    cursor.setAttribute("visibility", "visible");
    cursor.setAttribute("x1", x(step));
    cursor.setAttribute("x2", x(step));
    const here = series.filter((one) => step < one.quality.length).map((one) => `${one.name} ${number(one.quality[step], 4)} (${one.phases[step].toUpperCase()})`);
    readout.textContent = `Iteration ${step}: ${here.join(", ")}`;
  });
  plot.addEventListener("pointerleave", () => {
    cursor.setAttribute("visibility", "hidden");
    readout.textContent = "";
  });
}
