// The numbers of the pixel under the cursor, and its colour, over the picture.

import { h } from "../../dom.js";

/** @param {import("./film.js").Film} film @param {import("./develop.js").Developer} developer */
export function makeReadout(film, developer) {
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
      const codes = developer.codes(pixel.x, pixel.y);
      swatch.style.backgroundColor = codes ? `rgb(${codes.join(" ")})` : "transparent";
    },
  };
}
