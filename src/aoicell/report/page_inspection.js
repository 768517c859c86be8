// Reviewed views: which picture is shown, and whether with boxes.
for (const review of document.querySelectorAll(".review")) {
  const layers = review.querySelector(".layers");
  const choices = review.querySelectorAll("button[data-layer]");
  for (const button of choices) {
    button.addEventListener("click", () => {
      layers.dataset.shown = button.dataset.layer;
      for (const other of choices) other.setAttribute("aria-pressed", String(other === button));
    });
  }
  const boxes = review.querySelector("button[data-boxes]");
  boxes.addEventListener("click", () => {
    const bare = layers.classList.toggle("bare");
    boxes.setAttribute("aria-pressed", String(!bare));
  });
}

// A finding and its box show that they belong together.
for (const board of document.querySelectorAll(".board")) {
  for (const one of board.querySelectorAll("[data-finding]")) {
    const all = board.querySelectorAll(`[data-finding="${one.dataset.finding}"]`);
    const mark = (on) => all.forEach((element) => element.classList.toggle("chosen", on));
    one.addEventListener("pointerenter", () => mark(true));
    one.addEventListener("pointerleave", () => mark(false));
  }
}
