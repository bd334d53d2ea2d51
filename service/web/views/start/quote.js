// What the picture would cost and how far off it would be, before it is rendered.

import { Problem, post } from "../../api.js";
import { debounced, h, pause } from "../../dom.js";
import { qualityName, seconds, steps } from "../../format.js";
import { requestText } from "../../requests.js";

// A quote keeps a worker busy for a second and more, so it waits until nobody types.
const IDLE_MS = 900;
// After this a busy service is asked again, unless it says when.
const RETRY_SECONDS = 2;
// Offers nearer than this are no other choice.
const WORTH = 0.8;

/** @param {(quality: object) => void} onUse - Called with the quality of an offer that was chosen. */
export function makeQuote(onUse, signal) {
  const body = h("div", { className: "quote-body", role: "status", "aria-live": "polite" });
  const element = h("section", { className: "quote", "aria-label": "Quote" }, body);
  let asking = null;
  let forTime = null;

  const later = debounced(IDLE_MS, ask, signal);

  async function ask(scene, quality, limit) {
    asking = new AbortController();
    const { signal: current } = asking;
    element.setAttribute("aria-busy", "true");
    tell("Trying parts of the picture …");
    const again = () => {
      asking.abort();
      return ask(scene, quality, limit);
    };
    try {
      const quote = await priced(requestText(scene, { quality, seconds: limit }), current);
      if (current.aborted || signal.aborted) return;
      forTime = limit === null ? null : quote.for_seconds;
      body.replaceChildren(...told(quote, forTime, onUse, again));
    } catch (error) {
      if (!current.aborted && !signal.aborted) tell(`No quote: ${error.message}`);
    }
    if (!current.aborted) element.removeAttribute("aria-busy");
  }

  /** A quote, now or when the service has time for one. */
  async function priced(request, current) {
    while (true) {
      try {
        return await post("/v1/quotes", request, { signal: current });
      } catch (error) {
        const busy = error instanceof Problem && (error.status === 429 || error.status === 503);
        if (!busy) throw error;
        tell("The service is busy: a quote follows when it has time. You can render without one.");
        await pause(1000 * (error.retryAfter ?? RETRY_SECONDS), current);
        current.throwIfAborted();
      }
    }
  }

  const tell = (text) => body.replaceChildren(h("p", { className: "soft" }, text));

  function forget(text) {
    asking?.abort();
    forTime = null;
    element.removeAttribute("aria-busy");
    tell(text);
  }
  signal.addEventListener("abort", () => asking?.abort());

  return {
    element,
    /** Ask for a quote, soon. */
    want(scene, quality, limit) {
      forget("A quote follows when you stop typing.");
      later(scene, quality, limit);
    },
    /** There is nothing to price. */
    clear: forget,
    /** What comes closest within the time that was asked for, once it is known. */
    get chosen() {
      return forTime?.quality ?? null;
    },
  };
}

function told(quote, forTime, onUse, again) {
  const offer = forTime ?? quote.asked;
  if (!offer) return untried(quote, again);
  const figures = h(
    "dl",
    { className: "figures" },
    figure(
      "Time",
      `about ${seconds(offer.seconds.estimate)}`,
      `${seconds(offer.seconds.low)} to ${seconds(offer.seconds.high)}, with ${workers(quote.workers)}`,
    ),
    offer.error
      ? figure(
          "Error",
          `about ${steps(offer.error.estimate)} steps`,
          `${steps(offer.error.low)} to ${steps(offer.error.high)} steps of 8 bits`,
        )
      : figure("Error", "not known", errorUnknown(offer)),
  );
  const others = alternatives(quote, offer);
  if (!others.length) return [figures];
  return [
    figures,
    h(
      "ul",
      { className: "offers" },
      others.map(([text, other]) => alternative(text, other, onUse)),
    ),
  ];
}

/** What the plan says of a quality that is too expensive to be tried, or that a busy machine did not come to. */
function untried(quote, again) {
  const time = `about ${seconds(quote.price.cpu_seconds / quote.workers)}`;
  const rest = `with ${workers(quote.workers)}, by the plan alone: there was no time to try it`;
  return [
    h("dl", { className: "figures" }, figure("Time", time, rest), figure("Error", "not known", "")),
    h("button", { type: "button", className: "quote-again", onclick: again }, "Try again"),
  ];
}

const workers = (number) => (number === 1 ? "one worker" : `${number} workers`);

function errorUnknown(offer) {
  return offer.quality.mode === "fixed"
    ? "samples of a fixed grid do not tell it"
    : "there was no time to find out";
}

function figure(name, value, range) {
  return h(
    "div",
    {},
    h("dt", {}, name),
    h("dd", {}, h("strong", {}, value), h("span", { className: "soft small" }, range)),
  );
}

function alternative(text, { quality, seconds: time, error }, onUse) {
  const told = `${seconds(time.estimate)}, ${steps(error.estimate)} steps`;
  return h(
    "li",
    {},
    h("span", {}, h("strong", {}, text), `: ${told}`, h("span", { className: "soft small" }, qualityName(quality))),
    h(
      "button",
      { type: "button", "aria-label": `Use: ${text}, ${told}`, onclick: () => onUse(quality) },
      "Use",
    ),
  );
}

/** Offers that are better in one thing and no worse in the other: as good but sooner, and half as far off. */
function alternatives(quote, offer) {
  const known = quote.offers.filter((other) => other.error && other !== offer);
  const soonest = (list) =>
    list.reduce(
      (best, other) => (!best || other.seconds.estimate < best.seconds.estimate ? other : best),
      null,
    );
  if (!offer.error) {
    const targets = known.filter(
      (other) => other.quality.mode === "target" && other.seconds.estimate <= offer.seconds.estimate,
    );
    return targets.slice(-1).map((other) => ["With a known error", other]);
  }
  const same = soonest(known.filter((other) => other.error.estimate <= offer.error.estimate));
  const half = soonest(known.filter((other) => other.error.estimate <= offer.error.estimate / 2));
  const sooner = same && same !== half && same.seconds.estimate < WORTH * offer.seconds.estimate;
  return [sooner && ["As good, sooner", same], half && ["Half the error", half]].filter(Boolean);
}

