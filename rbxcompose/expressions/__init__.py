"""The expression language of manifests and missions: parsed, checked without values, evaluated with them."""
