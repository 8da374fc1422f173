"""The component that runs missions."""
