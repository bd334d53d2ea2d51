"""Questions that a worker answers while a request waits: quotes, traces, inspected pixels, comparisons."""
