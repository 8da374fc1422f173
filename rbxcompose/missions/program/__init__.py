"""What a mission is once it was read: nodes, kinds and modifiers, and what they answer."""
