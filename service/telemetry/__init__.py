"""Metrics, and traces of requests, jobs and tiles that OpenTelemetry sends to a collector."""
