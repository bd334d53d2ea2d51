// The predicted time and error of the picture, before it is rendered.

import { messageOf, post, whenFree } from "../../api.js";
import { h, pause } from "../../dom.js";
import { figure } from "../../elements.js";
import { codeValues, plural, qualityName, seconds } from "../../format.js";
import { requestText } from "../../requests.js";
import { alternatives } from "./offers.js";

// A quote keeps a worker busy for a second or more, so it waits until typing stops.
const IDLE_MS = 900;

/** @typedef {(quality: ResolvedQuality) => void} Use Takes the quality of an offer that was chosen. */

/** @param {Use} onUse @param {AbortSignal} signal */
export function makeQuote(onUse, signal) {
  const body = h("div", { role: "status", "aria-live": "polite" });
  const element = h("section", { className: "quote", "aria-label": "Quote" }, body);
  /** @type {AbortController | null} */
  let asking = null;
  /** @type {OfferDocument | null} */
  let forTime = null;

  /** @param {string} scene @param {QualityDocument | null} quality @param {number | null} limit - Seconds. */
  async function ask(scene, quality, limit) {
    const { signal: current } = (asking = new AbortController());
    element.setAttribute("aria-busy", "true");
    report("Rendering parts of the picture …");
    const again = () => {
      asking?.abort();
      return ask(scene, quality, limit);
    };
    try {
      const quote = await priced(requestText(scene, { quality, seconds: limit }), current);
      if (current.aborted || signal.aborted) return;
      forTime = limited(quote);
      body.replaceChildren(...describe(quote, limit, onUse, again));
    } catch (error) {
      if (!current.aborted && !signal.aborted) report(`No quote: ${messageOf(error)}`);
    }
    if (!current.aborted) element.removeAttribute("aria-busy");
  }

  /** @param {string} request @param {AbortSignal} current @returns {Promise<QuoteDocument>} */
  function priced(request, current) {
    return whenFree(
      () => post("/v1/quotes", request, { signal: current }),
      current,
      () => report("The service is busy, so the quote comes later. You can render without it."),
    );
  }

  const report = (/** @type {string} */ text) => body.replaceChildren(h("p", { className: "soft" }, text));

  /** @param {string} text */
  function forget(text) {
    asking?.abort();
    forTime = null;
    element.removeAttribute("aria-busy");
    report(text);
  }
  signal.addEventListener("abort", () => asking?.abort());

  return {
    element,
    /**
     * Request a quote after a short delay.
     *
     * @param {string} scene
     * @param {QualityDocument | null} quality
     * @param {number | null} limit - Seconds.
     */
    async want(scene, quality, limit) {
      forget("A quote follows when you stop typing.");
      const { signal: current } = (asking = new AbortController());
      await pause(IDLE_MS, current);
      if (!current.aborted && !signal.aborted) ask(scene, quality, limit);
    },
    /** Show a text instead of a quote. */
    clear: forget,
    /** The best target error within the time limit, once it is known. */
    get chosen() {
      return forTime?.quality ?? null;
    },
  };
}

/** The best target error within a time limit. No limit ends fixed samples. @param {QuoteDocument} quote */
const limited = ({ for_seconds: best }) => (best?.quality.mode === "target" ? best : null);

/**
 * @param {QuoteDocument} quote
 * @param {number | null} limit - Seconds.
 * @param {Use} onUse
 * @param {() => void} again
 */
function describe(quote, limit, onUse, again) {
  const offer = limited(quote) ?? quote.asked;
  if (!offer) return untried(quote, limit, again);
  const figures = h(
    "dl",
    { className: "figures" },
    figure(
      "Time",
      `about ${seconds(offer.seconds.estimate)}`,
      `${seconds(offer.seconds.low)} to ${seconds(offer.seconds.high)}, with ${workers(quote.workers)}` +
        (offer.rough ? ". There was no time to know more" : ""),
    ),
    offer.error
      ? figure(
          "Error",
          `about ${codeValues(offer.error.estimate)} code values`,
          `${codeValues(offer.error.low)} to ${codeValues(offer.error.high)}, in units of 1/255`,
        )
      : figure("Error", "not known", offer.error_unknown ?? ""),
  );
  const others = alternatives(quote.offers, offer);
  const fixed = limited(quote) ? null : quote.for_seconds;
  if (fixed?.error) others.push(["Fixed samples, without a limit", { ...fixed, error: fixed.error }]);
  return [
    figures,
    // Where a time limit ends the picture, another pilot knows no more.
    offer.error || offer.quality.mode === "target" ? "" : tryAgain(again),
    others.length
      ? h(
          "ul",
          { className: "offers" },
          others.map(([text, other]) => alternative(text, other, onUse)),
        )
      : "",
  ];
}

/**
 * The cost predicted from the plan alone, for a quality that was too expensive to measure or on a busy machine.
 *
 * @param {QuoteDocument} quote
 * @param {number | null} limit - Seconds.
 * @param {() => void} again
 */
function untried(quote, limit, again) {
  const time = `about ${seconds(Math.min(quote.price.cpu_seconds / quote.workers, limit ?? Infinity))}`;
  const rest = `with ${workers(quote.workers)}, predicted from the plan alone: there was no time to measure`;
  return [
    h(
      "dl",
      { className: "figures" },
      figure("Time", time, rest),
      figure("Error", "not known", "there was no time to estimate it"),
    ),
    tryAgain(again),
  ];
}

/** @param {() => void} again */
const tryAgain = (again) =>
  h("button", { type: "button", className: "quote-again", onclick: again }, "Try again");

/** @param {number} number */
const workers = (number) => plural(number, "worker");

/** @param {string} text @param {import("./offers.js").KnownOffer} offer @param {Use} onUse */
function alternative(text, { quality, seconds: time, error }, onUse) {
  const cost = `${seconds(time.estimate)}, error ${codeValues(error.estimate)} code values`;
  return h(
    "li",
    {},
    h(
      "span",
      {},
      h("strong", {}, text),
      `: ${cost}`,
      h("span", { className: "soft small" }, qualityName(quality)),
    ),
    h(
      "button",
      { type: "button", "aria-label": `Use: ${text}, ${cost}`, onclick: () => onUse(quality) },
      "Use",
    ),
  );
}
