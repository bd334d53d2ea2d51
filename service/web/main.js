// The router: one view at a time in <main>, chosen by the path.

import { announce } from "./dom.js";
import { MOVED, navigate } from "./navigation.js";
import { showSession } from "./session.js";

const ROUTES = [
  [/^\/$/, [], () => import("./views/start.js")],
  [/^\/jobs$/, [], () => import("./views/jobs.js")],
  [/^\/jobs\/([^/]+)$/, ["id"], () => import("./views/job.js")],
  [/^\/compare\/([^/]+)\/([^/]+)$/, ["a", "b"], () => import("./views/compare.js")],
];

const main = document.getElementById("main");
let unmount = () => {};
// The number of the newest visit: a view whose module arrives after the next click is not shown.
let visit = 0;

function found(path) {
  for (const [form, names, load] of ROUTES) {
    const match = form.exec(path);
    if (match) {
      return {
        load,
        params: Object.fromEntries(names.map((name, i) => [name, decodeURIComponent(match[i + 1])])),
      };
    }
  }
  return { load: () => import("./views/missing.js"), params: {} };
}

async function show({ focus }) {
  const current = ++visit;
  const { load, params } = found(location.pathname);
  const view = await load();
  if (current !== visit) return;
  unmount();
  main.replaceChildren();
  document.title = `${view.title ?? "Penumbra"} · Penumbra`;
  unmount = view.mount(main, { ...params, query: new URLSearchParams(location.search) });
  for (const link of document.querySelectorAll("nav a")) {
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

document.addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href]");
  const plain = event.button === 0 && !event.metaKey && !event.ctrlKey && !event.shiftKey && !event.altKey;
  if (!link || !plain || event.defaultPrevented || link.target || link.hasAttribute("download")) return;
  const page = link.origin === location.origin && !/^\/(v1|web|docs|openapi)/.test(link.pathname);
  if (!page || (link.hash && link.pathname === location.pathname)) return;
  event.preventDefault();
  navigate(link.pathname + link.search);
});
addEventListener("popstate", () => show({ focus: true }));
addEventListener(MOVED, () => show({ focus: true }));

show({ focus: false });
// Who one is matters less than the view, and may come later or never.
showSession(document.getElementById("session")).catch(() => {});
