// The service's HTTP interface. Everything stays on this origin; a missing session leads to the sign-in page.

export class Problem extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

async function call(path, options = {}) {
  const response = await fetch(path, { credentials: "same-origin", ...options });
  if (response.status === 401 && !location.pathname.endsWith("/login")) {
    location.assign(`/review/login?next=${encodeURIComponent(location.pathname + location.search)}`);
    return new Promise(() => {}); // the page is being left
  }
  if (!response.ok) throw new Problem(await explain(response), response.status);
  return response.status === 204 ? null : response.json();
}

async function explain(response) {
  try {
    const problem = await response.json();
    const fields = (problem.errors ?? []).map((error) => `${error.field.replace(/^\//, "")}: ${error.detail}`);
    return [problem.detail, ...fields.filter((text) => !text.endsWith(problem.detail))].join(" ");
  } catch {
    return `The service answered ${response.status}.`;
  }
}

const post = (path, body) =>
  call(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

export const hands = () => call("/v1/hands");
// What the planner's registries hold; nothing while the workers are still starting, and the pages do without.
const listed = (path) => call(path).catch(() => []);
export const metrics = () => listed("/v1/metrics");
export const protocols = () => listed("/v1/protocols");
export const formats = () => listed("/v1/formats");
export const job = (id) => call(`/v1/jobs/${id}`);
export const createJob = (body) => post("/v1/jobs", body);
export const cancelJob = (id) => call(`/v1/jobs/${id}/cancel`, { method: "POST" });
export const deleteJob = (id) => call(`/v1/jobs/${id}`, { method: "DELETE" });
export const curve = (id, rank) => call(`/v1/jobs/${id}/grasps/${rank}/curve`);
export const scene = (id, rank) => call(`/v1/jobs/${id}/grasps/${rank}/scene`);
const motions = new Map(); // of requests that have not ended: the view and the report ask for the same
export function motion(id, rank) {
  const path = `/v1/jobs/${id}/grasps/${rank}/motion`;
  if (!motions.has(path)) motions.set(path, call(path).finally(() => motions.delete(path)));
  return motions.get(path);
}
export const starts = (id) => call(`/v1/jobs/${id}/starts`);
export const hand = (name) => call(`/v1/hands/${name}`);
export const handScene = (name) => call(`/v1/hands/${name}/scene`);
export const tryHand = (name) => call(`/v1/hands/${name}/trial`, { method: "POST" });
export const correctHand = (name, description) => post(`/v1/hands/${name}/descriptions`, { description });
export const deleteHand = (name) => call(`/v1/hands/${name}`, { method: "DELETE" });
export const signIn = (key) => post("/review/session", { key });

export const objects = (limit) => call(`/v1/objects?limit=${limit}`);
export const datasets = () => call("/v1/datasets?limit=100");
export const dataset = (id) => call(`/v1/datasets/${id}`);
export const createDataset = (body) => post("/v1/datasets", body);
export const cancelDataset = (id) => call(`/v1/datasets/${id}/cancel`, { method: "POST" });
export const deleteDataset = (id) => call(`/v1/datasets/${id}`, { method: "DELETE" });
export const batches = () => call("/v1/batches?limit=50");
export const batch = (id) => call(`/v1/batches/${id}`);
export const cancelBatch = (id) => call(`/v1/batches/${id}/cancel`, { method: "POST" });

export function jobs(filters) {
  const query = new URLSearchParams(Object.entries(filters).filter(([, value]) => value));
  return call(`/v1/jobs?${query}`);
}

export function upload(file, unit, said = {}) {
  const form = new FormData();
  form.append("file", file);
  form.append("unit", unit);
  for (const [name, value] of Object.entries(said)) form.append(name, value);
  return call("/v1/objects", { method: "POST", body: form });
}

export function uploadHand(file, fields) {
  const form = new FormData();
  form.append("file", file);
  for (const [name, value] of Object.entries(fields)) if (value) form.append(name, value);
  return call("/v1/hands", { method: "POST", body: form });
}

export const links = {
  hand: (name) => `/review/hands/${name}`,
  handPicture: (name) => `/v1/hands/${name}/picture.png`,
  dataset: (id) => `/review/datasets/${id}`,
  manifest: (id) => `/v1/datasets/${id}/manifest`,
  shard: (id, index, round) => `/v1/datasets/${id}/shards/${index}/${round}`,
  batch: (id) => `/review/batches/${id}`,
  run: (id) => `/review/runs/${id}`,
  thumbnail: (id) => `/v1/jobs/${id}/thumbnail.webp`,
  result: (id) => `/v1/jobs/${id}`,
  recording: (id, rank) => `/v1/jobs/${id}/grasps/${rank}/recording.rrd`,
  picture: (id, rank) => `/v1/jobs/${id}/grasps/${rank}/picture.png`,
  exported: (id, format) => `/v1/jobs/${id}/export/${format}`,
  animation: (id, rank) => `/v1/jobs/${id}/grasps/${rank}/animation.webp`,
};

const ENDED = ["succeeded", "failed", "cancelled"];
export const hasEnded = (state) => ENDED.includes(state);

// Calls `onChange` with every summary of a job until it has ended; resolves with the whole job. The browser reconnects
// a broken stream by itself and goes on after the last event it saw.
export function follow(id, onChange) {
  return new Promise((resolve, reject) => {
    const stream = new EventSource(`/v1/jobs/${id}/events`);
    for (const state of ["queued", "running", ...ENDED]) {
      stream.addEventListener(state, (event) => {
        onChange(JSON.parse(event.data));
        if (hasEnded(state)) {
          stream.close();
          job(id).then(resolve, reject);
        }
      });
    }
    stream.onerror = () => {
      if (stream.readyState === EventSource.CLOSED) reject(new Problem("The connection to the service was lost."));
    };
  });
}
