// The router: one view at a time in <main>, chosen by the path.

import { announce, h, ofPage } from "./dom.js";
import { acceptDrops } from "./drop.js";
import { AMENDED, MOVED, navigate } from "./navigation.js";
import { showSession } from "./session.js";
import { skeleton } from "./elements.js";

/**
 * @typedef {object} View
 * @property {string} [title]
 * @property {(root: HTMLElement, params: ViewParams) => void} mount
 * @typedef {[RegExp, (keyof ViewParams)[], () => Promise<View>, string[]]} Route
 */

/** The style sheets of a picture that fills the window. */
const VIEWER = [
  "views/job.css",
  ...["picture", "tools", "stage", "viewer", "drawer"].map((name) => `views/picture/${name}.css`),
];

// For each view: the pattern of its path, the names of the pattern's groups, the module, and the style sheets to wait for.
/** @type {Route[]} */
const ROUTES = [
  [/^\/$/, [], () => import("./views/start.js"), ["editor.css", "views/start.css", "views/start/panels.css"]],
  [/^\/jobs$/, [], () => import("./views/jobs.js"), ["views/job.css", "views/jobs.css"]],
  [/^\/jobs\/([^/]+)$/, ["id"], () => import("./views/job.js"), ["editor.css", ...VIEWER]],
  [/^\/service$/, [], () => import("./views/service.js"), ["views/service.css"]],
  [
    /^\/compare\/([^/]+)\/([^/]+)$/,
    ["a", "b"],
    () => import("./views/compare.js"),
    [...VIEWER, "views/compare/compare.css"],
  ],
];

const main = /** @type {HTMLElement} */ (document.getElementById("main"));
// Of the view that is shown: aborted when another one takes its place.
let life = new AbortController();
// Counts visits: a view whose module arrives after the next click is not shown.
let visit = 0;
/** @type {string | null} */
let shown = null;

/** @param {string} path @returns {{load: () => Promise<View>, params: object, styles: string[]}} */
function found(path) {
  for (const [form, names, load, styles] of ROUTES) {
    const match = form.exec(path);
    const values = match && match.slice(1).map(decoded);
    if (values && !values.includes(null))
      return { load, params: Object.fromEntries(names.map((name, i) => [name, values[i]])), styles };
  }
  return { load: () => import("./views/missing.js"), params: {}, styles: [] };
}

/** A part of a path, or null if it is no UTF-8. @param {string} part */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return null;
  }
}

/** Add a style sheet unless it is there, and wait until it applies. @param {string} path */
function styled(path) {
  const href = ofPage(path);
  if (document.querySelector(`link[data-all], link[href="${href}"]`)) return Promise.resolve();
  return new Promise((resolve) => {
    // Also on an error: an unstyled page is better than none.
    document.head.append(h("link", { rel: "stylesheet", href, onload: resolve, onerror: resolve }));
  });
}

/** @param {{focus: boolean}} options - Whether to move the focus to the view. */
async function show({ focus }) {
  const current = ++visit;
  shown = location.pathname + location.search;
  const { load, params, styles } = found(location.pathname);
  /** @type {View | null} */
  const view = await Promise.all([load(), ...styles.map(styled)]).then(
    ([loaded]) => loaded,
    () => null,
  );
  if (current !== visit) return;
  life.abort();
  life = new AbortController();
  main.replaceChildren();
  if (!view) return refuse();
  document.title = `${view.title ?? "Penumbra"} · Penumbra`;
  const query = new URLSearchParams(location.search);
  view.mount(main, /** @type {ViewParams} */ ({ ...params, query, signal: life.signal }));
  // A view that waits for the service has nothing to show yet; it replaces all that is here.
  if (!main.childElementCount) main.append(skeleton(3));
  for (const link of /** @type {NodeListOf<HTMLAnchorElement>} */ (document.querySelectorAll("nav a"))) {
    const here =
      link.pathname === location.pathname ||
      (link.pathname !== "/" && location.pathname.startsWith(link.pathname));
    if (here) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  if (focus) {
    main.focus({ preventScroll: true });
    scrollTo(0, 0);
    announce(view.title ?? "");
  }
}

/** Offer to load the page again: a browser does not ask twice for a module, and a new version has other addresses. */
function refuse() {
  document.title = "Penumbra";
  const again = () => location.reload();
  main.append(
    h("h1", "This view could not be loaded"),
    h("p.lead", { role: "alert" }, "The service does not answer, or has been updated."),
    h("button.primary", { onclick: again }, "Load the page again"),
  );
}

document.addEventListener("click", (event) => {
  const link = event.target instanceof Element && event.target.closest("a[href]");
  const plain = event.button === 0 && !event.metaKey && !event.ctrlKey && !event.shiftKey && !event.altKey;
  if (
    !(link instanceof HTMLAnchorElement) ||
    !plain ||
    event.defaultPrevented ||
    link.target ||
    link.hasAttribute("download")
  )
    return;
  const page = link.origin === location.origin && !/^\/(v1|web|docs|openapi)/.test(link.pathname);
  if (!page || (link.hash && link.pathname === location.pathname)) return;
  event.preventDefault();
  navigate(link.pathname + link.search);
});
addEventListener("popstate", () => {
  // Jumps to an anchor fire this event too.
  if (location.pathname + location.search !== shown) show({ focus: true });
});
addEventListener(AMENDED, () => (shown = location.pathname + location.search));
addEventListener(MOVED, () => show({ focus: true }));

acceptDrops();
show({ focus: false });
// The view does not wait for the name of the user.
showSession(/** @type {HTMLElement} */ (document.getElementById("session"))).catch(() => {});
