"""Requests that a worker answers while the client waits: quotes, traces, inspected pixels and comparisons."""
