"""The package has tests of its own, which need it installed: a test runs them there."""

collect_ignore = ["rbx_lamp"]
