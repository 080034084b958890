// @ts-check
/// <reference path="types.d.ts" />
// Draws plots of curves over x with uPlot, in place of their SVGs: zoom, values at the cursor, curves on and off by name.
// Plots of one group share the names of their curves, and those with the same x axis also cursor and range.
(() => {
  "use strict";
  const SMALL = 520; // width in pixels below which plots are lower
  const NEAR = 24; // distance in pixels at which a curve is highlighted
  const MOST_VALUES = 8; // number of values in the readout

  /** @typedef {CurveData & { owner: string, isLine: boolean, index: (number | undefined)[] }} Curve */

  /** @param {string} name */
  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  /** @param {number} value @param {number} low @param {number} high */
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  /** Functions from values to even distances on an axis, and back. @type {(log: boolean) => ((v: number) => number)[]} */
  const along = (log) => (log ? [Math.log10, (v) => 10 ** v] : [(v) => v, (v) => v]);

  /** Splits a label such as `time (s)` into name and unit. @param {string} label */
  function parts(label) {
    const [, name, unit] = label.match(/^(.*?)(?: \(([^()]*)\))?$/) ?? ["", label];
    return { name, unit: unit ? ` ${unit}` : "" };
  }

  /** Returns the largest index with `xs[index] <= x`; -1 if there is none. @param {number[]} xs @param {number} x */
  function before(xs, x) {
    let [low, high] = [-1, xs.length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (xs[middle] <= x) low = middle; else high = middle;
    }
    return low;
  }

  /**
   * Prepares the curves: strictly increasing x, and each nameless curve with the name of the curve that it belongs to.
   * @param {PlotData} data
   * @returns {Curve[]}
   */
  function prepared(data) {
    const finite = data.curves.flatMap((curve) => [curve.x[0], curve.x[curve.x.length - 1]]).filter(Number.isFinite);
    const size = Math.max(...finite) - Math.min(...finite) || 1;
    let owner = "";
    return data.curves.map((curve) => {
      owner = curve.name || owner;
      const isLine = curve.style === "line" || curve.style === "dashed";
      let order = curve.x.map((_, i) => i);
      if (!isLine) order = order.sort((a, b) => curve.x[a] - curve.x[b]);
      const [x, y] = [order.map((i) => curve.x[i]), order.map((i) => curve.y[i])];
      // Both values of a jump have the same x.
      for (let i = 1; i < x.length; i++) if (x[i] <= x[i - 1]) x[i] = x[i - 1] + 1e-9 * (data.logX ? x[i - 1] : size);
      return { ...curve, owner, isLine, x, y, index: [] };
    });
  }

  /**
   * Value of a curve at x: interpolated for a line, else the sample nearest to x within `reach`; null without one.
   * @param {Curve} curve @param {number} x
   */
  function valueAt(curve, x, reach = 0) {
    const i = before(curve.x, x);
    if (!curve.isLine) {
      const near = [i, i + 1].filter((k) => k >= 0 && k < curve.x.length && Math.abs(curve.x[k] - x) <= reach);
      near.sort((a, b) => Math.abs(curve.x[a] - x) - Math.abs(curve.x[b] - x));
      return near.length ? curve.y[near[0]] : null;
    }
    if (i < 0 || x > curve.x[curve.x.length - 1]) return null;
    if (i === curve.x.length - 1) return curve.y[i];
    const [a, b] = [curve.y[i], curve.y[i + 1]];
    return a === null || b === null ? null : a + ((b - a) * (x - curve.x[i])) / (curve.x[i + 1] - curve.x[i]);
  }

  /**
   * Returns the grid of a logarithmic axis: multiples of powers of ten, or of a step in a range with at most two of them.
   * @param {number} low @param {number} high @param {number} step
   */
  function roundNumbers(low, high, step) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
      for (let k = 1; k < 10; k++) {
        const value = Number(`${k}e${power}`);
        if (value >= low * 0.999999 && value <= high * 1.000001) found.push(value);
      }
    }
    if (found.length > 2) return found;
    const first = Math.ceil(low / step);
    return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
  }

  /**
   * Returns the labels of a logarithmic axis: powers of ten, with 2 and 5 for few decades; all of less than a decade.
   * @param {number[]} values
   */
  function decades(values) {
    const span = Math.log10(values[values.length - 1] / values[0]);
    const shown = span < 0.9 ? null : span < 3 ? [1, 2, 5] : [1];
    const every = Math.ceil(span / 8);
    return values.map((value) => {
      const power = Math.floor(Math.log10(value) + 1e-9);
      const digit = Math.round(value / 10 ** power);
      return !shown || (shown.includes(digit) && power % every === 0) ? number(value, 6) : "";
    });
  }

  class Chart {
    /** @param {HTMLElement} node @param {Group} group */
    constructor(node, group) {
      this.node = node;
      this.group = group;
      /** @type {uPlot | null} */
      this.plot = null;
      this.readout = element("p", { class: "readout" });
      this.place = element("div", { class: "canvas", tabindex: "0", role: "group", "aria-roledescription": "interactive plot" });
      /** @type {PlotData} */
      this.data = JSON.parse(node.querySelector("script")?.textContent ?? "");
      /** @type {Curve[]} */
      this.curves = [];
      /** @type {Pair} Ends of x. */
      this.whole = [0, 1];
      this.load(this.data);
      this.shown = this.whole;
    }

    /** Reads the data of the plot. @param {PlotData} data */
    load(data) {
      this.data = data;
      this.place.setAttribute("aria-label", `${data.title}. ${data.about}`);
      this.curves = prepared(data);
      const ends = this.curves.flatMap((curve) => [curve.x[0], curve.x[curve.x.length - 1]]).concat(data.range ?? []);
      this.whole = [Math.min(...ends), Math.max(...ends)];
      if (this.whole[0] === this.whole[1]) this.whole = [this.whole[0] - 0.5, this.whole[1] + 0.5];
    }

    /** @param {Curve} curve */
    isShown(curve) {
      return !this.group.off.has(curve.owner) && !this.group.offVariants.has(curve.variant);
    }

    /** Returns true if a line or region applies to a curve that is shown. @param {LineData | RegionData} one */
    applies({ of }) {
      return of.length === 0 || of.some((name) => !this.group.off.has(name));
    }

    /** Returns the points where a line starts and ends in the range of x; none outside. @param {LineData} line */
    ends({ x, y: [start, end] }) {
      const [low, high] = this.shown;
      const [from, to] = [x[0] ?? low, x[1] ?? high];
      const inside = [Math.max(from, low), Math.min(to, high)];
      if (start === null || end === null || inside[0] >= inside[1]) return [];
      if (start === end) return inside.map((at) => [at, start]);
      // The line is straight on the drawing.
      const [[f], [g, back]] = [along(this.data.logX), along(this.data.logY)];
      return inside.map((at) => [at, back(g(start) + ((g(end) - g(start)) * (f(at) - f(from))) / (f(to) - f(from)))]);
    }

    /** Creates the plot when it comes into view. */
    create() {
      if (this.plot) return;
      const { data, node } = this;
      this.place.addEventListener("keydown", (event) => this.onKey(event));
      node.append(element("p", { class: "title" }, data.title), this.place, this.readout);
      node.classList.add("live");
      this.plot = new uPlot(this.options(), this.joined(), this.place);
      this.touch(this.plot);
      new ResizeObserver(() => this.resize()).observe(this.place);
      this.show(this.group.ranges.get(data.x) ?? data.window ?? this.whole);
    }

    size() {
      const width = Math.max(this.place.clientWidth, 200);
      const height = width < SMALL ? 240 : this.node.closest(".full") ? 340 : 300;
      return { width, height: this.data.supplement ? 0.6 * height : height };
    }

    resize() {
      const { width, height } = this.size();
      if (this.plot && (width !== this.plot.width || height !== this.plot.height)) this.plot.setSize({ width, height });
    }

    /** Returns common x and the values of each curve there; undefined where a curve has no sample. Values far outside of the
        frame are limited: a canvas cannot draw a path with a coordinate of 1e60. */
    joined() {
      const [low, high] = this.height();
      const far = this.data.logY ? Infinity : 1e3 * (high - low);
      const xs = [...new Set(this.curves.flatMap((curve) => curve.x))].sort((a, b) => a - b);
      const at = new Map(xs.map((x, i) => [x, i]));
      const columns = this.curves.map((curve) => {
        const column = new Array(xs.length);
        curve.index = curve.x.map((x) => at.get(x));
        curve.y.forEach((y, i) => { column[curve.index[i] ?? 0] = y === null ? null : clamp(y, low - far, high + far); });
        return column;
      });
      return [xs, ...columns];
    }

    /** @returns {uPlot.Options} */
    options() {
      const { data } = this;
      const font = "12px system-ui, sans-serif";
      /** @type {(label: string, size: number, log: boolean, more?: Partial<uPlot.Axis>) => uPlot.Axis} */
      const axis = (label, size, log, more) => ({
        label, size, font, labelFont: font, labelSize: 20, stroke: () => color("faint"),
        grid: { stroke: () => color("grid"), width: 1 }, ticks: { show: false },
        values: (plot, splits) => (log ? decades(splits) : splits.map((v) => number(v, 6))), ...more,
        ...(log ? { filter: (plot, splits) => splits, splits: (plot, i, low, high, step) => roundNumbers(low, high, step) } : {}),
      });
      const series = this.curves.map((curve) => {
        const stroke = () => color(curve.color);
        const common = { show: this.isShown(curve), stroke, label: curve.name, pxAlign: 0 };
        return curve.isLine
          ? { ...common, width: curve.color === "start" ? 1.3 : 2, dash: curve.style === "dashed" ? [6, 4] : undefined,
              points: { show: curve.x.length === 1 } }
          : { ...common, paths: () => null, points: { show: true, size: curve.x.length < 60 ? 6 : 4, stroke, fill: stroke, width: 0 } };
      });
      const lines = this.curves.filter((curve) => curve.isLine).length;
      return {
        ...this.size(), legend: { show: false }, padding: [8, 28, 0, 0],
        scales: {
          x: { time: false, distr: data.logX ? 3 : 1, range: (plot, low, high) => [low, high] },
          y: { distr: data.logY ? 3 : 1, range: () => this.height() },
        },
        axes: [axis(data.x, 30, data.logX), axis(data.y, 64, data.logY, data.steps ? { incrs: data.steps } : {})],
        series: [{}, ...series],
        focus: { alpha: 0.35 },
        cursor: {
          y: false, drag: { x: true, y: false, setScale: false }, focus: { prox: lines > 2 ? NEAR : -1 },
          dataIdx: (plot, s, at, x) => (s === 0 ? at : this.nearest(this.curves[s - 1], x)),
          points: { size: 7 },
          bind: { dblclick: () => () => { this.group.show(data.x, this.whole); return null; } },
        },
        hooks: {
          drawClear: [(plot) => this.regions(plot)],
          draw: [(plot) => this.lines(plot)],
          setSelect: [(plot) => this.selected(plot)],
          setCursor: [(plot) => this.pointed(plot)],
        },
      };
    }

    /** Returns the index in the common x of the sample of a curve nearest to x. @param {Curve} curve @param {number} x */
    nearest(curve, x) {
      const i = before(curve.x, x);
      const near = [i, i + 1].filter((k) => k >= 0 && k < curve.x.length);
      near.sort((a, b) => Math.abs(curve.x[a] - x) - Math.abs(curve.x[b] - x));
      return near.length ? curve.index[near[0]] ?? null : null;
    }

    /**
     * Returns the range of y in the range of x. Curves that may leave, and levels, widen it at most to three times.
     * @returns {Pair}
     */
    height() {
      const { data, shown: [from, to] } = this;
      const [f, back] = along(data.logY);
      /** @param {boolean} mayLeave */
      const values = (mayLeave) => this.curves.filter((c) => c.mayLeave === mayLeave && this.isShown(c)).flatMap((curve) => {
        const inside = curve.y.slice(before(curve.x, from) + 1, before(curve.x, to) + 1);
        return curve.isLine ? inside.concat(valueAt(curve, from), valueAt(curve, to)) : inside;
      }).filter((v) => v !== null).map(f).filter(Number.isFinite);
      /** @param {number[]} all */
      const ends = (all) => all.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
      // A region between two values, such as a band, is in the range.
      const between = data.regions.map(({ lower, upper }) => [...lower, ...upper].filter((v) => v !== null));
      let [low, high] = ends(values(false).concat(between.filter((all) => all.length === 4).flat().map(f)));
      if (low > high) [low, high] = ends(values(true));
      if (low > high) return data.logY ? [1, 10] : [0, 1];
      const size = Math.max(Math.abs(low), Math.abs(high));
      if (high - low <= 1e-9 * size) [low, high] = [low - (0.1 * size || 1), high + (0.1 * size || 1)];
      const room = high - low;
      let range = [low, high];
      for (const v of values(true)) range = [Math.min(range[0], Math.max(v, low - room)), Math.max(range[1], Math.min(v, high + room))];
      for (const v of data.lines.filter((line) => this.applies(line)).flatMap((line) => this.ends(line)).map((end) => f(end[1]))) {
        if (v >= low - room && v <= high + room) range = [Math.min(range[0], v), Math.max(range[1], v)];
      }
      const margin = 0.05 * (range[1] - range[0]);
      return [back(range[0] - margin), back(range[1] + margin)];
    }

    /**
     * Calls a function with the context, clipped to the frame, and the positions of values.
     * @typedef {(value: number | null, edge: number) => number} Position Place of a value, or of an edge if it is null.
     * @param {uPlot} plot @param {(ctx: CanvasRenderingContext2D, x: Position, y: Position, box: uPlot.Box) => void} paint
     */
    painting(plot, paint) {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      /** @type {Position} */
      const x = (value, edge) => (value === null ? edge : plot.valToPos(value, "x", true));
      /** @type {Position} */
      const y = (value, edge) => (value === null ? edge : plot.valToPos(value, "y", true));
      paint(ctx, x, y, bbox);
      ctx.restore();
    }

    /** Draws the regions behind the curves. @param {uPlot} plot */
    regions(plot) {
      const owners = this.curves.filter((curve) => this.isShown(curve)).map((curve) => curve.owner);
      // A region for some of the curves would cover the others.
      const covers = (/** @type {RegionData} */ { of }) => of.length > 0 && owners.some((name) => !of.includes(name));
      this.painting(plot, (ctx, x, y, box) => {
        const [top, right, bottom] = [box.top, box.left + box.width, box.top + box.height];
        for (const region of this.data.regions) {
          if (!this.applies(region) || covers(region)) continue;
          const [a, b] = [x(region.x[0], box.left), x(region.x[1], right)];
          const [lower, upper] = [region.lower.map((v) => y(v, bottom)), region.upper.map((v) => y(v, top))];
          ctx.fillStyle = color(region.color);
          ctx.beginPath();
          for (const [px, py] of [[a, upper[0]], [b, upper[1]], [b, lower[1]], [a, lower[0]]]) ctx.lineTo(px, py);
          ctx.fill();
        }
      });
    }

    /** Draws the lines beside the curves, with their names. @param {uPlot} plot */
    lines(plot) {
      this.painting(plot, (ctx, x, y, box) => {
        const [top, right, bottom] = [box.top, box.left + box.width, box.top + box.height];
        const scale = window.devicePixelRatio;
        ctx.font = `${11 * scale}px system-ui, sans-serif`;
        ctx.lineWidth = 1.2 * scale;
        const named = new Set();
        /** @type {number[]} */
        const taken = [];
        for (const line of this.data.lines) {
          const isVertical = line.y[0] === null;
          const ends = isVertical
            ? [[x(line.x[0], right), top], [x(line.x[1], right), bottom]]
            : this.ends(line).map(([px, py]) => [x(px, right), y(py, bottom)]);
          if (!this.applies(line) || ends.length === 0) continue;
          const [[ax, ay], [bx, by]] = ends;
          ctx.strokeStyle = color(line.color);
          ctx.setLineDash(line.dashed ? [6 * scale, 4 * scale] : []);
          ctx.beginPath();
          ctx.moveTo(ax, ay);
          ctx.lineTo(bx, by);
          ctx.stroke();
          ctx.fillStyle = color(line.nameColor);
          const label = `${line.name} ${by.toFixed(0)}`;
          if (isVertical) {
            ctx.textAlign = bx > right - 120 * scale ? "right" : "left";
            ctx.fillText(line.name, bx + (ctx.textAlign === "left" ? 4 : -4) * scale, top + 14 * scale);
          } else if (line.name && !named.has(label) && Math.max(ay, by) >= top && Math.min(ay, by) <= bottom) {
            let at = clamp(by - 4 * scale, top + 12 * scale, bottom - 4 * scale);
            while (taken.some((other) => Math.abs(other - at) < 12 * scale)) at += 12 * scale;
            taken.push(at);
            ctx.textAlign = "right";
            ctx.fillText(line.name, bx - 4 * scale, at);
          }
          named.add(label);
        }
      });
    }

    /** Shows a range of x in this plot. @param {Pair} range */
    show(range) {
      this.shown = range;
      this.plot?.setScale("x", { min: range[0], max: range[1] });
      this.tell();
    }

    /** Zooms to a part selected by dragging. @param {uPlot} plot */
    selected(plot) {
      const { left, width } = plot.select;
      if (width < 3) return;
      const [from, to] = [left, left + width].map((at) => plot.posToVal(at, "x"));
      plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      this.range([from, to]);
    }

    /** After a move of the cursor. @param {uPlot} plot */
    pointed(plot) {
      const { left } = plot.cursor;
      if (!this.group.quiet) {
        const x = left >= 0 ? plot.posToVal(left, "x") : null;
        this.group.point(this.data.x, x, this);
      }
      this.tell();
    }

    /** Writes the values at the cursor, or the range. */
    tell() {
      if (!this.plot) return;
      const { plot, data } = this;
      const { left, top } = plot.cursor;
      const [min, max] = this.shown;
      const { name, unit } = parts(data.x);
      if (left === null || left === undefined || left < 0) {
        const whole = this.isWhole() ? "" : ` of ${number(this.whole[0], 4)} to ${number(this.whole[1], 4)}`;
        this.readout.replaceChildren(`${name} ${number(min, 4)} to ${number(max, 4)}${whole}${unit}`);
        return;
      }
      const x = plot.posToVal(left, "x");
      const reach = Math.abs(plot.posToVal(left + 6, "x") - x);
      /** @typedef {{ curve: Curve, value: number }} Reading */
      let values = this.curves.filter((curve) => curve.name && this.isShown(curve)).flatMap((curve) => {
        const value = valueAt(curve, x, reach);
        return value === null ? [] : [{ curve, value }];
      });
      if (values.length > MOST_VALUES) {
        /** @param {Reading} reading */
        const far = ({ value }) => Math.abs(plot.valToPos(value, "y") - top);
        values = values.sort((a, b) => far(a) - far(b)).slice(0, MOST_VALUES);
      }
      /** @param {Reading} reading */
      const of = ({ curve, value }) => {
        const swatch = element("span", { class: "swatch" });
        swatch.style.background = color(curve.color);
        const variant = curve.variant && curve.style === "dashed" ? `, ${curve.variant}` : "";
        return element("span", { class: "value" }, swatch, ` ${curve.name}${variant} `, element("b", {}, number(value)));
      };
      const head = element("span", { class: "value" }, `${name} `, element("b", {}, `${number(x)}${unit}`));
      this.readout.replaceChildren(head, ...values.map(of));
    }

    isWhole() {
      const [min, max] = this.shown;
      const slack = 1e-6 * (this.whole[1] - this.whole[0]);
      return min <= this.whole[0] + slack && max >= this.whole[1] - slack;
    }

    /** Zooms by a factor about the cursor, or about the middle. @param {number} factor */
    zoom(factor) {
      if (!this.plot) return;
      const [min, max] = this.shown;
      const [f, back] = along(this.data.logX);
      const { left } = this.plot.cursor;
      const [a, b] = [f(min), f(max)];
      const about = left >= 0 ? f(this.plot.posToVal(left, "x")) : (a + b) / 2;
      this.range([back(about - (about - a) * factor), back(about + (b - about) * factor)]);
    }

    /** Shows a range of x, at most the whole. @param {Pair} range */
    range([from, to]) {
      this.group.show(this.data.x, [Math.max(from, this.whole[0]), Math.min(to, this.whole[1])]);
    }

    /** Moves the cursor by a share of the width; beyond an end the range moves along. @param {number} share */
    step(share) {
      const { plot } = this;
      if (!plot) return;
      const width = plot.over.clientWidth;
      const { left } = plot.cursor;
      let next = (left >= 0 ? left : width / 2) + share * width;
      if (next < 0 || next > width) {
        const [min, max] = this.shown;
        const [f, back] = along(this.data.logX);
        const [low, high] = [f(this.whole[0]), f(this.whole[1])];
        const move = clamp(Math.sign(share) * 0.25 * (f(max) - f(min)), low - f(min), high - f(max));
        this.group.show(this.data.x, [back(f(min) + move), back(f(max) + move)]);
        next = clamp(next, 0, width);
      }
      plot.setCursor({ left: next, top: plot.over.clientHeight / 2 });
    }

    /** @param {KeyboardEvent} event */
    onKey(event) {
      const { plot } = this;
      if (!plot || event.ctrlKey || event.metaKey || event.altKey) return;
      const fast = event.shiftKey ? 10 : 1;
      /** @type {Record<string, () => void>} */
      const acts = {
        ArrowLeft: () => this.step(-0.01 * fast), ArrowRight: () => this.step(0.01 * fast),
        Home: () => plot.setCursor({ left: 0, top: 0 }), End: () => plot.setCursor({ left: plot.over.clientWidth, top: 0 }),
        "+": () => this.zoom(0.5), "=": () => this.zoom(0.5), "-": () => this.zoom(2), _: () => this.zoom(2),
        0: () => this.group.show(this.data.x, this.whole),
        Escape: () => plot.setCursor({ left: -10, top: -10 }),
      };
      const act = acts[event.key];
      if (!act) return;
      // Values at a cursor moved by keys are announced.
      this.readout.setAttribute("aria-live", "polite");
      act();
      event.preventDefault();
    }

    /** One finger moves the cursor, two fingers zoom and shift. @param {uPlot} plot */
    touch(plot) {
      /** @type {Map<number, { left: number, x: number }>} */
      const fingers = new Map();
      /** @param {PointerEvent} event */
      const at = (event) => event.clientX - plot.over.getBoundingClientRect().left;
      plot.over.addEventListener("pointerdown", (event) => {
        if (event.pointerType === "touch") fingers.set(event.pointerId, { left: at(event), x: plot.posToVal(at(event), "x") });
      });
      plot.over.addEventListener("pointermove", (event) => {
        const finger = fingers.get(event.pointerId);
        if (!finger) return;
        finger.left = at(event);
        if (fingers.size === 1) plot.setCursor({ left: clamp(finger.left, 0, plot.over.clientWidth), top: 0 });
        if (fingers.size !== 2) return;
        // The values that were first under the fingers stay there.
        const [f, back] = along(this.data.logX);
        const [p, q] = [...fingers.values()];
        if (Math.abs(q.left - p.left) < 20) return;
        const slope = (f(q.x) - f(p.x)) / (q.left - p.left);
        if (slope > 0) this.range([back(f(p.x) - slope * p.left), back(f(p.x) + slope * (plot.over.clientWidth - p.left))]);
      });
      for (const kind of /** @type {const} */ (["pointerup", "pointercancel", "pointerleave"])) {
        plot.over.addEventListener(kind, (event) => fingers.delete(event.pointerId));
      }
    }

    /**
     * Replaces the data, with as many curves as before, such as during a run. The range stays unless it was the whole.
     * @param {PlotData} data
     */
    update(data) {
      const whole = !this.plot || this.isWhole();
      this.load(data);
      if (!this.plot) return;
      // A range that grows is not announced.
      this.readout.removeAttribute("aria-live");
      this.plot.setData(this.joined(), false);
      this.show(whole ? this.whole : this.shown);
    }

    refresh() {
      const { plot } = this;
      if (!plot) return;
      this.curves.forEach((curve, i) => {
        const show = this.isShown(curve);
        if (plot.series[i + 1].show !== show) plot.setSeries(i + 1, { show });
      });
      this.tell();
    }
  }

  /** Creates a button. @param {string} text @param {string} label @param {() => void} act */
  function action(text, label, act) {
    const button = element("button", { type: "button", "aria-label": label }, text);
    button.addEventListener("click", act);
    return button;
  }

  /** Plots of a group, with the names and ranges that they share. */
  class Group {
    /** @param {HTMLElement} node */
    constructor(node) {
      this.node = node;
      /** @type {Set<string>} */
      this.off = new Set();
      /** @type {Set<string>} */
      this.offVariants = new Set();
      /** @type {Map<string, Pair>} */
      this.ranges = new Map();
      this.quiet = false;
      /** @type {NodeListOf<HTMLElement>} */
      const places = node.querySelectorAll(".chart");
      this.charts = [...places].map((one) => new Chart(one, this));
      for (const curve of this.curves()) if (curve.hidden) this.offVariants.add(curve.variant);
      this.extent = action("show all", "Switch between the transient and the whole range", () => this.toggleRange());
      this.bar = this.toolbar();
      this.node.prepend(this.bar);
    }

    curves() {
      return this.charts.flatMap((chart) => chart.curves);
    }

    /** Calls a function without passing its changes on to the other plots. @param {() => void} act */
    quietly(act) {
      const before = this.quiet;
      this.quiet = true;
      act();
      this.quiet = before;
    }

    /** Shows a range of x in all plots with this axis. @param {string} label @param {Pair} range */
    show(label, range) {
      if (!(range[1] > range[0])) return;
      this.ranges.set(label, range);
      for (const chart of this.charts) if (chart.plot && chart.data.x === label) chart.show(range);
      this.name();
    }

    /** Moves the cursors of all plots with this axis to x. @param {string} label @param {number | null} x @param {Chart} source */
    point(label, x, source) {
      this.quietly(() => {
        for (const chart of this.charts) {
          if (chart === source || !chart.plot || chart.data.x !== label) continue;
          chart.plot.setCursor({ left: x === null ? -10 : chart.plot.valToPos(x, "x"), top: -10 });
        }
      });
    }

    /** Writes on the button of the range what it shows next. */
    name() {
      const first = this.charts.find((chart) => chart.plot);
      if (!first) return;
      this.extent.textContent = first.isWhole() && first.data.window ? "show the transient" : "show all";
      this.extent.disabled = first.isWhole() && !first.data.window;
    }

    /** Switches between the first range and the whole, in all plots. */
    toggleRange() {
      const first = this.charts.find((chart) => chart.plot);
      if (!first) return;
      const whole = first.isWhole();
      const firsts = new Map(this.charts.map((chart) => /** @type {const} */ ([chart.data.x, chart])).reverse());
      for (const [label, chart] of firsts) {
        this.show(label, whole && chart.data.window ? chart.data.window : chart.whole);
      }
    }

    /** @param {number} factor */
    zoom(factor) {
      const seen = new Set();
      for (const chart of this.charts) {
        if (!chart.plot || seen.has(chart.data.x)) continue;
        seen.add(chart.data.x);
        chart.zoom(factor);
      }
    }

    toolbar() {
      const bar = element("div", { class: "toolbar", role: "toolbar", "aria-label": "Curves and range" });
      const variants = new Set(this.curves().map((curve) => curve.variant).filter((name) => name));
      /** @type {Map<string, Curve>} */
      const firsts = new Map();
      for (const curve of this.curves()) {
        const known = firsts.get(curve.owner);
        // The swatch is that of a line at the reported point.
        if (curve.owner && (!known || (known.style === "dashed" && curve.style !== "dashed" && curve.variant))) firsts.set(curve.owner, curve);
      }
      /** @param {string} name @param {Set<string>} set @param {{ style: string, color: string }} curve */
      const chip = (name, set, curve) => {
        const swatch = element("span", { class: `swatch ${curve.style}` });
        swatch.style.setProperty("--tone", `var(--${curve.color})`);
        const button = element("button", { type: "button", class: "chip", "aria-pressed": String(!set.has(name)) }, swatch, name);
        button.addEventListener("click", (event) => {
          if (event.shiftKey && set === this.off) this.only(name);
          else {
            if (set.has(name)) set.delete(name); else set.add(name);
            button.setAttribute("aria-pressed", String(!set.has(name)));
          }
          for (const chart of this.charts) chart.refresh();
        });
        button.dataset.name = name;
        return button;
      };
      const names = [...firsts].map(([name, curve]) => chip(name, this.off, curve));
      bar.append(...names);
      if (names.length > 6) {
        const all = element("button", { type: "button" }, "all or none");
        all.addEventListener("click", () => {
          const none = this.off.size === 0;
          for (const button of names) {
            const name = button.dataset.name ?? "";
            if (none) this.off.add(name); else this.off.delete(name);
            button.setAttribute("aria-pressed", String(!none));
          }
          for (const chart of this.charts) chart.refresh();
        });
        bar.append(all);
      }
      if (variants.size > 1) {
        for (const name of variants) {
          const style = this.curves().find((one) => one.variant === name)?.style ?? "line";
          bar.append(chip(name, this.offVariants, { style, color: "faint" }));
        }
      }
      /** @type {NodeListOf<HTMLElement>} */
      const figures = this.node.querySelectorAll("figure[data-signal]");
      const request = [...figures];
      if (request.length) {
        const select = element("select", { "aria-label": "Show another signal" }, element("option", { value: "" }, "other signals"));
        for (const { dataset: { signal = "" } } of request) select.append(element("option", { value: signal }, signal));
        select.addEventListener("change", () => {
          const figure = request.find((one) => one.dataset.signal === select.value);
          if (figure) {
            figure.hidden = false;
            bar.after(figure);
            for (const chart of this.charts) if (figure.contains(chart.node)) chart.create();
            select.querySelector(`option[value="${CSS.escape(select.value)}"]`)?.remove();
          }
          select.value = "";
        });
        bar.append(select);
      }
      const range = element("span", { class: "range-buttons" }, action("\u2212", "Zoom out", () => this.zoom(2)), action("+", "Zoom in", () => this.zoom(0.5)), this.extent);
      bar.append(range);
      return bar;
    }

    /** Shows one curve only. @param {string} name */
    only(name) {
      /** @type {NodeListOf<HTMLElement>} */
      const chips = this.bar.querySelectorAll(".chip");
      for (const button of chips) {
        const of = button.dataset.name ?? "";
        if (!this.curves().some((curve) => curve.owner === of)) continue;
        const on = of === name;
        if (on) this.off.delete(name); else this.off.add(of);
        button.setAttribute("aria-pressed", String(on));
      }
    }
  }

  /** @type {Chart[]} */
  let charts = [];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      const chart = charts.find((one) => one.node === entry.target);
      chart?.create();
      chart?.group.name();
      seen.unobserve(entry.target);
    }
  }, { rootMargin: "600px" });

  /** Starts the plots of an element; each is drawn when it comes into view. @param {HTMLElement} node */
  function start(node) {
    const group = new Group(node);
    // Plots that were replaced are not drawn any more.
    charts = charts.filter((chart) => chart.node.isConnected);
    for (const chart of group.charts) {
      charts.push(chart);
      seen.observe(chart.node);
    }
    return group;
  }

  /** @type {NodeListOf<HTMLElement>} */
  const groups = document.querySelectorAll(".figures");
  for (const node of groups) if (node.querySelector(".chart")) start(node);
  window.startPlots = start;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    for (const chart of charts) chart.plot?.redraw(false);
  });
})();
