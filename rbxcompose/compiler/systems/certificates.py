"""The certificates of a system: an authority of its own, and a certificate for each host. Made by OpenSSL.

They are kept in a folder of the user, apart from the manifests: `~/.config/rbxcompose/systems/NAME`. Each host needs
its own three files; the key of the authority stays where `security init` ran.
"""

import contextlib
import ipaddress
import os
import ssl
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rbxcompose.base.files import read_regular, replace_file
from rbxcompose.compiler.plan.model import LinkTls

NO_SECURITY, MUTUAL = "none", "mtls"
LARGEST = 100_000  # [B] of a key or certificate
AUTHORITY, AUTHORITY_KEY, CERTIFICATE, KEY = "ca.pem", "ca_key.pem", "cert.pem", "key.pem"
DAYS_OF_AUTHORITY, DAYS = 3650, 825
_NEW_KEY = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")


class OpensslError(Exception):
    """Raised when OpenSSL cannot make a certificate, with the reason."""


def folder_of(system: str, environment: Mapping[str, str]) -> Path:
    """Return where the certificates of a system are kept on this machine."""
    base = environment.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    return Path(base, "rbxcompose", "systems", system)


def tls_of(folder: Path, host: str, security: str) -> LinkTls:
    """Return the files of a host; whether they exist is for the caller to see."""
    own = folder / host
    return LinkTls(str(own / AUTHORITY), str(own / CERTIFICATE), str(own / KEY), mutual=security == MUTUAL)


def missing(tls: LinkTls) -> list[str]:
    """Return which of the files cannot be read."""
    return [path for path in (tls.authority, tls.certificate, tls.key) if not os.access(path, os.R_OK)]


class CertificateError(Exception):
    """Raised when the other hosts will not accept a certificate, with the reason."""


def days_left(tls: LinkTls, name: str) -> float:
    """Return for how many days other hosts will accept a host's certificate; `name` is the one that it must have.

    The host shakes hands with itself, so what is examined is what the others will examine: chain, dates and key.

    Raises:
        CertificateError: if they would refuse it.
        OSError: if a file cannot be read.
    """
    server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False  # its address is for those that dial it
    one, other = ssl.MemoryBIO(), ssl.MemoryBIO()
    try:
        server.load_cert_chain(tls.certificate, tls.key)
        client.load_verify_locations(tls.authority)
        ends = (client.wrap_bio(one, other), server.wrap_bio(other, one, server_side=True))
        for end in ends * 2:
            with contextlib.suppress(ssl.SSLWantReadError):
                end.do_handshake()
    except ssl.SSLCertVerificationError as error:
        raise CertificateError(error.verify_message) from error
    except ssl.SSLError as error:
        raise CertificateError(f"its files are damaged or do not belong together ({error.reason})") from error
    found: Any = ends[0].getpeercert() or {}
    names = [value for part in found["subject"] for key, value in part if key == "commonName"]
    if names != [name]:
        raise CertificateError(f"it is that of '{names[0] if names else 'nobody'}'")
    return (ssl.cert_time_to_seconds(found["notAfter"]) - time.time()) / 86_400


def make_authority(folder: Path, system: str) -> None:
    """Make the authority of a system, unless the folder has one.

    Raises:
        OpensslError: if it cannot be made.
        OSError: if the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    if (folder / AUTHORITY_KEY).exists():
        return
    subject = ("-subj", f"/CN={system}")
    files = ("-keyout", AUTHORITY_KEY, "-out", AUTHORITY)
    _openssl(folder, "req", "-x509", *_NEW_KEY, "-days", str(DAYS_OF_AUTHORITY), *subject, *files)


def make_certificate(folder: Path, system: str, host: str, address: str | None, days: int = DAYS) -> None:
    """Make a new key and certificate of a host; its name is `HOST.SYSTEM`, and it proves to be at its address.

    Raises:
        OpensslError: if they cannot be made.
        OSError: if the folder cannot be written.
    """
    own = folder / host
    own.mkdir(exist_ok=True, mode=0o700)
    names = [f"DNS:{host}.{system}".replace("_", "-"), *([_alternative(address)] if address else [])]
    (own / "extensions").write_text(f"subjectAltName={','.join(names)}\nbasicConstraints=CA:FALSE\n", encoding="utf-8")
    request = f"{host}/request.pem"
    subject = ("-subj", f"/CN={common_name(system, host)}")
    _openssl(folder, "req", *_NEW_KEY, *subject, "-keyout", f"{host}/{KEY}", "-out", request)
    signed = ("-CA", AUTHORITY, "-CAkey", AUTHORITY_KEY, "-CAcreateserial", "-days", str(days))
    files = ("-in", request, "-extfile", f"{host}/extensions", "-out", f"{host}/{CERTIFICATE}")
    _openssl(folder, "x509", "-req", *files, *signed)
    replace_file(own / AUTHORITY, read_regular(folder / AUTHORITY, LARGEST))
    for name in ("extensions", "request.pem"):
        (own / name).unlink()


def common_name(system: str, host: str) -> str:
    """Return the name in the certificate of a host; those of OpenSSL have at most 64 characters."""
    return f"{host}.{system}"[:64]


def _alternative(address: str) -> str:
    try:
        ipaddress.ip_address(address)
    except ValueError:
        return f"DNS:{address}"
    return f"IP:{address}"


def _openssl(folder: Path, *words: Sequence[str] | str) -> None:
    command = ["openssl", *map(str, words)]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, umask=0o077, check=False)
    except OSError as error:
        raise OpensslError(f"openssl cannot run: {error.strerror}") from error
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        raise OpensslError(lines[-1] if lines else f"openssl ended with {done.returncode}")
