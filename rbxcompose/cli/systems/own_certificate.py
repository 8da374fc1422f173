"""Whether other hosts will accept the certificate of a host."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.plan.model import LinkTls
from rbxcompose.systems.certificates import CertificateError, days_left, missing

SOON = 30.0  # [days] before a certificate expires

NO_CERTIFICATE = kind(
    "RBX6117",
    """The host has no certificate

With `security: tls` or `mtls`, each host needs a certificate of the system, its key, and the certificate of the
authority. They are in `~/.config/rbxcompose/systems/SYSTEM/HOST` of the user that runs it. `security init` makes them
and brings them to hosts that have `ssh`.

Bad: `rbxcompose up systems/two_hosts.yaml --host robot`, on a robot that never got its files.
Good: `rbxcompose security init systems/two_hosts.yaml` on the desk, then the same.
""",
)
REFUSED_CERTIFICATE = kind(
    "RBX6143",
    """Other hosts will refuse this host's certificate

It has expired or is not valid yet, belongs to another host or another authority, or its key is that of another
certificate. A host whose clock is wrong takes any certificate for expired. The hosts would wait for each other for
ever, since a router that refuses a link says nothing.

Bad: the folder of the desk, copied to the robot.
Good: `rbxcompose security init systems/two_hosts.yaml` makes new ones for all hosts.
""",
)
SOON_EXPIRED = kind(
    "RBX6144",
    """The host's certificate expires soon

When it has expired, other hosts refuse new links; those that stand stay.

Bad: to wait for that day.
Good: `rbxcompose security init systems/two_hosts.yaml`, then start the robot again at the next opportunity.
""",
    Severity.WARNING,
)


def certificate_findings(tls: LinkTls, name: str, path: str) -> Iterator[Finding]:
    """Yield what keeps other hosts from accepting the certificate of a host, or soon will; `name` must be in it."""
    again = f"rbxcompose security init {path}"
    if lacking := missing(tls):
        yield NO_CERTIFICATE.at(None, f"'{lacking[0]}' cannot be read", help=again)
        return
    try:
        if (days := days_left(tls, name)) < SOON:
            yield SOON_EXPIRED.at(None, f"'{tls.certificate}' expires in {days:.0f} days", help=again)
    except (CertificateError, OSError) as error:
        yield REFUSED_CERTIFICATE.at(None, f"other hosts will refuse '{tls.certificate}': {error}", help=again)
