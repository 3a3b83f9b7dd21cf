// Obstacles that stand between the camera and the grasp are faded, so that a wall does not hide the hand.

const SHARE = 0.5; // of the radius at which points beside the centre are looked at, too

export const SOLID = 0.55;
export const FADED = 0.1;

export class Veils {
  constructor(THREE, group, { center, radius }) {
    this.center = center.clone();
    this.side = SHARE * radius;
    this.ray = new THREE.Ray();
    [this.aim, this.start, this.hit] = [0, 1, 2].map(() => new THREE.Vector3());
    group.updateMatrixWorld(true);
    this.all = group.children
      .filter((one) => one.isMesh)
      .map((one) => {
        one.geometry.computeBoundingBox();
        return { one, box: one.geometry.boundingBox, inverse: one.matrixWorld.clone().invert() };
      });
  }

  // Fades what hides the centre, or a point above, below or beside it; answers how many are faded.
  update(camera) {
    let faded = 0;
    for (const veil of this.all) {
      const hides = this.hides(veil, camera);
      veil.one.material.opacity = hides ? FADED : SOLID;
      faded += hides ? 1 : 0;
    }
    return faded;
  }

  hides({ box, inverse }, camera) {
    const { ray, aim, start, hit } = this;
    start.copy(camera.position).applyMatrix4(inverse);
    for (const [right, above] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) {
      aim.setFromMatrixColumn(camera.matrix, 0).multiplyScalar(right * this.side);
      aim.addScaledVector(hit.setFromMatrixColumn(camera.matrix, 1), above * this.side).add(this.center).applyMatrix4(inverse);
      ray.origin.copy(start);
      ray.direction.copy(aim).sub(start).normalize();
      if (box.containsPoint(start) || (ray.intersectBox(box, hit) && hit.distanceTo(start) < aim.distanceTo(start))) return true;
    }
    return false;
  }
}
