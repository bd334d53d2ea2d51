"""Hard cases I: samples, sums and output."""
