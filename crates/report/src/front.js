// Selects a point of the front in all plots and in the table. Elements of a point have its number as data-point.
(() => {
  "use strict";
  const table = document.querySelector("table.front");
  if (!table) return;
  const body = table.tBodies[0];
  const plots = [...document.querySelectorAll("svg.plot")].filter((svg) => svg.querySelector("[data-point]"));
  let kept = null; // point selected by a click
  let shown = null;

  // Positions of the dots of a plot, in its own units.
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
      // The selected element is drawn on top.
      if (element.tagName === "g") element.parentNode.append(element);
    }
  }

  function keep(point) {
    kept = kept === point ? null : point;
    for (const row of body.rows) row.setAttribute("aria-selected", String(row.dataset.point === kept));
    show(kept ?? point);
  }

  // Dot nearest to the pointer, within 24 units.
  function nearest(svg, event) {
    const box = svg.getBoundingClientRect();
    const scale = svg.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    let best = null;
    for (const dot of dots(svg)) {
      const distance = Math.hypot(dot.x - x, dot.y - y);
      if (distance < 24 && (!best || distance < best.distance)) best = { distance, point: dot.point };
    }
    // Lines, such as responses, are selected by hovering.
    return best ? best.point : event.target.closest?.("[data-point]")?.dataset.point ?? null;
  }

  // Selects the next (right, down) or previous (left, up) row of the table in its present order.
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

  for (const svg of plots) {
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

  for (const hint of document.querySelectorAll(".hint")) hint.hidden = false;
})();
