// Going to another view of the page. The router listens; views need not know it.

export const MOVED = "penumbra:moved";

/** Go to another view, as a click on a link to it would. */
export function navigate(path, { replace = false } = {}) {
  history[replace ? "replaceState" : "pushState"](null, "", path);
  dispatchEvent(new Event(MOVED));
}
