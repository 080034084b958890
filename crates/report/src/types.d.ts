// Types of the scripts: data that Rust writes into pages, the part of uPlot 1.6 that is used, and what scripts offer to others.
// The check: tsc --noEmit --allowJs --checkJs --strict --target es2022 --lib es2022,dom with all scripts of ours.
/// <reference lib="dom.iterable" />

type Pair = [number, number];

/** Curve of a plot: `curve` of chart.rs. */
interface CurveData {
  name: string;
  variant: string;
  style: "line" | "dashed" | "dots" | "crosses";
  color: string;
  hidden: boolean;
  mayLeave: boolean;
  x: number[];
  y: (number | null)[];
}

/** Coordinates of two points; `null` is the edge of the frame. */
type Ends = [number | null, number | null];

/** Line beside the curves, and the names of the curves that it applies to, empty for all: `Line` of overlay.rs. */
interface LineData {
  name: string;
  x: Ends;
  y: Ends;
  color: string;
  nameColor: string;
  dashed: boolean;
  of: string[];
}

/** Region behind the curves: `Region` of overlay.rs. */
interface RegionData {
  x: Ends;
  lower: Ends;
  upper: Ends;
  color: string;
  of: string[];
}

/** Interactive plot: `data` of chart.rs. */
interface PlotData {
  title: string;
  about: string;
  x: string;
  y: string;
  logX: boolean;
  logY: boolean;
  steps: number[] | null;
  supplement: boolean;
  range: Pair | null;
  window: Pair | null;
  curves: CurveData[];
  lines: LineData[];
  regions: RegionData[];
}

declare namespace uPlot {
  interface Axis {
    label: string;
    size: number;
    font: string;
    labelFont: string;
    labelSize: number;
    stroke: () => string;
    grid: { stroke: () => string; width: number };
    ticks: { show: boolean };
    values: (plot: uPlot, splits: number[]) => string[];
    splits?: (plot: uPlot, axis: number, low: number, high: number, step: number) => number[];
    filter?: (plot: uPlot, splits: number[]) => number[];
    incrs?: number[];
  }
  interface Series {
    show?: boolean;
    label?: string;
    stroke?: () => string;
    fill?: () => string;
    width?: number;
    dash?: number[];
    pxAlign?: number;
    paths?: () => null;
    points?: { show?: boolean; size?: number; stroke?: () => string; fill?: () => string; width?: number };
  }
  interface Scale {
    time?: boolean;
    distr: number;
    range: (plot: uPlot, low: number, high: number) => Pair;
  }
  interface Options {
    width: number;
    height: number;
    legend: { show: boolean };
    padding: number[];
    scales: { x: Scale; y: Scale };
    axes: Axis[];
    series: Series[];
    focus: { alpha: number };
    cursor: {
      y: boolean;
      drag: { x: boolean; y: boolean; setScale: boolean };
      focus: { prox: number };
      dataIdx: (plot: uPlot, series: number, at: number, x: number) => number | null;
      points: { size: number };
      bind: { dblclick: () => () => null };
    };
    hooks: Record<"drawClear" | "draw" | "setSelect" | "setCursor", ((plot: uPlot) => void)[]>;
  }
  interface Box {
    left: number;
    top: number;
    width: number;
    height: number;
  }
}

declare class uPlot {
  constructor(options: uPlot.Options, data: (number | null | undefined)[][], place: HTMLElement);
  readonly width: number;
  readonly height: number;
  readonly ctx: CanvasRenderingContext2D;
  readonly bbox: uPlot.Box;
  readonly over: HTMLElement;
  readonly cursor: { left: number; top: number };
  readonly select: uPlot.Box;
  readonly series: uPlot.Series[];
  posToVal(position: number, scale: "x" | "y"): number;
  valToPos(value: number, scale: "x" | "y", ofCanvas?: boolean): number;
  redraw(paths: boolean): void;
  setCursor(place: { left: number; top: number }): void;
  setData(data: (number | null | undefined)[][], rescale: boolean): void;
  setScale(scale: "x" | "y", range: { min: number; max: number }): void;
  setSelect(box: uPlot.Box, notify: boolean): void;
  setSeries(index: number, options: { show: boolean }): void;
  setSize(size: { width: number; height: number }): void;
}

interface Window {
  /** Starts the plots of an element; each is drawn when it comes into view. */
  startPlots(node: HTMLElement): { charts: { update(data: PlotData): void }[] };
}
