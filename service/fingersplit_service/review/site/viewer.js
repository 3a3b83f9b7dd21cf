/* global wasm_bindgen */
// rerun's viewer on one recording of this service, in a frame of its own. It tells the page around it how it goes.

const FILES = document.querySelector("script[data-files]").dataset.files;
const OPEN_WITHIN = 120_000; // [ms]; a software renderer takes seconds
const POLL = 250; // [ms]

function tell(state, detail = "") {
  document.documentElement.dataset.state = state;
  if (parent !== window) parent.postMessage({ viewer: state, detail }, location.origin);
}

// The viewer reports its use to its maker. The page's policy forbids that; answering here keeps it from complaining.
const fetchAnything = window.fetch.bind(window);
window.fetch = (input, options) => {
  const address = new URL(input instanceof Request ? input.url : input, location.href);
  return address.origin === location.origin ? fetchAnything(input, options) : Promise.resolve(new Response(null, { status: 204 }));
};

function recording() {
  const path = new URLSearchParams(location.search).get("recording") ?? "";
  if (!/^\/v1\/jobs\/[\w-]+\/(?:grasps\/\d+\/)?recording\.rrd$/.test(path)) throw new Error("There is no recording at that address.");
  return new URL(path, location.origin).href;
}

function load(script) {
  return new Promise((resolve, reject) => {
    const element = document.createElement("script");
    element.src = script;
    element.onload = resolve;
    element.onerror = () => reject(new Error("The viewer cannot be loaded; `fingersplit setup-viewer` on the service's machine sets it up."));
    document.head.append(element);
  });
}

async function start() {
  if (!document.createElement("canvas").getContext("webgl2")) throw new Error("This browser has no WebGL.");
  const address = recording();
  tell("loading");
  await load(`${FILES}/re_viewer.js`);
  await wasm_bindgen({ module_or_path: `${FILES}/re_viewer_bg.wasm` });
  const viewer = new wasm_bindgen.WebHandle({
    url: [address],
    render_backend: "webgl",
    hide_welcome_screen: true,
    persist: false,
    enable_history: false,
    theme: matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light",
  });
  await viewer.start(document.querySelector("#scene"));
  tell("started");
  await opened(viewer);
  tell("open");
  setInterval(() => viewer.has_panicked() && tell("failed", viewer.panic_message()), 1000);
}

// The viewer's state names the recording that it shows.
async function opened(viewer) {
  const deadline = performance.now() + OPEN_WITHIN;
  while (performance.now() < deadline) {
    if (viewer.has_panicked()) throw new Error(viewer.panic_message());
    if (new TextDecoder().decode(viewer.viewer_state()).includes("recording_id=")) return;
    await new Promise((resolve) => setTimeout(resolve, POLL));
  }
  throw new Error("The recording did not open.");
}

start().catch((error) => tell("failed", error.message));
