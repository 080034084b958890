// Selects a point of the front in all pictures and in the table at once. Everything that belongs to a point carries its
// number as data-point.
(() => {
  "use strict";
  const table = document.querySelector("table.front");
  if (!table) return;
  const body = table.tBodies[0];
  const pictures = [...document.querySelectorAll("svg.plot")].filter((svg) => svg.querySelector("[data-point]"));
  let kept = null; // the point that a click keeps
  let shown = null;

  // Where the dots of a picture are, in its own units.
  const dots = (svg) => [...svg.querySelectorAll("g.dot[data-point]")].map((g) => {
    const [x, y] = g.querySelector("path").getAttribute("d").slice(1).split(/[ h]/).map(Number);
    return { point: g.dataset.point, x, y };
  });

  function show(point) {
    if (point === shown) return;
    for (const element of document.querySelectorAll(".chosen")) element.classList.remove("chosen");
    shown = point;
    if (point === null) return;
    for (const element of document.querySelectorAll(`[data-point="${point}"]`)) {
      element.classList.add("chosen");
      // What is chosen lies on top.
      if (element.tagName === "g") element.parentNode.append(element);
    }
  }

  function keep(point) {
    kept = kept === point ? null : point;
    for (const row of body.rows) row.setAttribute("aria-selected", String(row.dataset.point === kept));
    show(kept ?? point);
  }

  // The dot nearest to the pointer, within reach of it.
  function nearest(svg, event) {
    const box = svg.getBoundingClientRect();
    const scale = svg.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    let best = null;
    for (const dot of dots(svg)) {
      const distance = Math.hypot(dot.x - x, dot.y - y);
      if (distance < 24 && (!best || distance < best.distance)) best = { distance, point: dot.point };
    }
    // A line, such as a response, is chosen by touching it.
    return best ? best.point : event.target.closest?.("[data-point]")?.dataset.point ?? null;
  }

  // Right and down: the next row of the table as it is sorted now; left and up: the one before.
  function step(by) {
    const rows = [...body.rows];
    const at = rows.findIndex((row) => row.dataset.point === shown);
    const next = at < 0 ? (by > 0 ? 0 : rows.length - 1) : Math.min(Math.max(at + by, 0), rows.length - 1);
    kept = rows[next].dataset.point;
    for (const row of rows) row.setAttribute("aria-selected", String(row.dataset.point === kept));
    show(kept);
    return rows[next];
  }

  function onKey(event) {
    const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (by) {
      const row = step(by);
      if (event.currentTarget.tagName === "TR") row.focus();
      event.preventDefault();
    } else if (event.key === "Escape") {
      kept = null;
      for (const row of body.rows) row.setAttribute("aria-selected", "false");
      show(null);
    } else if (event.key === "Enter" && event.currentTarget.tagName === "TR") {
      keep(event.currentTarget.dataset.point);
    }
  }

  for (const svg of pictures) {
    svg.setAttribute("tabindex", "0");
    svg.addEventListener("pointermove", (event) => { const point = nearest(svg, event); if (point !== null) show(point); });
    svg.addEventListener("pointerleave", () => show(kept));
    svg.addEventListener("click", (event) => { const point = nearest(svg, event); if (point !== null) keep(point); });
    svg.addEventListener("keydown", onKey);
  }
  for (const row of body.rows) {
    row.tabIndex = 0;
    row.setAttribute("aria-selected", "false");
    row.addEventListener("pointerenter", () => show(row.dataset.point));
    row.addEventListener("pointerleave", () => show(kept));
    row.addEventListener("focus", () => show(row.dataset.point));
    row.addEventListener("click", () => keep(row.dataset.point));
    row.addEventListener("keydown", onKey);
  }

  document.querySelector(".hint").hidden = false;
})();
