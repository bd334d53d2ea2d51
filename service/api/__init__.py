"""HTTP: authentication, request bodies, headers, errors and routes."""
