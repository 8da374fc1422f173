"""Files of other programs become manifests: what they say, where it stood, and what could not be carried over."""
