"""Operations on jobs: submit, list, watch, cancel, fetch and keep."""
