"""Zenoh's access control for a router: programs of its host may do all, each other host what was computed for it.

A host is known by the name in its certificate, which only TLS proves; programs of this host come by TCP on the loopback
interface or by Unix sockets. Messages that are not allowed are dropped without a word, at the router that receives.
"""

from collections.abc import Iterable, Mapping, Sequence

from rbxcompose.base.dataclass import dataclass
from rbxcompose.bus.names import ADMIN, DENIED, EXCHANGE_DOMAIN, topic_pattern

_TOKENS = ("liveliness_token", "liveliness_query", "declare_liveliness_subscriber")
_GIVE = ("put", "delete", "reply", "declare_queryable")
_TAKE = ("declare_subscriber", "query")
_ALL = (*_GIVE, *_TAKE, *_TOKENS)
_LOCAL = ("tcp", "unixsock-stream")


@dataclass(frozen=True, slots=True)
class AllowedHost:
    """What a host may do, by topics and services: give them, take them, or both."""

    certificate: str  # the name in it
    gives: tuple[str, ...]
    takes: tuple[str, ...]
    both: tuple[str, ...]


def access_control(robot: str, domain: int, hosts: Sequence[AllowedHost]) -> dict[str, object]:
    """Return the configuration of access control; all that it does not allow is denied."""
    rules = [_rule("all", _ALL, ("ingress", "egress"), ["**", "**/@adv/**", "@ros2_lv/**"])]
    policies = [{"rules": ["all"], "subjects": ["this host"]}]
    subjects: list[Mapping[str, object]] = [{"id": "this host", "link_protocols": list(_LOCAL)}]
    tried = [f"{DENIED}{robot}/*"]
    tokens = [f"@ros2_lv/{domain}/**"]
    for host in hosts:
        gives, takes, both = (_patterns(domain, names) for names in (host.gives, host.takes, host.both))
        everything = [*gives, *takes, *both, f"{ADMIN}{robot}/**"]
        own = {
            "gives": _rule(f"{host.certificate} gives", _GIVE, ("ingress",), gives),
            "takes": _rule(f"{host.certificate} takes", _TAKE, ("ingress",), takes),
            "runtime": _rule(f"{host.certificate} runtime", _ALL, ("ingress",), [*both, f"{ADMIN}{robot}/**"]),
            "gets": _rule(f"{host.certificate} gets", _ALL, ("egress",), everything),
            "tokens": _rule(
                f"{host.certificate} tokens", _TOKENS, ("ingress", "egress"), [*tokens, *_caches(everything)]
            ),
            # A message at these keys is asked for and sent, so that it is known to be stopped where it comes in.
            "asked": _rule(f"{host.certificate} asked", ["declare_subscriber"], ("ingress", "egress"), tried),
            "tried": _rule(f"{host.certificate} tried", ["put"], ("egress",), tried),
            "caches": _rule(
                f"{host.certificate} caches", _ALL, ("ingress", "egress"), _caches([*gives, *takes, *both])
            ),
        }
        kept = [rule for rule in own.values() if rule["key_exprs"]]
        rules += kept
        policies.append({"rules": [str(rule["id"]) for rule in kept], "subjects": [host.certificate]})
        subjects.append(_proven(host.certificate))
    return {"enabled": True, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies}


def exchange_access(gives: Iterable[str], takes: Iterable[str], hosts: Sequence[AllowedHost] = ()) -> dict[str, object]:
    """Return the access control of a robot's exchange: only these names leave it, and only those come in.

    With `hosts`, robots on each of them `take` and `give` what is theirs, and all those on this host.
    """
    here: Mapping[str, object] = {"id": "this host", "link_protocols": list(_LOCAL)} if hosts else {"id": "others"}
    ends = [(here, gives, takes), *((_proven(host.certificate), host.takes, host.gives) for host in hosts)]
    rules, policies = list[dict[str, object]](), list[dict[str, object]]()
    for subject, out, back in ends:
        name = subject["id"]
        given, taken = _patterns(EXCHANGE_DOMAIN, out), _patterns(EXCHANGE_DOMAIN, back)
        own = [
            _rule(f"{name} tokens", _TOKENS, ("ingress", "egress"), ["@ros2_lv/**", *_caches([*given, *taken])]),
            *_one_way(f"{name} takes", given, "egress", "ingress"),
            *_one_way(f"{name} gives", taken, "ingress", "egress"),
        ]
        kept = [rule for rule in own if rule["key_exprs"]]
        rules += kept
        policies.append({"rules": [rule["id"] for rule in kept], "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [subject for subject, _, _ in ends],
        "policies": policies,
    }


def _proven(certificate: str) -> Mapping[str, object]:
    """Return the subject that is a host with a certificate."""
    return {"id": certificate, "cert_common_names": [certificate], "link_protocols": ["tls", "quic"]}


def _one_way(name: str, keys: Sequence[str], data: str, wishes: str) -> list[dict[str, object]]:
    """Return rules for topics whose data flow one way, and the wishes for them the other."""
    everything = [*keys, *_caches(keys)]
    return [_rule(f"{name} data", _GIVE, (data,), everything), _rule(f"{name} wishes", _TAKE, (wishes,), everything)]


def _rule(name: str, messages: Iterable[str], flows: Iterable[str], keys: Sequence[str]) -> dict[str, object]:
    return {"id": name, "messages": [*messages], "flows": [*flows], "permission": "allow", "key_exprs": [*keys]}


def _patterns(domain: int, names: Iterable[str]) -> list[str]:
    return [topic_pattern(domain, name) for name in names]


def _caches(keys: Iterable[str]) -> list[str]:
    """Return where latched topics of these keys keep their last message, which no other pattern matches."""
    return [f"{key}/@adv/**" for key in keys]
