"""Grade a submission by the tests of a manifest, and export the result in each platform's format."""
