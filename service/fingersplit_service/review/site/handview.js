// A hand in its place on a page, with a slider for each driver; the driven joints follow as the model couples them.

import * as api from "./api.js";
import { h } from "./dom.js";
import { Hand3d } from "./hand3d.js";
import { Stage } from "./stage.js";
import { ballAround, three } from "./three.js";

export async function viewHand(place, name) {
  place.dataset.state = "loading";
  const picture = h("img", { class: "still", alt: "The hand half-way and at its preshapes" });
  const canvas = h("canvas", { "aria-label": "Hand in three dimensions. Arrow keys turn it, plus and minus zoom, Home resets.", role: "application" });
  const said = h("p", { class: "status", role: "status" }, "Loading the 3-D view.");
  const scene = h("div", { class: "scene" }, canvas, said);
  place.replaceChildren(scene);
  try {
    const [THREE, document] = await Promise.all([three(), api.handScene(name)]);
    place.append(mount(THREE, canvas, document));
    said.hidden = true;
    place.dataset.state = "drawn";
  } catch (error) {
    canvas.remove();
    picture.src = api.links.handPicture(name);
    scene.prepend(picture);
    place.dataset.state = "failed";
    said.replaceChildren(h("span", { role: "alert" }, error.message), " ", h("button", { type: "button", on: { click: () => viewHand(place, name) } }, "Try again"));
  }
}

function mount(THREE, canvas, document) {
  const hand = new Hand3d(THREE, document.hand);
  const palm = new THREE.Matrix4();
  const angles = document.drivers.map(({ lower, upper }) => Math.min(Math.max(0, lower), upper));
  const follow = () => document.coupling.matrix.map((row, j) => row.reduce((sum, ratio, a) => sum + ratio * angles[a], document.coupling.offset[j]));
  hand.move(palm, document.postures[0].joints);
  const { center, radius } = ballAround(THREE, hand.group);
  const up = new THREE.Vector3(...document.approach);
  const stage = new Stage(THREE, canvas, { radius, target: center, up, towards: new THREE.Vector3(...document.lateral) });
  stage.scene.add(hand.group);
  for (const pad of document.pads) {
    const material = new THREE.MeshPhongMaterial({ color: pad.color, transparent: true, opacity: 0.75 });
    const ball = new THREE.Mesh(new THREE.SphereGeometry(pad.radius * 1.04, 20, 14), material);
    ball.position.set(...pad.center);
    hand.links[pad.link].add(ball);
  }
  const move = () => {
    hand.move(palm, follow());
    stage.draw();
  };
  const sliders = document.drivers.map((driver, a) => {
    const value = h("output", {}, "");
    const tell = () => (value.textContent = `${angles[a].toFixed(2)} rad`);
    const input = h("input", { type: "range", id: `driver-${a}`, min: driver.lower, max: driver.upper, step: "any", value: angles[a] });
    input.addEventListener("input", () => {
      angles[a] = Number(input.value);
      tell();
      move();
    });
    tell();
    return { input, tell, row: h("div", { class: "driver" }, h("label", { for: `driver-${a}` }, driver.name), input, value) };
  });
  const take = (drivers) => {
    drivers.forEach((angle, a) => {
      angles[a] = angle;
      sliders[a].input.value = angle;
      sliders[a].tell();
    });
    move();
  };
  take(document.postures[0].drivers);
  const postures = h("select", { id: "posture", on: { change: (event) => take(document.postures[event.target.value].drivers) } }, document.postures.map((posture, index) => h("option", { value: index }, posture.name)));
  const shapes = h("label", { class: "check" }, h("input", { type: "checkbox", name: "shapes", on: { change: (event) => (hand.showShapes(event.target.checked), stage.draw()) } }), "Collision shapes");
  addEventListener("pagehide", () => stage.end());
  stage.rotate();
  return h("div", { class: "controls" }, h("div", { class: "toggles" }, h("label", { for: "posture" }, "Posture"), postures, shapes), h("div", { class: "drivers" }, sliders.map(({ row }) => row)));
}
