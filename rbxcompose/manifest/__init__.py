"""From text to a located tree to sections."""
