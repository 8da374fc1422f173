"""Running robots: which one is addressed, what it is asked, how it is watched and changed."""
