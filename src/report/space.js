// Turns the box of a plot over three quantities, by dragging or by Shift and the arrow keys. What has places in the box
// carries them as data-space; the plot carries turn and height of the eye, scale and middle as data-view.
(() => {
  "use strict";
  for (const svg of document.querySelectorAll("svg[data-view]")) {
    let [turn, height, scale, x0, y0] = svg.dataset.view.split(" ").map(Number);
    const parts = [...svg.querySelectorAll("g[data-space]")].map((g) => {
      const numbers = g.dataset.space.split(" ").map(Number);
      const places = [];
      for (let i = 0; i < numbers.length; i += 3) places.push(numbers.slice(i, i + 3));
      return { shape: g.querySelector("path, text"), places };
    });

    // As the drawing was made: parallel projection.
    function project([x, y, z]) {
      const across = x * Math.cos(turn) - y * Math.sin(turn);
      const depth = x * Math.sin(turn) + y * Math.cos(turn);
      const up = z * Math.cos(height) + depth * Math.sin(height);
      return [x0 + scale * across, y0 - scale * up].map((value) => value.toFixed(1));
    }

    function draw() {
      for (const { shape, places } of parts) {
        const points = places.map(project);
        if (shape.tagName === "text") shape.setAttribute("transform", `translate(${points[0].join(" ")})`);
        else if (points.length === 1) shape.setAttribute("d", `M${points[0].join(" ")}h0`);
        else shape.setAttribute("d", `M${points.map((point) => point.join(" ")).join("L")}`);
      }
    }

    function turnBy(sideways, upwards) {
      turn += sideways;
      height = Math.min(Math.max(height + upwards, 0), Math.PI / 2);
      draw();
    }

    let from = null; // where the pointer was last while it drags
    let moved = 0;
    svg.addEventListener("pointerdown", (event) => { from = event; moved = 0; });
    svg.addEventListener("pointermove", (event) => {
      if (!from || event.buttons === 0) return;
      const [across, down] = [event.clientX - from.clientX, event.clientY - from.clientY];
      moved += Math.abs(across) + Math.abs(down);
      from = event;
      turnBy(across / 100, down / 100);
    });
    for (const end of ["pointerup", "pointerleave"]) svg.addEventListener(end, () => { from = null; });
    // The end of a drag is no click.
    svg.addEventListener("click", (event) => { if (moved > 4) event.stopImmediatePropagation(); });
    svg.addEventListener("keydown", (event) => {
      const [across, up] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] ?? [0, 0];
      if (!event.shiftKey || (across === 0 && up === 0)) return;
      turnBy(0.1 * across, 0.1 * up);
      event.preventDefault();
      event.stopImmediatePropagation();
    });
    svg.classList.add("turns");
  }
})();
