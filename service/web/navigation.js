// Navigation between views. The router listens to an event, so views need not import it.

export const MOVED = "penumbra:moved";

/** Go to another view, as a click on its link would. */
export function navigate(path, { replace = false } = {}) {
  history[replace ? "replaceState" : "pushState"](null, "", path);
  dispatchEvent(new Event(MOVED));
}
