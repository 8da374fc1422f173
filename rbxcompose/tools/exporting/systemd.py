"""A unit of systemd for each share of a host.

The unit starts the share when the network is up, restarts it when it fails, but not for what another try does not
change, and kills it if its supervisor is silent. It sees no more of the machine than it needs. Meanings of all options:
systemd.exec(5), systemd.service(5), systemd.resource-control(5).
"""

from collections.abc import Iterator

from rbxcompose.tools.exporting.exported_share import FILE, GRACE, MISSION_FAILED, REFUSED, ExportedShare

WATCHDOG = 10  # [s]
_SANDBOX = """
NoNewPrivileges=yes
CapabilityBoundingSet=
ProtectSystem=strict
ProtectHome=read-only
PrivateTmp=yes
ProtectKernelTunables=yes
ProtectKernelModules=yes
ProtectKernelLogs=yes
ProtectControlGroups=yes
ProtectClock=yes
ProtectHostname=yes
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
RestrictNamespaces=yes
RestrictSUIDSGID=yes
LockPersonality=yes
SystemCallArchitectures=native
UMask=0077
DevicePolicy=closed
"""


def unit_name(share: ExportedShare) -> str:
    """Return the file name of a share's unit."""
    return f"rbxcompose-{share.name}.service"


def unit(share: ExportedShare, *, program: str, file: str, user: str) -> str:
    """Return the unit of a share; `program` and `file`, the system's file, are absolute paths on the host."""
    return "\n".join(_lines(share, program, file, user)) + "\n"


def _lines(share: ExportedShare, program: str, file: str, user: str) -> Iterator[str]:
    words = " ".join(_quoted(file if word == FILE else word) for word in share.command)
    yield f"# '{share.robot}' on host '{share.host}', from the system '{share.system}'. Install it:"
    yield f"#   sudo cp {unit_name(share)} /etc/systemd/system/ && sudo systemctl enable --now {unit_name(share)}"
    yield f"# As {user}, with XDG_RUNTIME_DIR=/run/rbxcompose-{share.name}, 'rbxcompose ps' and other verbs find it."
    yield "[Unit]"
    yield f"Description=Robot {share.robot}, share of host {share.host}"
    yield "Wants=network-online.target"
    yield f"After=network-online.target{' time-sync.target' if share.has_certificates else ''}"  # they have dates
    yield "StartLimitIntervalSec=60"
    yield "StartLimitBurst=5"
    yield ""
    yield "[Service]"
    yield "Type=notify"
    yield "NotifyAccess=all"
    yield f"WatchdogSec={WATCHDOG}"
    yield "TimeoutStartSec=infinity"  # it waits for the other hosts
    yield f"User={user}"
    yield f"RuntimeDirectory=rbxcompose-{share.name}"
    yield "RuntimeDirectoryMode=0700"
    yield "RuntimeDirectoryPreserve=yes"  # its log stays
    yield f"Environment=XDG_RUNTIME_DIR=/run/rbxcompose-{share.name} NO_COLOR=1"
    yield f"ExecStart={_quoted(program)} {words}"
    yield "Restart=on-failure"
    yield "RestartSec=1"
    yield f"RestartPreventExitStatus={' '.join(map(str, (*REFUSED, MISSION_FAILED)))}"
    yield "SuccessExitStatus=130"
    yield "KillMode=mixed"
    yield f"TimeoutStopSec={share.rest_time + GRACE:g}"
    yield _SANDBOX.strip()
    for device in share.devices:
        yield f"DeviceAllow={device} rw"
    if share.devices:
        yield "SupplementaryGroups=dialout"
    yield ""
    yield "[Install]"
    yield "WantedBy=multi-user.target"


def _quoted(word: str) -> str:
    """Return a word as systemd reads it."""
    plain = word.replace("%", "%%").replace("$", "$$")
    return f'"{plain}"' if " " in plain or '"' in plain or "\\" in plain else plain
