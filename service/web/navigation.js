// Navigation between views. The router listens to events, so views need not import it.

export const MOVED = "penumbra:moved";
export const AMENDED = "penumbra:amended";

/** Go to another view, as a click on its link would. @param {string} path */
export function navigate(path, { replace = false } = {}) {
  history[replace ? "replaceState" : "pushState"](null, "", path);
  dispatchEvent(new Event(MOVED));
}

/** Keep what this view shows in its address. @param {Record<string, string | null>} values - Null removes one. */
export function amend(values) {
  const query = new URLSearchParams(location.search);
  for (const [name, value] of Object.entries(values)) {
    if (value === null) query.delete(name);
    else query.set(name, value);
  }
  const text = query.size ? `?${query}`.replaceAll("%2C", ",") : "";
  if (text === location.search) return;
  history.replaceState(null, "", location.pathname + text + location.hash);
  dispatchEvent(new Event(AMENDED));
}
