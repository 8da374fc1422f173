"""Systems for programs that keep services alive: systemd, Compose, Kubernetes. One file per program."""
