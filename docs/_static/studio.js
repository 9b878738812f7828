// SPDX-License-Identifier: Apache-2.0
// Puts the studio in the place of its pictures, when the reader asks for it: no page loads it before.

/** The studio takes the colours that the reader chose on this page. */
function follow(frame) {
  const { theme } = document.body.dataset;
  const root = frame.contentDocument.documentElement;
  if (theme === "auto") delete root.dataset.theme;
  else root.dataset.theme = theme;
}

function embed(place, { dataset }) {
  const frame = document.createElement("iframe");
  frame.addEventListener("load", () => {
    follow(frame);
    new MutationObserver(() => follow(frame)).observe(document.body, { attributeFilter: ["data-theme"] });
    frame.contentWindow.focus();
  });
  Object.assign(frame, { src: dataset.page, title: "needleforce studio", className: "studio" });
  document.querySelectorAll("article img[src*='/studio']").forEach((picture) => picture.remove());
  place.replaceWith(frame);
}

for (const place of document.querySelectorAll(".studio-here")) {
  const button = place.querySelector("button");
  button.addEventListener("click", () => embed(place, button));
  button.hidden = false;
  if (location.protocol === "file:") // from a file, a browser loads no modules
    place.textContent = "It runs here once a web server gives these pages, such as python -m http.server.";
}
