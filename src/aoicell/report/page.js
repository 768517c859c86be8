"use strict";

// Tables: a heading's button sorts, the field filters; cells without a value stay last.
function sortKey(row, column) {
  const cell = row.cells[column];
  if (!cell.classList.contains("num")) return cell.textContent;
  return cell.dataset.v === undefined ? NaN : Number(cell.dataset.v);
}

function compareKeys(a, b, sign) {
  if (typeof a === "string") return sign * a.localeCompare(b, "en", { numeric: true });
  if (Number.isNaN(a) || Number.isNaN(b)) return Number.isNaN(a) - Number.isNaN(b);
  return sign * (a - b);
}

function sortBy(table, heading) {
  const falling = heading.getAttribute("aria-sort") === "ascending";
  for (const other of table.tHead.rows[0].cells) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
  const body = table.tBodies[0];
  const keyed = Array.from(body.rows, (row) => [sortKey(row, heading.cellIndex), row]);
  keyed.sort((a, b) => compareKeys(a[0], b[0], falling ? -1 : 1));
  body.append(...keyed.map(([, row]) => row));
}

function filterRows(table, text, output) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const rows = Array.from(table.tBodies[0].rows);
  for (const row of rows) {
    const here = Array.from(row.cells, (cell) => cell.textContent).join(" ").toLowerCase();
    row.hidden = !words.every((word) => here.includes(word));
  }
  const shown = rows.filter((row) => !row.hidden).length;
  output.textContent = words.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
}

for (const box of document.querySelectorAll("[data-sortable]")) {
  const table = box.querySelector("table");
  for (const heading of table.tHead.rows[0].cells) {
    heading.querySelector("button").addEventListener("click", () => sortBy(table, heading));
  }
  const field = box.querySelector("input[type=search]");
  const output = box.querySelector("output");
  if (field) field.addEventListener("input", () => filterRows(table, field.value, output));
}

// Sliders: the new image is cut off to the left of the line.
for (const slider of document.querySelectorAll(".pair input[type=range]")) {
  const show = () => slider.parentElement.style.setProperty("--at", `${slider.value}%`);
  slider.addEventListener("input", show);
  show();
}

// On paper nothing can be opened.
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details")) details.open = true;
});
