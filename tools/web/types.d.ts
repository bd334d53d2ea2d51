// Types of documents of the service and of parts of the page, for JSDoc comments in service/web.

/** A rectangle of pixels, half open, rows from the top. */
interface PixelRectangle {
  x0: number;
  y0: number;
  x1: number;
  y1: number;
}

interface PixelPlace {
  x: number;
  y: number;
}

/** What is said of a job at `/v1/jobs/{id}`, as far as the page reads it. */
interface JobDocument {
  id: string;
  name: string | null;
  state: "queued" | "running" | "succeeded" | "failed" | "cancelled" | "expired" | "deleted";
  width: number;
  height: number;
  created_at: string;
  paused: boolean;
  rendering: PixelRectangle[];
  links: {
    cancel: string;
    pause: string;
    resume: string;
    image_png?: string;
    image_npy?: string;
    image_exr?: string;
    layers?: Record<string, string>;
  };
}

/** The answer of `POST /v1/comparisons`, as far as the page reads it. */
interface ComparisonDocument {
  verdict: "match" | "noisy_match" | "mismatch";
  reason: string;
  metrics: Record<string, number | null>;
  diagnosis: { cause: string; hint: string; rmse_before: number; rmse_after: number }[];
  worst_regions: ComparedRegion[];
}

interface ComparedRegion extends PixelRectangle {
  share: number;
  rmse: number;
  brightness: number;
  name: string | null;
}

/** The screen of a picture, `Screen` in views/picture/screen.js, as its tools use it. */
interface PictureScreen {
  readonly width: number;
  readonly height: number;
  readonly scale: number;
  readonly left: number;
  readonly top: number;
  readonly element: HTMLElement;
  readonly context: CanvasRenderingContext2D;
  readonly life: AbortController;
  /** What is dragged in place of the picture. */
  grip: { holds(place: PixelPlace): boolean; drag(place: PixelPlace): void } | null;
  redraw(): void;
  visible(): PixelRectangle;
  outline(context: CanvasRenderingContext2D, place: PixelRectangle, color?: string, grown?: number): void;
}
