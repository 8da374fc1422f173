"""What tests of robots and plug-ins need: virtual time, a bus within the process, findings of a text, golden files."""
