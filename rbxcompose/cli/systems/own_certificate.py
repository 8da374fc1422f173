"""Whether other hosts will accept the certificate of a host."""

from __future__ import annotations

from collections.abc import Iterator

from rbxcompose.findings import Finding, Severity, kind
from rbxcompose.plan.model import LinkTls
from rbxcompose.systems.certificates import CertificateError, days_left, missing

SOON = 30.0  # [days] before a certificate expires

NO_CERTIFICATE = kind("RBX6117")
REFUSED_CERTIFICATE = kind("RBX6143")
SOON_EXPIRED = kind("RBX6144", Severity.WARNING)


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
