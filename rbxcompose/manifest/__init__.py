"""From text to a typed model of the whole robot; every value keeps the place that it came from."""
