"""Hard cases H: trees of boxes, mirrors and glass."""
