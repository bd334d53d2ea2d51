"""Traces of requests, jobs and tiles, sent by OpenTelemetry where a collector is named, and metrics."""
