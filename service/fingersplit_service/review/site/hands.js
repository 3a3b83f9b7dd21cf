// The hands that are known, and the upload of another.

import * as api from "./api.js";
import { find, forgive, h, report, show } from "./dom.js";
import { watchDrop } from "./drop.js";
import { ago } from "./format.js";

const form = find("form");

function line(hand) {
  const own = hand.origin === "uploaded";
  return h(
    "li",
    {},
    h("a", { href: api.links.hand(hand.name) }, hand.title),
    h("p", { class: "hint" }, `${hand.fingers.length} fingers, ${hand.joints.length} joints · ${own ? `uploaded ${ago(hand.created_at)}` : hand.name}`),
    own ? h("span", { class: hand.drafted ? "badge warn" : "badge good" }, hand.drafted ? "Draft" : "Yours") : null,
  );
}

async function upload(event) {
  event.preventDefault();
  forgive();
  const { file, model, palm, fingers } = form.elements;
  try {
    if (!file.files.length) throw new Error("Choose a zip first.");
    show(find("#working"));
    form.querySelector("button").disabled = true;
    const hand = await api.uploadHand(file.files[0], { model: model.value, palm: palm.value, fingers: fingers.value });
    location.assign(api.links.hand(hand.name));
  } catch (error) {
    report(error);
    find("#problem").scrollIntoView({ block: "center" });
  } finally {
    show(find("#working"), false);
    form.querySelector("button").disabled = false;
  }
}

form.addEventListener("submit", upload);
watchDrop(find("#drop"), form.elements.file, "Choose a zip, or drop it here", "MJCF or URDF with its meshes; hand.toml if you have one");
api.hands().then((all) => find(".hands").replaceChildren(...all.map(line)), report);
