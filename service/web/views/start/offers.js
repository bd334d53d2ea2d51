// Which offers of a quote are better than the quality that was chosen.

// An offer must take at most this share of the time to count as sooner.
const WORTH = 0.8;

/** @typedef {OfferDocument & {error: PredictedNumber}} KnownOffer */

/**
 * Better offers, each with its name: the same error sooner, and half the error.
 *
 * @param {OfferDocument[]} offers - All offers of a quote.
 * @param {OfferDocument} offer - The one of the chosen quality.
 * @returns {[string, KnownOffer][]}
 */
export function alternatives(offers, offer) {
  const known = /** @type {KnownOffer[]} */ (
    offers.filter((other) => other.error && other !== offer && !isCoarser(other, offer))
  );
  const { error: own } = offer;
  if (!own) {
    const targets = known.filter(
      (other) => other.quality.mode === "target" && other.seconds.estimate <= offer.seconds.estimate,
    );
    return targets
      .slice(-1)
      .map((other) => /** @type {[string, KnownOffer]} */ (["With a known error", other]));
  }
  const same = soonest(known.filter((other) => other.error.estimate <= own.estimate));
  // By the upper end of its interval too: twice the error of the one may be within the noise of a short pilot.
  const half = soonest(
    known.filter(({ error }) => error.estimate <= own.estimate / 2 && error.high <= own.estimate),
  );
  const sooner = same && same !== half && same.seconds.estimate < WORTH * offer.seconds.estimate;
  /** @type {[string, KnownOffer][]} */
  const better = [];
  if (sooner) better.push(["The same error, sooner", same]);
  if (half) better.push(["Half the error", half]);
  return better;
}

/** @param {KnownOffer[]} list @returns {KnownOffer | undefined} */
const soonest = (list) => [...list].sort((one, other) => one.seconds.estimate - other.seconds.estimate)[0];

/**
 * Whether a quality has the patterns of another and fewer samples: where its error seems smaller, that is noise.
 *
 * @param {OfferDocument} one
 * @param {OfferDocument} other
 */
function isCoarser({ quality: one }, { quality: other }) {
  if (one.mode !== "fixed" || other.mode !== "fixed") return false;
  const parts = /** @type {const} */ (["antialiasing", "light"]);
  return (
    parts.every((part) => one[part].pattern === other[part].pattern) &&
    parts.every((part) => one[part].samples <= other[part].samples)
  );
}
