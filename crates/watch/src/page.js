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
 * @property {PlotData[]} convergence
 */

/** @param {string} id */
function at(id) {
  const node = document.getElementById(id);
  if (!node) throw new Error(`the page has no element ${id}`);
  return node;
}

/** @param {string} id @param {string} value */
const text = (id, value) => { if (at(id).textContent !== value) at(id).textContent = value; };

/** Formats a time in s, min or h. @param {Value} seconds */
function time(seconds) {
  if (seconds === null || seconds === undefined) return "unknown";
  if (seconds < 120) return `${number(seconds, seconds < 10 ? 2 : 3)} s`;
  return seconds < 7200 ? `${number(seconds / 60, 3)} min` : `${number(seconds / 3600, 3)} h`;
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

/** @type {Map<string, { key: string, group: ReturnType<Window["startPlots"]> }>} */
const drawn = new Map();

/**
 * Draws plots in the element of this name: as new plots if axes or curves differ from those drawn, else with new data.
 * @param {string} id @param {PlotData[]} plots
 */
function draw(id, plots) {
  if (plots.length === 0) return;
  // A signal is missing while its simulation fails, and a curve as long as it has no point.
  const key = JSON.stringify(plots.map((plot) => [plot.title, plot.y, plot.logY, plot.curves.map((curve) => curve.name)]));
  const known = drawn.get(id);
  if (known?.key === key) {
    known.group.charts.forEach((chart, i) => chart.update(plots[i]));
    return;
  }
  at(id).parentElement?.removeAttribute("hidden");
  at(id).replaceChildren(...plots.map((plot) => {
    const data = element("script", { type: "application/json" }, JSON.stringify(plot));
    return element("figure", {}, element("div", { class: "chart" }, data));
  }));
  drawn.set(id, { key, group: window.startPlots(at(id)) });
}

/** Shows the responses of a new best point. @param {Responses} found */
function responses(found) {
  draw("responses", found.plots);
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
  draw("convergence", state.convergence);
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
