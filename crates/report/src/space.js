// @ts-check
// Rotates the box of a three-dimensional plot, by dragging or by Shift and the arrow keys. Elements in the box have their
// points as data-space; the plot has azimuth and elevation of the view, scale and centre as data-view.
(() => {
  "use strict";
  /** @type {Record<string, number[]>} */
  const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  /** @type {NodeListOf<SVGSVGElement>} */
  const plots = document.querySelectorAll("svg[data-view]");
  for (const svg of plots) {
    let [azimuth, elevation, scale, x0, y0] = (svg.dataset.view ?? "").split(" ").map(Number);
    /** @type {NodeListOf<SVGElement>} */
    const shapes = svg.querySelectorAll("g[data-space] > path, g[data-space] > text");
    const parts = [...shapes].map((shape) => {
      const numbers = (shape.parentElement?.dataset.space ?? "").split(" ").map(Number);
      const points = [];
      for (let i = 0; i < numbers.length; i += 3) points.push(numbers.slice(i, i + 3));
      return { shape, points };
    });

    /** Parallel projection, as in view.rs. @param {number[]} point */
    function project([x, y, z]) {
      const across = x * Math.cos(azimuth) - y * Math.sin(azimuth);
      const depth = x * Math.sin(azimuth) + y * Math.cos(azimuth);
      const up = z * Math.cos(elevation) + depth * Math.sin(elevation);
      return [x0 + scale * across, y0 - scale * up].map((value) => value.toFixed(1));
    }

    function draw() {
      for (const { shape, points } of parts) {
        const drawn = points.map(project);
        if (shape.tagName === "text") shape.setAttribute("transform", `translate(${drawn[0].join(" ")})`);
        else if (drawn.length === 1) shape.setAttribute("d", `M${drawn[0].join(" ")}h0`);
        else shape.setAttribute("d", `M${drawn.map((point) => point.join(" ")).join("L")}`);
      }
    }

    /** @param {number} sideways @param {number} upwards */
    function rotate(sideways, upwards) {
      azimuth += sideways;
      elevation = Math.min(Math.max(elevation + upwards, 0), Math.PI / 2);
      draw();
    }

    /** @type {PointerEvent | null} */
    let from = null; // last position of the pointer during a drag
    let moved = 0;
    svg.addEventListener("pointerdown", (event) => { from = event; moved = 0; });
    svg.addEventListener("pointermove", (event) => {
      if (!from || event.buttons === 0) return;
      const [across, down] = [event.clientX - from.clientX, event.clientY - from.clientY];
      moved += Math.abs(across) + Math.abs(down);
      from = event;
      rotate(across / 100, down / 100);
    });
    for (const end of /** @type {const} */ (["pointerup", "pointerleave"])) svg.addEventListener(end, () => { from = null; });
    // The end of a drag is not a click.
    svg.addEventListener("click", (event) => { if (moved > 4) event.stopImmediatePropagation(); });
    svg.addEventListener("keydown", (event) => {
      const [across, up] = STEPS[event.key] ?? [0, 0];
      if (!event.shiftKey || (across === 0 && up === 0)) return;
      rotate(0.1 * across, 0.1 * up);
      event.preventDefault();
      event.stopImmediatePropagation();
    });
    svg.classList.add("turns");
  }
})();
