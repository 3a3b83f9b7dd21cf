// Elements from plain data. Text is always text, never markup, whatever a mesh was called.

export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  set(element, attributes);
  element.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function svg(tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

function set(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === "on") for (const [event, handler] of Object.entries(value)) element.addEventListener(event, handler);
    else if (name === "value" || name === "checked" || name === "disabled") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
}

export const find = (selector) => document.querySelector(selector);

export function show(element, visible = true) {
  element.hidden = !visible;
}

export function card(title, { actions = [], wide = false } = {}, ...body) {
  return h(
    "section",
    { class: wide ? "card wide" : "card", "aria-label": title },
    h("header", {}, h("h2", {}, title), actions.length ? h("div", { class: "actions" }, actions) : null),
    h("div", { class: "body" }, body),
  );
}

export function facts(pairs, kind = "facts") {
  return h("dl", { class: kind }, pairs.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
}

export function report(error) {
  const place = find("#problem");
  place.textContent = error.message;
  show(place);
}

// As `report`, of the thing that a page is about.
export function absent(error, what) {
  report(error.status === 404 ? new Error(`There is no such ${what}. It may have been deleted.`) : error);
}

export function forgive() {
  show(find("#problem"), false);
}
