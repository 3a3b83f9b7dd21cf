// All starts of a run on the object: a dot where each ended, coloured by its end; one of them with the hand.

import * as api from "./api.js";
import { h } from "./dom.js";
import { sentence } from "./format.js";
import { surroundings } from "./grasp3d.js";
import { Hand3d } from "./hand3d.js";
import { Stage } from "./stage.js";
import { meshGeometry, pose, three } from "./three.js";
import { Veils } from "./veils.js";

const GOOD = "#1f9d57";
const ENDS = ["#d1495b", "#e08e1b", "#7b4fb5", "#1f8a9e", "#a06a3c", "#4f6fd0", "#b0549a", "#6b7480"];

export async function viewStarts(place, job) {
  place.dataset.state = "loading";
  const canvas = h("canvas", { "aria-label": `Starts of ${job.object_name} in three dimensions. Arrow keys turn the view.`, role: "application" });
  const said = h("p", { class: "status", role: "status" }, "Searching again …");
  const scene = h("div", { class: "scene" }, canvas, said);
  place.replaceChildren(scene);
  try {
    const [THREE, document] = await Promise.all([three(), api.starts(job.id)]);
    place.append(mount(THREE, canvas, document));
    said.hidden = true;
    place.dataset.state = "drawn";
  } catch (error) {
    canvas.remove();
    place.dataset.state = "failed";
    said.replaceChildren(h("span", { role: "alert" }, error.message), " ", h("button", { type: "button", on: { click: () => viewStarts(place, job) } }, "Try again"));
  }
}

function mount(THREE, canvas, document) {
  const { starts } = document;
  const failed = [...new Set(starts.filter((one) => !one.feasible).map((one) => one.end))];
  const color = (one) => (one.feasible ? GOOD : ENDS[failed.indexOf(one.end) % ENDS.length]);
  const material = new THREE.MeshPhongMaterial({ color: 0x5c8cc7, transparent: true, opacity: 0.45, depthWrite: false });
  const object = new THREE.Mesh(meshGeometry(THREE, document.object), material);
  const hand = new Hand3d(THREE, document.hand);
  const up = new THREE.Vector3(...document.up);
  const box = new THREE.Box3().setFromObject(object);
  const dots = starts.map((one) => {
    const group = new THREE.Group();
    const ball = new THREE.SphereGeometry(0.0035, 12, 8);
    const paint = new THREE.MeshPhongMaterial({ color: color(one) });
    const middle = new THREE.Vector3();
    for (const contact of one.contacts) {
      const dot = new THREE.Mesh(ball, paint);
      dot.position.set(...contact);
      dot.scale.setScalar(0.6);
      middle.add(dot.position);
      group.add(dot);
    }
    const palm = new THREE.Vector3(...one.palm.slice(0, 3));
    const head = new THREE.Mesh(ball, paint);
    head.position.copy(palm);
    middle.divideScalar(Math.max(one.contacts.length, 1));
    group.add(head, new THREE.Line(new THREE.BufferGeometry().setFromPoints([palm, middle]), new THREE.LineBasicMaterial({ color: color(one), transparent: true, opacity: 0.5 })));
    box.expandByPoint(palm);
    return group;
  });
  const { center, radius } = box.getBoundingSphere(new THREE.Sphere());
  const stage = new Stage(THREE, canvas, { radius: 0.82 * radius, target: center, up, towards: new THREE.Vector3(up.y + 0.4, up.z + 0.3, up.x + 0.5) });
  const obstacles = surroundings(THREE, document, object);
  stage.veils = new Veils(THREE, obstacles, { center, radius });
  stage.scene.add(object, obstacles, hand.group, ...dots);
  hand.group.visible = false;
  const why = h("div", { class: "why", role: "status" }, h("p", { class: "hint" }, "Each dot is a palm where a start ended, with a line to its contacts. Choose a start to see the hand there."));
  const choose = (index) => {
    const one = starts[index];
    hand.group.visible = one !== undefined;
    dots.forEach((dot, place) => (dot.visible = one === undefined || place === index));
    if (one) {
      hand.move(pose(THREE, one.palm), one.joints);
      why.replaceChildren(
        h("p", {}, h("span", { class: `badge ${one.feasible ? "good" : "bad"}` }, sentence(one.end)), ` ${one.advice}`),
        ...(one.violations.length ? [h("ul", { class: "violations" }, one.violations.map((text) => h("li", {}, text)))] : []),
      );
    }
    stage.draw();
  };
  const select = h(
    "select",
    { id: "start", on: { change: (event) => choose(event.target.value === "" ? undefined : Number(event.target.value)) } },
    h("option", { value: "" }, `All ${starts.length}`),
    starts.map((one, index) => h("option", { value: index }, `${index + 1}: ${sentence(one.end)}`)),
  );
  const key = [["feasible", GOOD], ...failed.map((end, index) => [end, ENDS[index % ENDS.length]])].map(([end, shade]) => {
    const swatch = h("span", { class: "swatch" });
    swatch.style.background = shade;
    return h("li", {}, swatch, sentence(end));
  });
  addEventListener("pagehide", () => stage.end());
  stage.rotate();
  return h("div", { class: "controls" }, h("div", { class: "toggles" }, h("label", { for: "start" }, "Start"), select), h("ul", { class: "legend" }, key), why);
}
