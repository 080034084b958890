// @ts-check
// Selects a point of the front in all plots and in the table. Elements of a point have its number as data-point.
(() => {
  "use strict";
  /** @type {Record<string, number>} */
  const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };
  /** @type {HTMLTableElement | null} */
  const table = document.querySelector("table.front");
  if (!table) return;
  const body = table.tBodies[0];
  /** @type {NodeListOf<SVGSVGElement>} */
  const all = document.querySelectorAll("svg.plot");
  const plots = [...all].filter((svg) => svg.querySelector("[data-point]"));
  /** @type {string | null} */
  let kept = null; // point selected by a click
  /** @type {string | null} */
  let shown = null;

  /** Positions of the dots of a plot, in its own units. @param {SVGSVGElement} svg */
  function dots(svg) {
    /** @type {NodeListOf<SVGElement>} */
    const groups = svg.querySelectorAll("g.dot[data-point]");
    return [...groups].map((g) => {
      const [x, y] = (g.querySelector("path")?.getAttribute("d") ?? "").slice(1).split(/[ h]/).map(Number);
      return { point: g.dataset.point ?? null, x, y };
    });
  }

  /** @param {string | null} point */
  function show(point) {
    if (point === shown) return;
    for (const element of document.querySelectorAll(".chosen")) element.classList.remove("chosen");
    shown = point;
    if (point === null) return;
    for (const element of document.querySelectorAll(`[data-point="${point}"]`)) {
      element.classList.add("chosen");
      // The selected element is drawn on top.
      if (element.tagName === "g") element.parentElement?.append(element);
    }
  }

  /** @param {string | null} point */
  function keep(point) {
    kept = kept === point ? null : point;
    for (const row of body.rows) row.setAttribute("aria-selected", String(row.dataset.point === kept));
    show(kept ?? point);
  }

  /**
   * Returns the point of the dot nearest to the pointer, within 24 units.
   * @param {SVGSVGElement} svg @param {MouseEvent} event
   * @returns {string | null}
   */
  function nearest(svg, event) {
    const box = svg.getBoundingClientRect();
    const scale = svg.viewBox.baseVal.width / box.width;
    const [x, y] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    let best = null;
    for (const dot of dots(svg)) {
      const distance = Math.hypot(dot.x - x, dot.y - y);
      if (distance < 24 && (!best || distance < best.distance)) best = { distance, point: dot.point };
    }
    if (best) return best.point;
    // Lines, such as responses, are selected by hovering.
    const line = event.target instanceof Element ? event.target.closest("[data-point]") : null;
    return line?.getAttribute("data-point") ?? null;
  }

  /** Selects the next (1) or previous (-1) row of the table in its present order. @param {number} by */
  function step(by) {
    const rows = [...body.rows];
    const at = rows.findIndex((row) => row.dataset.point === shown);
    const next = at < 0 ? (by > 0 ? 0 : rows.length - 1) : Math.min(Math.max(at + by, 0), rows.length - 1);
    kept = rows[next].dataset.point ?? null;
    for (const row of rows) row.setAttribute("aria-selected", String(row.dataset.point === kept));
    show(kept);
    return rows[next];
  }

  /** @param {KeyboardEvent} event @param {HTMLTableRowElement} [of] Row that has the focus. */
  function onKey(event, of) {
    const by = STEPS[event.key];
    if (by) {
      const row = step(by);
      if (of) row.focus();
      event.preventDefault();
    } else if (event.key === "Escape") {
      kept = null;
      for (const row of body.rows) row.setAttribute("aria-selected", "false");
      show(null);
    } else if (event.key === "Enter" && of) {
      keep(of.dataset.point ?? null);
    }
  }

  for (const svg of plots) {
    svg.setAttribute("tabindex", "0");
    svg.addEventListener("pointermove", (event) => { const point = nearest(svg, event); if (point !== null) show(point); });
    svg.addEventListener("pointerleave", () => show(kept));
    svg.addEventListener("click", (event) => { const point = nearest(svg, event); if (point !== null) keep(point); });
    svg.addEventListener("keydown", (event) => onKey(event));
  }
  for (const row of body.rows) {
    row.tabIndex = 0;
    row.setAttribute("aria-selected", "false");
    row.addEventListener("pointerenter", () => show(row.dataset.point ?? null));
    row.addEventListener("pointerleave", () => show(kept));
    row.addEventListener("focus", () => show(row.dataset.point ?? null));
    row.addEventListener("click", () => keep(row.dataset.point ?? null));
    row.addEventListener("keydown", (event) => onKey(event, row));
  }

  for (const hint of document.querySelectorAll(".hint")) hint.removeAttribute("hidden");
})();
