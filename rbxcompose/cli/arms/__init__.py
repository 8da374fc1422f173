"""What `arm` does without a robot that runs."""
