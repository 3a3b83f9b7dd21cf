// Objects to try without a file of one's own, made here as OFF files in metres.

const around = (count, make) => Array.from({ length: count }, (_, k) => make((2 * Math.PI * k) / count));

// A body of rings from the bottom to the top: [radius across, radius along, height], with `count` corners each.
function stack(rings, count, turn = 0) {
  const points = rings.flatMap(([x, y, z]) => around(count, (angle) => [x * Math.cos(angle + turn), y * Math.sin(angle + turn), z]));
  const faces = [];
  const at = (ring, k) => ring * count + (k % count);
  for (let ring = 0; ring + 1 < rings.length; ring++) {
    for (let k = 0; k < count; k++) faces.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)], [at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
  }
  const [bottom, top] = [points.length, points.length + 1];
  points.push([0, 0, rings[0][2]], [0, 0, rings.at(-1)[2]]);
  for (let k = 0; k < count; k++) faces.push([bottom, at(0, k + 1), at(0, k)], [top, at(rings.length - 1, k), at(rings.length - 1, k + 1)]);
  return `OFF\n${points.length} ${faces.length} 0\n${points.map((point) => point.map((value) => value.toFixed(6)).join(" ")).join("\n")}\n${faces.map((face) => `3 ${face.join(" ")}`).join("\n")}\n`;
}

const half = Math.SQRT2 * 0.025;
const BOTTLE = [[0.032, 0], [0.034, 0.01], [0.034, 0.1], [0.03, 0.12], [0.014, 0.15], [0.013, 0.18]];

export const SAMPLES = {
  can: ["Can, 60 mm", () => stack([[0.03, 0.03, 0], [0.03, 0.03, 0.12]], 64)],
  box: ["Box, 50 mm", () => stack([[half, half, 0], [half, half, 0.11]], 4, Math.PI / 4)],
  bottle: ["Bottle", () => stack(BOTTLE.map(([radius, height]) => [radius, radius, height]), 64)],
};

export const sampleFile = (name) => new File([SAMPLES[name][1]()], `${name}.off`);
