// Trades an API key for a session.

import { signIn } from "./api.js";
import { find, forgive, report } from "./dom.js";

find("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  forgive();
  try {
    await signIn(find("#key").value);
  } catch (error) {
    report(error);
    find("#key").select();
    return;
  }
  const next = new URLSearchParams(location.search).get("next") ?? "";
  // Only paths of our own pages, so that nobody can be sent elsewhere by a link to this page.
  location.assign(/^\/review(?:[/?]|$)/.test(next) ? next : "/review");
});
