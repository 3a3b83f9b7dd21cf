// A hand of a scene document: links that hang on each other and follow the joints' angles.

import { meshGeometry, place, pose, primitiveGeometry } from "./three.js";

export class Hand3d {
  constructor(THREE, document) {
    this.THREE = THREE;
    this.document = document;
    this.group = new THREE.Group();
    this.links = document.links.map(() => new THREE.Group());
    this.group.add(...this.links);
    this.resting = document.links.map((link) => pose(THREE, link.pose));
    this.hinges = document.joints.map((joint) => ({
      axis: new THREE.Vector3(...joint.axis).normalize(),
      there: new THREE.Matrix4().makeTranslation(...joint.anchor),
      back: new THREE.Matrix4().makeTranslation(...joint.anchor.map((value) => -value)),
    }));
    this.poses = document.links.map(() => new THREE.Matrix4());
    this.looks = document.meshes.map((mesh) => {
      const material = new THREE.MeshPhongMaterial({ color: new THREE.Color(...mesh.rgb), shininess: 45, specular: 0x2a2a2a });
      const look = new THREE.Mesh(meshGeometry(THREE, mesh), material);
      this.links[mesh.link].add(look);
      return look;
    });
    this.shapes = [];
  }

  // The same hand as a shade, sharing its geometries.
  ghost(color, opacity) {
    const { THREE } = this;
    const copy = Object.create(Hand3d.prototype);
    Object.assign(copy, this, { group: new THREE.Group(), links: this.links.map(() => new THREE.Group()), poses: this.poses.map(() => new THREE.Matrix4()), shapes: [] });
    copy.group.add(...copy.links);
    const material = new THREE.MeshPhongMaterial({ color, transparent: true, opacity, depthWrite: false });
    this.looks.forEach((look, index) => copy.links[this.document.meshes[index].link].add(new THREE.Mesh(look.geometry, material)));
    return copy;
  }

  // Where the links stand at joint angles [rad], with the palm at a matrix.
  move(palm, joints) {
    const { THREE, document, poses } = this;
    document.links.forEach((link, index) => {
      const here = poses[index];
      here.copy(link.parent < 0 ? palm : poses[link.parent]).multiply(this.resting[index]);
      for (const j of link.joints) {
        const { axis, there, back } = this.hinges[j];
        const turn = new THREE.Matrix4().makeRotationAxis(axis, joints[j] - document.joints[j].reference);
        here.multiply(there).multiply(turn).multiply(back);
      }
      place(this.links[index], here);
    });
  }

  // Shows the collision shapes instead of the looks.
  showShapes(wanted) {
    const { THREE } = this;
    if (wanted && !this.shapes.length) {
      const material = new THREE.MeshPhongMaterial({ color: 0xe8963c, shininess: 20, transparent: true, opacity: 0.85 });
      this.shapes = this.document.shapes.map((shape) => {
        const mesh = new THREE.Mesh(shape.size ? primitiveGeometry(THREE, shape.kind, shape.size) : meshGeometry(THREE, shape), material);
        place(mesh, pose(THREE, shape.pose));
        this.links[shape.link].add(mesh);
        return mesh;
      });
    }
    for (const shape of this.shapes) shape.visible = wanted;
    for (const look of this.looks) look.visible = !wanted;
  }
}
