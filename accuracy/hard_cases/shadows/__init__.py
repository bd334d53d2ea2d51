"""Hard cases E: shadows and light."""
