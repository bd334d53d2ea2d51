// Types of what service/web/plots.js uses of service/web/vendor/uplot.

export interface Axis {
  label: string;
  labelFont: string;
  font: string;
  size: number;
  labelSize: number;
  stroke: string;
  splits: (plot: uPlot, axis: number, low: number, high: number) => number[];
  filter: (plot: uPlot, splits: number[]) => number[];
  grid: Lines;
  ticks: Lines;
  values: (plot: uPlot, splits: number[]) => string[];
}

interface Lines {
  stroke: string;
  width: number;
  filter: (plot: uPlot, splits: number[]) => number[];
}

interface Scale {
  time?: boolean;
  /** 3 is logarithmic. */
  distr: 3;
  range: () => [number, number];
}

interface Series {
  stroke?: string;
  width?: number;
  points?: { show: boolean; size: number; fill: string };
}

export interface Options {
  width: number;
  height: number;
  legend: { show: boolean };
  cursor: { drag: { x: boolean; y: boolean } };
  scales: Record<"x" | "y", Scale>;
  axes: Axis[];
  series: Series[];
  hooks: { draw: ((plot: uPlot) => void)[] };
}

export default class uPlot {
  constructor(options: Options, data: number[][], element: HTMLElement);
  readonly ctx: CanvasRenderingContext2D;
  /** The area of the plot in pixels of its canvas. */
  readonly bbox: { left: number; top: number; width: number; height: number };
  readonly width: number;
  valToPos(value: number, scale: "x" | "y", canvasPixels: boolean): number;
  setData(data: number[][]): void;
  setSize(size: { width: number; height: number }): void;
  destroy(): void;
}
