// A grasp on a stage: the search from its mapped start, the approach, and the simulation, one moment at a time.

import { Hand3d } from "./hand3d.js";
import { Stage } from "./stage.js";
import { ballAround, meshGeometry, place, points, pose, primitiveGeometry } from "./three.js";
import { SOLID, Veils } from "./veils.js";

const CONE = 0.018; // height of the drawn friction cones [m]
const LONGEST = 0.06; // arrow of the largest force [m]
const DOT = 0.003; // radius of a contact [m]
export const ASSUMED = "#c23fd1"; // of a contact where the surface was not seen
const STEPS = { approach: 18, closing: 10 };

export class Grasp3d {
  constructor(THREE, canvas, document) {
    this.THREE = THREE;
    this.document = document;
    this.hand = new Hand3d(THREE, document.hand);
    this.object = this.objectMesh();
    this.frames = this.planned();
    this.grasped = document.states.palm.length - 1;
    const last = this.frames[this.grasped];
    this.hand.move(last.palm, last.joints);
    const around = ballAround(THREE, this.object, this.hand.group);
    const approach = new THREE.Vector3(...document.parallel_grasp.approach);
    const [first, second] = document.parallel_grasp.contacts.map((point) => new THREE.Vector3(...point));
    const jaw = first.sub(second).normalize();
    const side = new THREE.Vector3().crossVectors(jaw, approach).addScaledVector(jaw, 0.35).addScaledVector(approach, -0.3);
    this.stage = new Stage(THREE, canvas, { radius: around.radius, target: around.center, up: new THREE.Vector3(...document.up), towards: side });
    const obstacles = surroundings(THREE, document, this.object);
    this.stage.veils = new Veils(THREE, obstacles, around);
    this.around = around;
    this.stage.scene.add(this.object, this.hand.group, obstacles, this.marks(), this.way());
    this.show(this.grasped);
  }

  objectMesh() {
    const { THREE, document } = this;
    const material = new THREE.MeshPhongMaterial({ color: 0x5c8cc7, transparent: true, opacity: 0.5, depthWrite: false, shininess: 60 });
    const mesh = new THREE.Mesh(meshGeometry(THREE, document.object), material);
    mesh.renderOrder = 2;
    return mesh;
  }

  // Every moment that can be shown without the simulation.
  planned() {
    const { THREE, document } = this;
    const { states, pregrasp } = document;
    const frames = states.palm.map((palm, t) => ({
      phase: states.phases[t],
      palm: pose(THREE, palm),
      joints: states.joints[t],
      contacts: states.contacts[t],
      normals: states.normals[t],
      forces: t === states.palm.length - 1 ? document.forces : null,
      assumed: t === states.palm.length - 1 ? document.assumed : null, // none in scenes of older versions
      said: `Q ${states.quality[t].toPrecision(4)}`,
    }));
    if (!pregrasp) return frames;
    const end = frames.at(-1);
    const begin = pose(THREE, pregrasp.palm);
    for (let step = 0; step <= STEPS.approach; step++) {
      const palm = end.palm.clone();
      const [from, to] = [begin, end.palm].map((matrix) => new THREE.Vector3().setFromMatrixPosition(matrix));
      palm.setPosition(from.lerp(to, step / STEPS.approach));
      frames.push({ phase: "approach", follow: true, palm, joints: pregrasp.joints, said: "Pre-grasp, straight in" });
    }
    for (let step = 1; step <= STEPS.closing; step++) {
      const joints = pregrasp.joints.map((angle, j) => angle + ((end.joints[j] - angle) * step) / STEPS.closing);
      frames.push({ phase: "closing", palm: end.palm, joints, said: "The fingers close" });
    }
    return frames;
  }

  // Puts the simulation behind the planned moments.
  addMotion(motion) {
    const { THREE } = this;
    motion.times.forEach((time, t) => {
      this.frames.push({
        phase: "simulation",
        follow: true,
        palm: pose(THREE, motion.palm[t]),
        joints: motion.joints[t],
        object: pose(THREE, motion.object[t]),
        contacts: motion.contacts[t],
        forces: motion.forces[t],
        said: `${motion.phases[t].replaceAll("_", " ")}, ${time.toFixed(2)} s`,
      });
    });
  }

  // Contacts, friction cones and force arrows, one of each for every finger.
  marks() {
    const { THREE, document } = this;
    const group = new THREE.Group();
    const dot = new THREE.SphereGeometry(DOT, 16, 12);
    const cone = new THREE.ConeGeometry(document.friction * CONE, CONE, 32, 1, true).translate(0, -CONE / 2, 0);
    const shaft = new THREE.CylinderGeometry(0.0011, 0.0011, 1, 12).translate(0, 0.5, 0);
    const head = new THREE.ConeGeometry(0.003, 0.009, 16).translate(0, -0.0045, 0);
    this.marked = document.fingers.map(({ color }) => {
      const solid = new THREE.MeshPhongMaterial({ color, depthTest: false });
      const green = new THREE.MeshPhongMaterial({ color: 0x1f9d57, depthTest: false });
      const film = new THREE.MeshPhongMaterial({ color: 0xf0be46, transparent: true, opacity: 0.38, side: THREE.DoubleSide, depthWrite: false });
      const marks = { dot: new THREE.Mesh(dot, solid), cone: new THREE.Mesh(cone, film), arrow: new THREE.Group() };
      const [line, tip] = [new THREE.Mesh(shaft, green), new THREE.Mesh(head, green)];
      marks.arrow.add(line, tip);
      marks.dot.renderOrder = line.renderOrder = tip.renderOrder = 4;
      marks.cone.renderOrder = 3;
      Object.assign(marks, { line, tip });
      group.add(marks.dot, marks.cone, marks.arrow);
      return marks;
    });
    this.wanted = { cones: true, forces: true };
    return group;
  }

  // The straight way in, and the hand where it begins.
  way() {
    const { THREE, document } = this;
    this.waiting = new THREE.Group();
    if (!document.pregrasp) return this.waiting;
    const begin = pose(THREE, document.pregrasp.palm);
    this.shade = this.hand.ghost(0x8a93a3, 0.22);
    this.shade.move(begin, document.pregrasp.joints);
    const ends = [begin, this.frames[this.grasped].palm].map((matrix) => new THREE.Vector3().setFromMatrixPosition(matrix));
    const line = new THREE.Line(new THREE.BufferGeometry().setFromPoints(ends), new THREE.LineDashedMaterial({ color: 0x8a4fc0, dashSize: 0.006, gapSize: 0.004 }));
    line.computeLineDistances();
    this.waiting.add(this.shade.group, line);
    this.waiting.visible = false;
    return this.waiting;
  }

  // Where the hand and the object have gone since the grasp, half-way between the two; an object that fell is left behind.
  moved(frame) {
    const { THREE } = this;
    if (!frame.follow) return new THREE.Vector3();
    const [now, then] = [frame.palm, this.frames[this.grasped].palm].map((matrix) => new THREE.Vector3().setFromMatrixPosition(matrix));
    const { center, radius } = this.around;
    const object = frame.object ? center.clone().applyMatrix4(frame.object).sub(center).clampLength(0, radius) : new THREE.Vector3();
    return now.sub(then).add(object).multiplyScalar(0.5);
  }

  show(index) {
    const { THREE } = this;
    const frame = this.frames[index];
    this.current = index;
    this.stage?.shift.copy(this.moved(frame));
    this.hand.move(frame.palm, frame.joints);
    place(this.object, frame.object ?? new THREE.Matrix4());
    const forces = (frame.forces ?? []).map((force) => (force ? new THREE.Vector3(...force) : null));
    this.strongest = Math.max(...this.frames.flatMap((one) => (one.forces ?? []).map((force) => (force ? Math.hypot(...force) : 0))), 1e-6);
    const upwards = new THREE.Vector3(0, 1, 0);
    this.marked.forEach((marks, finger) => {
      const contact = frame.contacts?.[finger];
      const force = forces[finger];
      const size = force ? (LONGEST * force.length()) / this.strongest : 0;
      marks.dot.material.color.set(frame.assumed?.[finger] ? ASSUMED : this.document.fingers[finger].color);
      marks.dot.visible = Boolean(contact) && (!frame.object || size > 0);
      marks.cone.visible = Boolean(contact && frame.normals && this.wanted.cones);
      marks.arrow.visible = this.wanted.forces && size > 1e-4;
      if (!contact) return;
      marks.dot.position.set(...contact);
      marks.cone.position.set(...contact);
      // The cone's tip is at its upper end, so its axis looks out of the object.
      if (frame.normals) marks.cone.quaternion.setFromUnitVectors(upwards, new THREE.Vector3(...frame.normals[finger]).normalize());
      if (!marks.arrow.visible) return;
      const direction = force.clone().normalize();
      marks.arrow.quaternion.setFromUnitVectors(upwards, direction);
      marks.arrow.position.set(...contact).addScaledVector(direction, -size);
      marks.line.scale.set(1, Math.max(size - 0.008, 1e-4), 1);
      marks.tip.position.set(0, size, 0);
    });
    this.stage?.draw();
  }

  want(what, wanted) {
    if (what === "shapes") this.hand.showShapes(wanted);
    else if (what === "pregrasp") this.waiting.visible = wanted;
    else this.wanted[what] = wanted;
    this.show(this.current);
  }

  end() {
    this.stage.end();
  }
}

// Support surfaces and obstacles, what has no end drawn as a sheet below the object.
export function surroundings(THREE, document, object) {
  const group = new THREE.Group();
  const material = () => new THREE.MeshPhongMaterial({ color: 0xb8a88a, transparent: true, opacity: SOLID, side: THREE.DoubleSide, depthWrite: false });
  const middle = new THREE.Box3().setFromObject(object).getCenter(new THREE.Vector3());
  for (const one of document.around) {
    const where = pose(THREE, one.pose);
    if ("plane" in one) {
      const [across, along] = one.plane ?? [0.7, 0.7];
      const sheet = new THREE.Mesh(new THREE.PlaneGeometry(across, along), material());
      if (!one.plane) where.multiply(new THREE.Matrix4().setPosition(middle.clone().applyMatrix4(where.clone().invert()).setZ(0)));
      place(sheet, where);
      group.add(sheet);
      continue;
    }
    let shape;
    if (one.kind) shape = new THREE.Mesh(primitiveGeometry(THREE, one.kind, one.size), material());
    else if (one.faces) shape = new THREE.Mesh(meshGeometry(THREE, one), material());
    else if (one.points) {
      const geometry = new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(points(one), 3));
      shape = new THREE.Points(geometry, new THREE.PointsMaterial({ color: 0x9a7f52, size: 0.004 }));
    } else continue;
    place(shape, where);
    group.add(shape);
  }
  return group;
}
