"""What target quality needs besides the plan of its samples: a plan of pilot samples, and pixels to watch."""
