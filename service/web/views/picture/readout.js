// The numbers of the pixel under the cursor, and its colour, over the picture.

import { h } from "../../dom.js";

/** @param {import("./screen.js").Screen} screen @param {import("./develop.js").Developer} developer */
export function makeReadout(screen, developer) {
  const swatch = h("span", { className: "swatch", "aria-hidden": "true" });
  const line = h("p", { className: "readout number" });
  const element = h("div", { className: "stage-readout", hidden: true }, swatch, line);

  return {
    element,
    get text() {
      return line.textContent;
    },
    show(pixel) {
      element.hidden = !pixel;
      if (!pixel) return (line.textContent = "");
      line.textContent = `${pixel.x}, ${pixel.y}   ${developer.describe(pixel.x, pixel.y)}`;
      const [r, g, b, alpha] = screen.context.getImageData(pixel.x, pixel.y, 1, 1).data;
      swatch.style.backgroundColor = `rgb(${r} ${g} ${b} / ${alpha / 255})`;
    },
  };
}
