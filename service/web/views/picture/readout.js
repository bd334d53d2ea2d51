// The numbers of a pixel: over the picture for the one under the cursor, and on the clipboard.

import { announce, h } from "../../dom.js";

/** @param {PictureScreen} screen @param {import("./develop.js").Developer} developer */
export function makeReadout(screen, developer) {
  const swatch = h("span.swatch", { "aria-hidden": "true" });
  const line = h("p.readout.number");
  const element = h("div.stage-readout", { hidden: true }, swatch, line);

  return {
    element,
    get text() {
      return line.textContent ?? "";
    },
    /** Show the pixel under the cursor as it is now. */
    show() {
      const pixel = screen.cursor;
      element.hidden = !pixel;
      line.textContent = pixel ? `${pixel.x}, ${pixel.y}   ${developer.describe(pixel.x, pixel.y)}` : "";
      if (!pixel) return;
      const [r, g, b, alpha] = developer.color(pixel.x, pixel.y);
      swatch.style.backgroundColor = `rgb(${r} ${g} ${b} / ${alpha / 255})`;
    },
    /** Copy the values of a pixel. @param {PixelPlace} pixel */
    async copy({ x, y }) {
      const values = developer.layer?.at(x, y) ?? developer.filmAt(x).at(x, y);
      const done = values && (await copied(values.join(" ")));
      announce(done ? `The values of pixel ${x}, ${y} are copied.` : "Nothing was copied.");
    },
  };
}

/** @param {string} text @returns {Promise<boolean>} Whether it is on the clipboard. */
export async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    // Browsers have a clipboard on secure addresses alone, and a service in a local network has none.
    const area = h("textarea.unseen", { value: text, readOnly: true });
    const focused = document.activeElement;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    if (focused instanceof HTMLElement) focused.focus({ preventScroll: true });
    return done;
  }
}
