"""Traces of requests, jobs and tiles, sent by OpenTelemetry where somebody collects them."""
