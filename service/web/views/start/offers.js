// Which offers of a quote are better than the quality that was chosen.

// An offer must take at most this share of the time to count as sooner.
const WORTH = 0.8;

/**
 * Better offers, each with its name: the same error sooner, and half the error.
 *
 * @param {object[]} offers - All offers of a quote.
 * @param {object} offer - The one of the chosen quality.
 */
export function alternatives(offers, offer) {
  const known = offers.filter((other) => other.error && other !== offer && !isCoarser(other, offer));
  if (!offer.error) {
    const targets = known.filter(
      (other) => other.quality.mode === "target" && other.seconds.estimate <= offer.seconds.estimate,
    );
    return targets.slice(-1).map((other) => ["With a known error", other]);
  }
  const same = soonest(known.filter((other) => other.error.estimate <= offer.error.estimate));
  // By the upper end of its interval too: twice the error of the one may be within the noise of a short pilot.
  const half = soonest(
    known.filter(
      ({ error }) => error.estimate <= offer.error.estimate / 2 && error.high <= offer.error.estimate,
    ),
  );
  const sooner = same && same !== half && same.seconds.estimate < WORTH * offer.seconds.estimate;
  return [sooner && ["The same error, sooner", same], half && ["Half the error", half]].filter(Boolean);
}

const soonest = (list) =>
  list.reduce(
    (best, other) => (!best || other.seconds.estimate < best.seconds.estimate ? other : best),
    null,
  );

/** Whether a quality has the patterns of another and fewer samples: where its error seems smaller, that is noise. */
function isCoarser({ quality: one }, { quality: other }) {
  if (one.mode !== "fixed" || other.mode !== "fixed") return false;
  const parts = ["antialiasing", "light"];
  return (
    parts.every((part) => one[part].pattern === other[part].pattern) &&
    parts.every((part) => one[part].samples <= other[part].samples)
  );
}
