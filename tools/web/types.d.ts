// Types of documents of the service and of parts of the page, for JSDoc comments in service/web.

// For `h` of service/web/dom.js.

type Listeners = {
  [Type in keyof HTMLElementEventMap as `on${Type}`]?: (event: HTMLElementEventMap[Type]) => unknown;
};

type Skipped = false | null | undefined;

/** What may be set of a field of an element; browsers turn numbers into text. */
type Settable<Value> = Value extends string | DOMTokenList
  ? string | number
  : Value extends number | boolean
    ? Value
    : never;

/** The fields of an element with texts, numbers and truth values, its attributes, and listeners. */
type ElementProperties<Element> = {
  [Name in keyof Element as Settable<Element[Name]> extends never ? never : Name]?:
    Settable<Element[Name]> | Skipped;
} & Listeners & {
    [Name in `aria-${string}` | `data-${string}`]?: string | number | boolean | Skipped;
  } & { role?: string | Skipped; popovertarget?: string; form?: string };

/** The tag of a selector such as `p.soft.small`. */
type TagOf<Selector extends string> = Selector extends `${infer Tag}.${string}`
  ? Tag & keyof HTMLElementTagNameMap
  : Selector & keyof HTMLElementTagNameMap;

type ElementOf<Selector extends string> = HTMLElementTagNameMap[TagOf<Selector>];

/** What the address of a view says: parts of its path, and its query. */
interface ViewParams {
  id: string;
  a: string;
  b: string;
  query: URLSearchParams;
  /** Aborted when the view is left. */
  signal: AbortSignal;
}

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

/** A job at `/v1/jobs/{id}`, as far as the page reads it. */
interface JobDocument {
  id: string;
  name: string | null;
  user: string;
  state: JobState;
  paused: boolean;
  width: number;
  height: number;
  labels: Record<string, string>;
  quality: ResolvedQuality;
  created_at: string;
  started_at: string | null;
  /** Without pauses. */
  run_seconds: number | null;
  finished_at: string | null;
  progress: { done: number; total: number; share: number; remaining_seconds: number | null };
  queue_position: number | null;
  last_seq: number;
  rendering: PixelRectangle[];
  cost: { cpu_seconds: number; predicted_cpu_seconds: number; rays: Record<string, number> };
  error: PredictedNumber | null;
  failure: { message: string } | null;
  /** What is valid, but probably not intended. */
  warnings: ProblemEntry[];
  numerics: Record<"non_finite" | "clamped" | "degenerate_dropped" | "retried", number> | null;
  /** What cannot be read of its record. */
  damage: string | null;
  links: {
    cancel: string;
    pause: string;
    resume: string;
    image_png: string;
    image_npy: string;
    image_exr: string;
    layers: Record<string, string>;
  };
}

/** The last is the page's own: the service no longer has the job. */
type JobState = "queued" | "running" | "succeeded" | "failed" | "cancelled" | "expired" | "deleted";

interface JobListDocument {
  jobs: JobDocument[];
  /** The cursor of older jobs; null if there are none. */
  next: string | null;
  /** How many there are on all pages, where the list was asked to count them. */
  total: number | null;
}

interface WorkerDocument {
  name: string;
  pid: number | null;
  memory_bytes: number | null;
  task: string | null;
  seconds: number;
  jobs: string[];
  users: string[];
}

interface WorkerListDocument {
  server: string;
  workers: WorkerDocument[];
}

interface UserDocument {
  user: string;
  open_jobs: number;
  stored_bytes: number;
  cpu_seconds: number;
  last_used_at: string | null;
}

interface UserListDocument {
  users: UserDocument[];
  next: string | null;
}

/** The request of a job, as it was sent, as far as the page reads it. */
interface JobRequestDocument {
  scene: SceneDocument;
  quality?: QualityDocument | null;
  layers?: string[];
  labels?: Record<string, string>;
}

interface Sampling {
  pattern: string;
  samples: number;
}

interface FixedQuality {
  mode: "fixed";
  antialiasing?: Sampling | null;
  light?: Sampling | null;
  precision?: string;
}

interface TargetQuality {
  mode: "target";
  error: number;
  confidence?: number;
  time_limit?: number | null;
  precision?: string;
}

/** As a request has it. */
type QualityDocument = FixedQuality | TargetQuality;

type ResolvedFixed = FixedQuality & { antialiasing: Sampling; light: Sampling; precision: string };
type ResolvedTarget = TargetQuality & { confidence: number; precision: string };

/** As jobs and offers have it: with what the request leaves to the scene and to the service. */
type ResolvedQuality = ResolvedFixed | ResolvedTarget;

interface PredictedNumber {
  estimate: number;
  low: number;
  high: number;
}

interface OfferDocument {
  quality: ResolvedQuality;
  seconds: PredictedNumber;
  error: PredictedNumber | null;
  error_unknown: string | null;
  rough: string | null;
}

/** The answer of `POST /v1/quotes`, as far as the page reads it. */
interface QuoteDocument {
  asked: OfferDocument | null;
  offers: OfferDocument[];
  for_seconds: OfferDocument | null;
  price: { cpu_seconds: number };
  workers: number;
}

/** A scene on the start page, with what it was opened with. */
interface OpenedScene {
  title: string;
  text: string;
  files: Map<string, Blob | import("../../service/web/assets.js").StoredFile>;
  notice?: string;
  /** Of the gallery. */
  entry?: string;
  quality?: QualityDocument | null;
  labels?: string;
  layers?: boolean;
  layerNames?: string[];
  /** Other fields of the request. */
  more?: Record<string, unknown>;
}

interface PlanStage {
  name: string;
  detail: string;
  share?: number | null;
  pointers: string[];
}

/** The answer of `POST /v1/plans`, as far as the page reads it. */
interface PlanDocument {
  stages: PlanStage[];
  warnings: ProblemEntry[];
  pilot_samples: PlanStage[];
  left_out: { effect: string; reason: string; pointers: string[] }[];
}

interface ConvergencePass {
  seconds: number;
  error: PredictedNumber | null;
}

/** `/v1/jobs/{id}/convergence`, as far as the page reads it. */
interface ConvergenceDocument {
  target_error: number | null;
  passes: ConvergencePass[];
  next_halving: { seconds: { estimate: number; low: number; high: number | null } } | null;
  reason: string | null;
}

/** One of the `errors` of a problem document (RFC 9457). */
interface ProblemEntry {
  pointer: string;
  detail: string;
  code?: string;
  suggestion?: string | null;
  line?: number | null;
  column?: number | null;
}

/** The body of an answer with a status from 400 on. */
interface ProblemDocument {
  title?: string;
  detail?: string | null;
  code?: string | null;
  errors?: ProblemEntry[];
  more?: number;
}

type Triple = [number, number, number];

interface ScenePart {
  pointer: string;
  name: string | null;
}

interface InspectedLight {
  light: number;
  pointer: string;
  visibility: number;
  points: number;
  below_horizon: number;
  blockers: (ScenePart & { shape: number; points: number })[];
  diffuse: Triple;
  specular: Triple;
}

interface InspectedSurface {
  shape: number;
  part: ScenePart;
  primitive: number;
  t: number;
  position: Triple;
  uv: [number, number];
  normal: Triple;
  shading_normal: Triple;
  material: ScenePart;
  texture: ScenePart | null;
  color: Triple;
  ambient: Triple;
  lights: InspectedLight[];
}

interface InspectedRay {
  kind: "camera" | "mirror" | "reflection" | "refraction";
  weight: number;
  origin: Triple;
  direction: Triple;
  surface: InspectedSurface | null;
  light: ScenePart | null;
  radiance: Triple;
  rays: InspectedRay[];
}

/** The answer of `POST /v1/jobs/{id}/inspections`. */
interface InspectionDocument {
  x: number;
  y: number;
  color: Triple;
  reasons: { text: string; pointers: string[] }[];
  ray: InspectedRay;
  complete: boolean;
}

/** A part of the JSON Schema of scenes, as far as the page reads it. */
interface SchemaNode {
  $ref?: string;
  $defs?: Record<string, SchemaNode>;
  oneOf?: SchemaNode[];
  anyOf?: SchemaNode[];
  type?: string;
  const?: string;
  enum?: string[];
  default?: unknown;
  description?: string;
  properties?: Record<string, SchemaNode>;
  additionalProperties?: SchemaNode;
  required?: string[];
  items?: SchemaNode;
  minItems?: number;
  maxItems?: number;
  minimum?: number;
  maximum?: number;
  exclusiveMinimum?: number;
  exclusiveMaximum?: number;
}

interface CameraDocument {
  position: number[];
  look_at: number[];
  up?: number[];
  vertical_fov?: number;
  width?: number;
  height?: number;
  crop?: number[] | null;
}

/** A rectangle, written in one of two ways. */
interface RectangleDocument {
  center: number[];
  normal: number[];
  tangent: number[];
  size: number[];
  corner?: number[];
  edges?: number[][];
}

type ShapeDocument =
  | ({ type: "rectangle" } & RectangleDocument)
  | { type: "triangle"; vertices: number[][] }
  | { type: "ellipsoid"; center: number[]; radius: number; axes?: number[][] }
  | { type: "mesh" };

type LightDocument =
  | { type: "directional"; direction: number[] }
  | { type: "point"; position: number[] }
  | { type: "spot"; position: number[] }
  | ({ type: "area" } & RectangleDocument);

/** A valid scene, as far as the page reads it. */
interface SceneDocument {
  camera: CameraDocument;
  shapes: ShapeDocument[];
  lights: LightDocument[];
  display?: Partial<DisplaySettings>;
}

interface DisplaySettings {
  /** Stops. */
  exposure: number;
  /** A key of `TRANSFERS`. */
  transfer: string;
}

/** The answer of `POST /v1/comparisons`, as far as the page reads it. */
interface ComparisonDocument {
  verdict: "match" | "noisy_match" | "mismatch";
  reason: string;
  metrics: Record<string, number | null>;
  diagnosis: { cause: string; hint: string; rmse_before: number; rmse_after: number }[];
  worst_regions: ComparedRegion[];
  images: { side_by_side: string } | null;
}

interface ComparedRegion extends PixelRectangle {
  share: number;
  rmse: number;
  brightness: number;
  name: string | null;
}

type PictureScreen = import("../../service/web/views/picture/screen.js").Screen;

declare module "@codemirror/lint" {
  // Named by the types of lang-json; the page has no linter.
  type Diagnostic = unknown;
}
