"""Hard cases I: samples, sums and output."""

from accuracy.hard_cases.harness import gathered
from accuracy.hard_cases.samples_and_output import output, samples

SECTION = gathered("Samples, sums, output", samples.SECTION, output.SECTION)
