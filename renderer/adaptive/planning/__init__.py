"""What target quality needs beside the plan of its samples: a plan of pilot samples, and pixels to watch."""
