"""Programs of others as components: what they declare, how they run, and what becomes of them."""
