// The place of a recording on a run's page: the viewer opens when it is asked for.

import { links } from "./api.js";
import { find, h } from "./dom.js";

const SAYS = {
  loading: "Loading the viewer; the first time takes a few seconds.",
  started: "Opening the recording.",
};

// Offer the recording of a grasp.
export function invite(job, rank) {
  const place = find("#recording");
  place.hidden = false;
  place.classList.add("closed");
  place.removeAttribute("data-state");
  place.replaceChildren(
    h(
      "div",
      { class: "invitation" },
      h("h2", {}, `Recording of grasp ${rank}`),
      h("p", { class: "hint" }, "Every step of the search on one timeline, with curves and log, in rerun's viewer."),
      h("button", { type: "button", on: { click: () => open(job, rank) } }, "Open the recording"),
      h("a", { href: links.recording(job.id, rank), download: `${job.object_name}-grasp-${rank}.rrd` }, "Download it for rerun"),
    ),
  );
}

function open(job, rank) {
  const place = find("#recording");
  place.classList.remove("closed");
  const frame = h("iframe", {
    src: `/review/viewer?recording=${encodeURIComponent(links.recording(job.id, rank))}`,
    title: `Recording of grasp ${rank} of ${job.object_name}`,
    allow: "fullscreen",
  });
  const status = h("p", { class: "status", role: "status" }, SAYS.loading);
  place.dataset.state = "loading";
  place.replaceChildren(frame, status);
  place.scrollIntoView({ block: "nearest" });
  frame.focus({ preventScroll: true });
  window.addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.source !== frame.contentWindow || !event.data.viewer) return;
    const { viewer, detail } = event.data;
    place.dataset.state = viewer;
    status.hidden = viewer === "open";
    if (viewer === "failed") fail(job, rank, detail);
    else status.textContent = SAYS[viewer] ?? "";
  });
}

function fail(job, rank, detail) {
  invite(job, rank);
  const place = find("#recording");
  place.dataset.state = "failed";
  place.querySelector(".invitation").prepend(h("p", { class: "error", role: "alert" }, `${detail} The download opens in rerun.`));
}
