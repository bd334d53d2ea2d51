// Which offers of a quote are better than the quality that was chosen.

// An offer is sooner from this share of the time on, and has a smaller error from this share of the error on.
const WORTH = 0.8;
// Predicted errors are not exact enough to call one less than a hundredth of another.
const MOST_PARTS = 100;
const SAME = "The same error";

/** @typedef {OfferDocument & {error: PredictedNumber}} KnownOffer */

/**
 * Better offers, each with its name: the soonest of no larger error, and of at most half the error.
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
    known.filter(
      ({ error }) => own.estimate > 0 && error.estimate <= own.estimate / 2 && error.high <= own.estimate,
    ),
  );
  const isSooner = (/** @type {KnownOffer} */ other) =>
    other.seconds.estimate < WORTH * offer.seconds.estimate;
  const better = [same && isSooner(same) ? same : undefined, half].filter((other) => other !== undefined);
  return [...new Set(better)].map((other) => {
    const share = shareOfError(other.error.estimate / own.estimate);
    if (!isSooner(other)) return [share, other];
    return [share === SAME ? `${share}, sooner` : `Cheaper and better: ${share.toLowerCase()}`, other];
  });
}

/** Name the share of an error in another, rounded up. @param {number} ratio */
function shareOfError(ratio) {
  if (!(ratio < WORTH)) return SAME;
  const parts = Math.min(Math.floor(1 / ratio), MOST_PARTS);
  return `${["", "A smaller", "Half the", "A third of the", "A quarter of the"][parts] ?? `1/${parts} of the`} error`;
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
