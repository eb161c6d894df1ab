// Search over titles, headings and words of all pages (PAGES of search_index.js), without a server.
"use strict";
const field = document.getElementById("search");
const list = document.getElementById("found");
const MOST = 12;

/** Places that hold all words of a query, the best first: [score, link, text]. */
function places(query) {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  const found = [];
  if (!words.length) return found;
  const hits = (text) => words.every((word) => text.includes(word));
  for (const [file, title, headings, content] of PAGES) {
    if (hits(title.toLowerCase())) found.push([3, file, title]);
    let shown = 0;
    for (const [text, anchor] of headings) {
      const low = text.toLowerCase();
      if (hits(low)) {
        const exact = low === query.trim().toLowerCase() ? 4 : 2;
        found.push([exact, `${file}#${encodeURIComponent(anchor)}`, `${text} (${title})`]);
        shown += 1;
      }
    }
    if (!shown && hits(content)) found.push([1, file, title]);
  }
  return found.sort((a, b) => b[0] - a[0]).slice(0, MOST);
}

function show() {
  const found = places(field.value);
  list.replaceChildren(
    ...found.map(([, link, text]) => {
      const item = document.createElement("li");
      const anchor = document.createElement("a");
      anchor.href = link;
      anchor.textContent = text;
      item.append(anchor);
      return item;
    }),
  );
  if (!found.length && field.value.trim()) list.textContent = "Nothing found.";
  list.hidden = !field.value.trim();
}

field.addEventListener("input", show);
field.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    field.value = "";
    show();
  }
  if (event.key === "Enter" && list.querySelector("a")) list.querySelector("a").click();
});
list.addEventListener("click", () => {
  field.value = "";
  show();
});
