"""Times and errors of Penumbra, measured on the machine at hand."""
