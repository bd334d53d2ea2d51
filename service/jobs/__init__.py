"""What users do with jobs: submit, list, watch, cancel, fetch and keep them."""
