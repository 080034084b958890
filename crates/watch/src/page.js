// @ts-check
/// <reference path="../../report/src/types.d.ts" />
// Shows the latest state of the run. States are received as server-sent events; each is complete, so that some may be missed.
"use strict";

/**
 * State of the run: `json` of state.rs.
 * @typedef {number | null} Value Null if it is not finite.
 * @typedef {object} Criterion
 * @property {string} name
 * @property {string} case
 * @property {string} unit
 * @property {Value} demand
 * @property {boolean} at_least
 * @property {Value} value
 * @property {Value} scaled
 * @property {boolean} met
 * @property {boolean} constraint
 * @typedef {{ name: string, value: Value, unit: string, position: Value }} Tuner
 * @typedef {object} State
 * @property {string} study
 * @property {string} task
 * @property {string} solver
 * @property {number} evaluations
 * @property {number} budget
 * @property {number} failed
 * @property {number} seconds
 * @property {Value} left
 * @property {number} share
 * @property {string | null} stage
 * @property {string | null} trouble
 * @property {string | null} over
 * @property {{ objective: Value, violation: Value, feasible: boolean } | null} best
 * @property {Criterion[] | null} criteria
 * @property {Tuner[] | null} tuners
 * @property {[number, Value, Value, boolean][]} curve
 */

/** @param {string} id */
function at(id) {
  const node = document.getElementById(id);
  if (!node) throw new Error(`the page has no element ${id}`);
  return node;
}

/** @param {string} id @param {string} value */
const text = (id, value) => { if (at(id).textContent !== value) at(id).textContent = value; };

/** Formats a number to `digits` significant digits, without trailing zeros. @param {Value | undefined} value */
function number(value, digits = 5) {
  if (value === null || value === undefined) return "n/a";
  return String(Number(value.toPrecision(digits)));
}

/** Formats a time in s, min or h. @param {Value} seconds */
function time(seconds) {
  if (seconds === null || seconds === undefined) return "unknown";
  if (seconds < 120) return `${number(seconds, seconds < 10 ? 2 : 3)} s`;
  return seconds < 7200 ? `${number(seconds / 60, 3)} min` : `${number(seconds / 3600, 3)} h`;
}

/**
 * Creates an element with attributes and children; text is never parsed as markup.
 * @param {string} name @param {Record<string, string>} attributes @param {(Node | string)[]} children
 */
function element(name, attributes = {}, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

/** @param {Criterion} criterion */
function bar(criterion) {
  const share = Math.min(Math.max(criterion.scaled ?? 0, 0), 2) * 50;
  const tone = criterion.met ? "met" : criterion.constraint ? "missed" : "above";
  const filled = element("span");
  filled.style.width = `${share}%`;
  return element("span", { class: "scaled" },
    element("span", { class: "number" }, number(criterion.scaled, 4)),
    element("span", { class: `bar ${tone}`, "aria-hidden": "true" }, filled));
}

/** @param {Criterion} criterion */
function criterionRow(criterion) {
  const demanded = criterion.demand !== null;
  const demand = demanded ? `${criterion.at_least ? "at least " : ""}${number(criterion.demand)}` : "none";
  const tone = criterion.met ? "met" : criterion.constraint ? "missed" : "above";
  return element("tr", {},
    element("th", { scope: "row" }, criterion.name),
    element("td", {}, criterion.case),
    element("td", { class: "number" }, demand),
    element("td", { class: "number" }, element("strong", {}, number(criterion.value))),
    element("td", {}, criterion.unit),
    element("td", {}, demanded ? bar(criterion) : ""),
    element("td", {}, demanded ? element("span", { class: tone }, criterion.met ? "met" : "not met") : ""));
}

/** @param {Tuner} tuner */
function tunerRow(tuner) {
  const cell = element("td");
  if (tuner.position !== null) {
    const mark = element("span", { class: "at" });
    mark.style.left = `${100 * tuner.position}%`;
    cell.append(element("span", { class: "range", "aria-hidden": "true" }, mark));
  } else {
    cell.append("fixed");
  }
  return element("tr", {},
    element("th", { scope: "row" }, tuner.name),
    element("td", { class: "number" }, element("strong", {}, number(tuner.value))),
    element("td", {}, tuner.unit), cell);
}

/** Returns about `count` round numbers between two ends. @param {number} low @param {number} high @param {number} count */
function ticks(low, high, count) {
  const rough = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) ?? rough;
  const found = [];
  for (let i = Math.ceil(low / step); i * step <= high + 1e-9 * step; i++) found.push(Number((i * step).toPrecision(12)));
  return found;
}

const NS = "http://www.w3.org/2000/svg";

/** Creates an SVG element. @param {string} name @param {Record<string, string | number>} attributes */
function drawn(name, attributes, content = "") {
  const node = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, String(value));
  node.textContent = content;
  return node;
}

/** Draws the best objective as a step curve, in another colour while a constraint is violated. @param {State} state */
function curve(state) {
  /** @type {[number, number, boolean][]} */
  const points = state.curve.flatMap(([n, value, , feasible]) => (value === null ? [] : [[n, value, feasible]]));
  const svg = at("curve");
  if (points.length === 0) return svg.replaceChildren();
  const [left, right, top, bottom] = [64, 626, 12, 262];
  const end = Math.max(state.evaluations, 2);
  const values = points.map((p) => p[1]);
  let [low, high] = [Math.min(...values), Math.max(...values)];
  const log = low > 0 && high / low > 20;
  /** @type {(v: number) => number} */
  const f = log ? Math.log10 : (v) => v;
  const room = (f(high) - f(low)) * 0.06 || Math.abs(f(high)) * 0.1 || 1;
  const [from, to] = [f(low) - room, f(high) + room];
  /** @param {number} n */
  const x = (n) => left + (right - left) * (n - 1) / (end - 1);
  /** @param {number} v */
  const y = (v) => bottom - (bottom - top) * (f(v) - from) / (to - from);
  const parts = [];
  for (const tick of ticks(from, to, 5)) {
    const value = log ? 10 ** tick : tick;
    parts.push(drawn("path", { class: "grid", d: `M${left} ${y(value)}H${right}` }));
    parts.push(drawn("text", { class: "faint", x: left - 6, y: y(value) + 4, "text-anchor": "end" }, number(value, 3)));
  }
  for (const tick of ticks(1, end, 5)) {
    parts.push(drawn("text", { class: "faint", x: x(tick), y: bottom + 18, "text-anchor": "middle" }, String(tick)));
  }
  parts.push(drawn("text", { class: "faint", x: (left + right) / 2, y: bottom + 36, "text-anchor": "middle" }, "evaluations"));
  points.forEach((point, i) => {
    const until = i + 1 < points.length ? points[i + 1] : [end, point[1]];
    const d = `M${x(point[0])} ${y(point[1])}H${x(until[0])}V${y(until[1])}`;
    parts.push(drawn("path", { class: point[2] ? "result" : "measured", d }));
  });
  const last = points[points.length - 1];
  parts.push(drawn("circle", { cx: x(end), cy: y(last[1]), r: 4 }));
  svg.replaceChildren(...parts);
}

/** @param {State} state */
function verdict(state) {
  const best = state.best;
  const [tone, sentence] = !best || best.objective === null
    ? ["mixed", "No point has a value yet"]
    : best.feasible
      ? [best.objective <= 1 || state.task !== "design" ? "good" : "mixed", `Best objective ${number(best.objective, 6)}`]
      : ["bad", `Best objective ${number(best.objective, 6)}, constraint violated by ${number(best.violation, 3)}`];
  const where = state.over !== null ? `. The run is over; result and report.html are in ${state.over}` : "";
  const stage = state.stage ? ` (${state.stage})` : "";
  at("verdict").className = `verdict ${tone}`;
  const trouble = state.trouble ? `. Evaluations cannot be written (${state.trouble}); new ones stay in memory` : "";
  text("verdict", sentence + stage + trouble + where);
}

/** @typedef {{ of: number, plots: PlotData[] }} Responses */

/** @type {{ names: string, group: ReturnType<Window["startPlots"]> } | null} */
let plots = null;

/** Draws the responses of the best point: the first time as new plots, later with new data. @param {Responses} found */
function draw(found) {
  if (found.plots.length === 0) return;
  at("responses-section").hidden = false;
  // A signal is missing while its simulation fails; the plots are then made anew.
  const names = JSON.stringify(found.plots.map((plot) => [plot.title, plot.curves.map((curve) => curve.name)]));
  if (plots?.names === names) {
    plots.group.charts.forEach((chart, i) => chart.update(found.plots[i]));
    return;
  }
  at("responses").replaceChildren(...found.plots.map((plot) => {
    const data = element("script", { type: "application/json" }, JSON.stringify(plot));
    return element("figure", {}, element("div", { class: "chart" }, data));
  }));
  plots = { names, group: window.startPlots(at("responses")) };
}

/** Shows the responses of a new best point. @param {Responses} found */
function responses(found) {
  draw(found);
  at("responses").dataset.shown = String(found.of);
}

/** @param {State} state */
function show(state) {
  document.title = `${state.study}: ${state.over !== null ? "over" : `${Math.round(100 * state.share)} %`}`;
  text("study", state.study);
  text("task", state.task);
  text("solver", state.solver);
  text("evaluations", `${state.evaluations} of ${state.budget}`);
  text("failed", String(state.failed));
  text("seconds", time(state.seconds));
  text("left", state.over !== null ? "none" : time(state.left));
  at("share").setAttribute("value", String(state.over !== null ? 1 : state.share));
  verdict(state);
  if (state.criteria) at("criteria").replaceChildren(...state.criteria.map(criterionRow));
  if (state.tuners) at("tuners").replaceChildren(...state.tuners.map(tunerRow));
  curve(state);
  document.body.dataset.shown = String(state.evaluations);
}

show(JSON.parse(at("now").textContent ?? ""));
const events = new EventSource("events");
let over = false;
/** @type {number | undefined} */
let silence;
events.onmessage = (/** @type {MessageEvent<string>} */ event) => {
  const state = JSON.parse(event.data);
  over = state.over !== null;
  show(state);
};
events.addEventListener("responses", (/** @type {MessageEvent} */ event) => responses(JSON.parse(event.data)));
events.onerror = () => {
  // The stream ends with the run; that of a killed run ends without a last state, which the page reports after a timeout.
  if (over) return events.close();
  clearTimeout(silence);
  silence = setTimeout(() => {
    if (events.readyState !== EventSource.OPEN) {
      at("verdict").className = "verdict mixed";
      text("verdict", "No connection: the run is over or was killed");
    }
  }, 4000);
};
