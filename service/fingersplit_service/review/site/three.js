// three.js of this origin, loaded once; and how the service's scene documents become its geometries.

let loading = null;

export class NoPicture extends Error {}

// Resolves with THREE. Says in a sentence what is missing, so that the page can offer its still picture instead.
export function three() {
  if (!document.createElement("canvas").getContext("webgl")) return Promise.reject(new NoPicture("This browser has no WebGL, so nothing can be turned here."));
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = "/review/viewer/three.js";
    script.onload = () => resolve(window.THREE);
    script.onerror = () => {
      loading = null;
      script.remove();
      reject(new NoPicture("The 3-D view is not set up; `fingersplit setup-viewer` on the service's machine does it."));
    };
    document.head.append(script);
  });
  return loading;
}

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
}

// Points of 16 bits in the box that the document gives, [m].
export function points(document) {
  const steps = new Uint16Array(bytes(document.points));
  const scale = document.span / 0xffff;
  return Float32Array.from(steps, (step, index) => document.low[index % 3] + step * scale);
}

export function meshGeometry(THREE, document) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points(document), 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(Float32Array.from(new Int8Array(bytes(document.normals)), (step) => step / 127), 3));
  const faces = bytes(document.faces);
  geometry.setIndex(new THREE.BufferAttribute(document.wide ? new Uint32Array(faces) : new Uint16Array(faces), 1));
  return geometry;
}

// Primitives by MuJoCo's numbers: sphere, capsule, cylinder, box; half sizes, axes along z.
export function primitiveGeometry(THREE, kind, size) {
  if (kind === 2) return new THREE.SphereGeometry(size[0], 24, 16);
  if (kind === 6) return new THREE.BoxGeometry(2 * size[0], 2 * size[1], 2 * size[2]);
  const geometry = kind === 3 ? new THREE.CapsuleGeometry(size[0], 2 * size[1], 10, 20) : new THREE.CylinderGeometry(size[0], size[0], 2 * size[1], 32);
  return geometry.rotateX(Math.PI / 2); // three.js has them along y
}

export function pose(THREE, [x, y, z, qw, qx, qy, qz]) {
  return new THREE.Matrix4().compose(new THREE.Vector3(x, y, z), new THREE.Quaternion(qx, qy, qz, qw), new THREE.Vector3(1, 1, 1));
}

export function place(object, matrix) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(matrix);
  object.matrixWorldNeedsUpdate = true;
}

// A small ball around all corners that are drawn of some objects: it grows from the middle of their box towards each corner outside.
export function ballAround(THREE, ...objects) {
  const corners = [];
  for (const object of objects) {
    object.updateMatrixWorld(true);
    object.traverseVisible(({ isMesh, geometry, matrixWorld }) => {
      const positions = isMesh ? geometry.attributes.position : { count: 0 };
      for (let index = 0; index < positions.count; index += 3) corners.push(new THREE.Vector3().fromBufferAttribute(positions, index).applyMatrix4(matrixWorld));
    });
  }
  const center = new THREE.Box3().setFromPoints(corners).getCenter(new THREE.Vector3());
  let radius = 0;
  for (let round = 0; round < 3; round++) {
    radius *= 0.9;
    for (const corner of corners) {
      const far = corner.distanceTo(center);
      if (far <= radius) continue;
      radius = (radius + far) / 2;
      center.lerp(corner, 1 - radius / far);
    }
  }
  return new THREE.Sphere(center, radius);
}
