// The place of a grasp on a page: still picture, canvas, slider, toggles; what failed is said, with a way to try again.

import * as api from "./api.js";
import { h } from "./dom.js";
import { ASSUMED, Grasp3d } from "./grasp3d.js";
import { three } from "./three.js";

const FRAME = 90; // [ms] while it plays
const COLORS = { approach: "#8a4fc0", closing: "#c07fb0", simulation: "#1f9d57" };
const NAMES = { map: "Map", cpo: "CPO, contacts move", ppo: "PPO, palm moves", settle: "Settling", approach: "Approach", closing: "Closing", simulation: "Simulation" };
const TOGGLES = [
  ["forces", "Forces", true],
  ["cones", "Friction cones", true],
  ["pregrasp", "Approach", false],
  ["shapes", "Collision shapes", false],
];

const begun = new Map(); // scenes that were asked for before their place is there
let shown = null; // the view on this page
let asked = 0;

// Asks for what a view of a grasp needs, so that it is on its way while the rest of the page is made.
export function prepare(jobId, rank) {
  three().catch(() => {}); // told where it is drawn
  if (rank === null || begun.has(`${jobId} ${rank}`)) return;
  const scene = api.scene(jobId, rank);
  scene.catch(() => {});
  begun.set(`${jobId} ${rank}`, scene);
}

function sceneOf(jobId, rank) {
  const key = `${jobId} ${rank}`;
  const scene = begun.get(key) ?? api.scene(jobId, rank);
  begun.delete(key);
  return scene;
}

// Draws one grasp into a place; what was there before stops.
export async function viewGrasp(place, job, rank, still) {
  const turn = ++asked;
  close();
  place.dataset.state = "loading";
  const picture = h("img", { class: "still", src: still, alt: `Grasp ${rank} of ${job.object_name}` });
  picture.addEventListener("error", () => (picture.hidden = true));
  const canvas = h("canvas", { "aria-label": `Grasp ${rank} of ${job.object_name} in three dimensions. Arrow keys turn it, plus and minus zoom, Home resets.`, role: "application" });
  const said = h("p", { class: "status", role: "status" }, "Loading the 3-D view.");
  const scene = h("div", { class: "scene" }, picture, canvas, said);
  place.replaceChildren(scene);
  try {
    const [THREE, document] = await Promise.all([three(), sceneOf(job.id, rank)]);
    if (turn !== asked) return;
    const grasp = new Grasp3d(THREE, canvas, document);
    shown = { grasp, stop: () => {} };
    place.append(controls(grasp, document, job, rank));
    picture.remove();
    said.hidden = true;
    place.dataset.state = "drawn";
    grasp.stage.rotate();
  } catch (error) {
    if (turn !== asked) return;
    fail(place, scene, canvas, said, error, () => viewGrasp(place, job, rank, still), api.links.picture(job.id, rank));
  }
}

function fail(place, scene, canvas, said, error, again, picture) {
  place.dataset.state = "failed";
  close();
  canvas.remove();
  const still = scene.querySelector(".still");
  if (still) {
    still.hidden = false;
    still.src = picture;
  }
  said.replaceChildren(h("span", { role: "alert" }, error.message), " ", h("button", { type: "button", on: { click: again } }, "Try again"));
}

export function close() {
  shown?.stop();
  shown?.grasp.end();
  shown = null;
}

addEventListener("pagehide", close);

function controls(grasp, document, job, rank) {
  const play = h("button", { type: "button", class: "play", "aria-label": "Play" }, "▶");
  const slider = h("input", { type: "range", min: 0, max: grasp.frames.length - 1, step: 1, value: grasp.grasped, "aria-label": "Moment" });
  const said = h("output", { class: "moment" });
  const tell = () => {
    const frame = grasp.frames[grasp.current];
    const text = `${NAMES[frame.phase] ?? frame.phase} · ${frame.said}`;
    said.textContent = text;
    slider.setAttribute("aria-valuetext", text);
  };
  const go = (index) => {
    grasp.show(index);
    slider.value = index;
    tell();
  };
  let step = null;
  const stop = () => {
    if (!step) return;
    grasp.stage.stop(step);
    step = null;
    play.textContent = "▶";
    play.setAttribute("aria-label", "Play");
  };
  const start = () => {
    let next = grasp.current >= grasp.frames.length - 1 ? 0 : grasp.current;
    let before = 0;
    play.textContent = "❚❚";
    play.setAttribute("aria-label", "Pause");
    step = (now) => {
      if (now - before < FRAME) return true;
      before = now;
      go(next++);
      if (next < grasp.frames.length) return true;
      stop();
      return false;
    };
    grasp.stage.rest();
    grasp.stage.animate(step);
  };
  shown.stop = stop;
  play.addEventListener("click", () => (step ? stop() : start()));
  slider.addEventListener("input", () => (stop(), go(Number(slider.value))));
  const band = h("div", { class: "band", "aria-hidden": "true" });
  const paint = () => (band.style.background = stripes(grasp.frames, document.phase_colors));
  paint();
  tell();
  if (job.result?.grasps[rank - 1]?.verification) {
    api.motion(job.id, rank).then((motion) => {
      if (shown?.grasp !== grasp || !motion.times.length) return;
      grasp.addMotion(motion);
      slider.max = grasp.frames.length - 1;
      paint();
    }, () => {}); // without it the search can still be looked at
  }
  const toggles = TOGGLES.filter(([name]) => name !== "pregrasp" || document.pregrasp).map(([name, label, checked]) =>
    h("label", { class: "check" }, h("input", { type: "checkbox", name, checked, on: { change: (event) => grasp.want(name, event.target.checked) } }), label),
  );
  return h("div", { class: "controls" }, h("div", { class: "moments" }, play, h("div", { class: "track" }, slider, band)), said, h("div", { class: "toggles" }, toggles), ...assumedKey(document));
}

// What the colour of a contact says where the surface was not seen.
function assumedKey({ assumed = [] }) {
  if (!assumed.some(Boolean)) return [];
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = ASSUMED;
  return [h("ul", { class: "legend" }, h("li", {}, swatch, "Contact where the surface is assumed, not seen"))];
}

// The phases as stripes below the slider, coloured as in the paper.
function stripes(frames, phases) {
  const stops = frames.map((frame, index) => {
    const color = phases[frame.phase] ?? COLORS[frame.phase] ?? "#999999";
    return `${color} ${((100 * index) / frames.length).toFixed(2)}% ${((100 * (index + 1)) / frames.length).toFixed(2)}%`;
  });
  return `linear-gradient(to right, ${stops.join(",")})`;
}
