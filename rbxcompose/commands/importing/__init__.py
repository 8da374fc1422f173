"""Files of other programs as located trees, and manifests made from them."""
