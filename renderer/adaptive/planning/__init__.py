"""Planning of target quality: the plan of pilot samples, and pixels that geometry marks as difficult."""
